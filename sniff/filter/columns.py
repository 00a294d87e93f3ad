"""Columns of the names of a filter, and masks: a test of many rows at once. Pure.

A column speaks of plain rows only; what is odd in a table is asked row by row.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from dissectors.columns import DAMAGES, FOUNDS, NONE, ROLES, VERDICTS, Masks, Small, Times
from sniff.engine.table import Table

Scalar = int | float | str | bytes
Accepts = Callable[[Any], bool]
Remembered = dict[int, tuple[Sequence[str | None], Masks]]
"""Which texts were accepted, by the identity of the texts, which many tables share."""

DENSE = 1 << 12
"""Numbers this near to one another are not sorted to find which there are."""
FARTHEST = 1 << 62
"""Numbers beyond are not reckoned with in columns."""


class Closed(Protocol):
    """What became of rows: `engine.closings.Closings`, or the same of rows that are settled."""

    @property
    def verdict(self) -> npt.NDArray[Any]:
        """Place in VERDICTS; -1 where nothing is known."""
        ...

    @property
    def latency(self) -> Times:
        """ns; `NONE` where there is none."""
        ...

    @property
    def attempt(self) -> npt.NDArray[Any]:
        """From 1; 0 where nothing is known."""
        ...


@runtime_checkable
class AcceptsMany(Protocol):
    """A test of values that can test many at once."""

    def many(self, values: npt.NDArray[Any]) -> Masks:
        """Which numbers are accepted."""
        ...


@runtime_checkable
class AcceptsRange(Protocol):
    """A test of values that may know what it says of all between two."""

    def of_all(self, least: int, most: int) -> bool | None:
        """None: not the same of all of them, or not known."""
        ...


@dataclass(frozen=True, slots=True)
class Numbers:
    """Numbers by row; `there`: where a row has one, None: everywhere. `unsure`: rows that have to be asked, None: no
    one."""

    values: npt.NDArray[Any]
    there: Masks | None = None
    unsure: Masks | None = None

    def where(self, accepts: Accepts, remembered: Remembered) -> Masks:
        """Rows whose value is accepted; each distinct value is asked once."""
        chosen = accepts.many(self.values) if isinstance(accepts, AcceptsMany) else self._one_by_one(accepts)
        if self.there is not None:
            chosen = chosen & self.there
        return chosen

    def has(self) -> Masks:
        """Rows that have one."""
        return np.ones(len(self.values), bool) if self.there is None else self.there

    def _one_by_one(self, accepts: Accepts) -> Masks:
        if not len(self.values):
            return np.zeros(0, bool)
        least, most = self.values.min(), self.values.max()
        chosen: Masks
        if self.values.dtype.kind in "iu" and int(most) - int(least) < DENSE:
            places = self.values.astype(np.int64) - int(least)
            accepted = np.zeros(int(most) - int(least) + 1, bool)
            for place in np.flatnonzero(np.bincount(places)).tolist():
                accepted[place] = accepts(int(least) + place)
            chosen = accepted[places]
            return chosen
        distinct, which = np.unique(self.values, return_inverse=True)
        chosen = np.array([accepts(value) for value in distinct.tolist()], bool)[which]
        return chosen


@dataclass(frozen=True, slots=True)
class Texts:
    """Texts by row, as places in `texts`; None is not there."""

    codes: npt.NDArray[np.integer[Any]]
    texts: Sequence[str | None]
    unsure: Masks | None = None

    def where(self, accepts: Accepts, remembered: Remembered) -> Masks:
        """Rows whose text is accepted; each text is asked once."""
        known = remembered.get(id(self.texts))
        if known is None:
            accepted = np.array([text is not None and accepts(text) for text in self.texts], bool)
            if len(remembered) >= _REMEMBERED:
                remembered.clear()
            known = remembered[id(self.texts)] = self.texts, accepted
        chosen: Masks = known[1][self.codes]
        return chosen

    def has(self) -> Masks:
        """Rows that have one."""
        there: Masks = np.array([text is not None for text in self.texts], bool)[self.codes]
        return there


@dataclass(frozen=True, slots=True)
class Bounded:
    """Numbers by row that lie between two, made when those do not decide."""

    make: Callable[[], npt.NDArray[Any]]
    count: int
    least: int
    most: int
    unsure: Masks | None = None

    def where(self, accepts: Accepts, remembered: Remembered) -> Masks:
        """Rows whose value is accepted."""
        if isinstance(accepts, AcceptsRange):
            said = accepts.of_all(self.least, self.most)
            if said is not None:
                return np.full(self.count, said)
        return self.numbers().where(accepts, remembered)

    def has(self) -> Masks:
        """All of them."""
        return np.ones(self.count, bool)

    def numbers(self) -> Numbers:
        """The values."""
        return Numbers(self.make())


Column = Numbers | Texts | Bounded
Columns = tuple[Column, ...]
ColumnsOf = Callable[[Table, Closed | None], Columns | None]
"""The columns of a name; None where this table does not hold them."""


def _optional(values: npt.NDArray[np.integer[Any]]) -> Numbers:
    return Numbers(values, values != NONE)


_ROLE_WORDS = tuple(role.value for role in ROLES)
_FOUND_WORDS = tuple(found.value for found in FOUNDS)
_DAMAGE_WORDS = tuple(None if one is None else one.value for one in DAMAGES)
_VERDICT_WORDS = (None, *(verdict.value for verdict in VERDICTS))
_NO_WORDS = (None,)
_REMEMBERED = 64


def _begins(table: Table) -> Columns:
    """When rows began, ns."""
    bounds: tuple[int, int] | None = getattr(table, "begins", None)
    if bounds is None:
        return (Numbers(table.frames.start),)
    return (Bounded(lambda: table.frames.start, len(table), *bounds),)


def _begins_since(table: Table, started: int) -> Columns:
    """When rows began, ns after the capture's start, at least 0."""
    bounds: tuple[int, int] | None = getattr(table, "begins", None)
    if bounds is None:
        return (Numbers(np.maximum(table.frames.start - started, 0)),)
    least, most = (max(0, bound - started) for bound in bounds)
    return (Bounded(lambda: np.maximum(table.frames.start - started, 0), len(table), least, most),)


def _zeros(table: Table) -> Numbers:
    return Numbers(np.zeros(len(table), np.int8))


def _errors(table: Table) -> Column:
    """Error 0 is none."""
    codes, names = table.frames.error, table.frames.names
    return Texts(codes, _error_words(names) if codes.any() else _NO_WORDS)


@lru_cache(_REMEMBERED)
def _error_words(names: tuple[str, ...]) -> tuple[str | None, ...]:
    return (None, *names[1:])


_OF_TABLES: Mapping[str, Callable[[Table], Columns]] = {
    "no": lambda table: (
        Bounded(
            lambda: table.first + np.arange(len(table)), len(table), table.first, table.first + max(0, len(table) - 1)
        ),
    ),
    "frame.time": _begins,
    "src": lambda table: (_optional(table.shown("source")),),
    "dst": lambda table: (_optional(table.shown("destination")),),
    "addr": lambda table: (_optional(table.shown("source")), _optional(table.shown("destination"))),
    "proto": lambda table: (Texts(np.zeros(len(table), np.uint8), (table.protocol,)),),
    "role": lambda table: (Texts(table.shown("role"), _ROLE_WORDS),),
    "kind": lambda table: (Texts(table.frames.kind, table.frames.names),),
    "func": lambda table: (_optional(table.frames.function),),
    "register": lambda table: (_optional(table.frames.address),),
    "count": lambda table: (_optional(table.frames.count),),
    "ok": lambda table: (Numbers(table.good.view(np.int8)),),
    "error": lambda table: (_errors(table),),
    "noise": lambda table: (_zeros(table),),
    "searching": lambda table: (_zeros(table),),
    "found": lambda table: (Texts(table.frames.found, _FOUND_WORDS),),
    "damage": lambda table: (Texts(table.frames.damage, _DAMAGE_WORDS),),
    "len": lambda table: (Numbers(table.frames.length),),
    "noise_before": lambda table: (_zeros(table),),
    "marks": lambda table: (_zeros(table),),
    "line.error": lambda table: (Texts(np.zeros(len(table), np.uint8), _NO_WORDS),),
    "tx": lambda table: (Numbers(table.placed.tx, table.placed.tx > 0),),
}

_OF_CLOSINGS: Mapping[str, Callable[[Closed], Columns]] = {
    "verdict": lambda closed: (Texts(closed.verdict + 1, _VERDICT_WORDS),),
    "latency_ms": lambda closed: (_optional(closed.latency),),
    "attempt": lambda closed: (Numbers(closed.attempt, closed.attempt > 0),),
}


def held(name: str, started: int) -> ColumnsOf | None:
    """What tables and closings hold of a name; None where they hold nothing. `started`: of the capture, ns."""
    of_table, of_closing = _OF_TABLES.get(name), _OF_CLOSINGS.get(name)
    if of_table is not None:
        return lambda table, closed: of_table(table)
    if of_closing is not None:
        return lambda table, closed: None if closed is None else of_closing(closed)
    if name == "frame.time_relative":
        return lambda table, closed: _begins_since(table, started)
    if name in ("start_ns", "end_ns"):
        end = name[:-3]
        return lambda table, closed: (Numbers(np.maximum(getattr(table.frames, end) - started, 0)),)
    return None


def octet_of_frames(octet: int, mask: int, protocol: str) -> ColumnsOf:
    """An octet of the good frames of a protocol; other frames have to be asked."""

    def columns(table: Table, closed: Closed | None) -> Columns | None:
        octets = getattr(table, "octets", None)
        if octets is None:
            return None
        if table.protocol != protocol:
            return (Numbers(np.zeros(len(table), np.int8), np.zeros(len(table), bool)),)
        good: Masks = table.good & (table.frames.length > octet)
        if not len(octets):
            return (Numbers(np.zeros(len(table), np.uint8), good, ~good),)
        places = np.minimum(table.frames.offset + octet, len(octets) - 1)
        return (Numbers(octets[places] & np.uint8(mask), good, ~good),)

    return columns


@dataclass(frozen=True, slots=True)
class ClosedRows:
    """What became of rows that are settled: `which` transaction of `closed` each belongs to, -1 for none; rows before
    `begin` and behind are not settled."""

    verdict: Small
    latency: Times
    attempt: npt.NDArray[Any]


def closed_rows(count: int, begin: int, which: Times, closed: Any) -> ClosedRows:
    """Of the rows of a table of so many; `which` begins with row `begin`."""
    verdict: Small = np.full(count, NONE, np.int16)
    latency: Times = np.full(count, NONE, np.int64)
    attempt = np.zeros(count, np.int32)
    there = np.flatnonzero(which >= 0)
    places = which[there]
    verdict[begin + there] = closed.verdict[places]
    latency[begin + there] = closed.latency[places]
    attempt[begin + there] = closed.attempt[places]
    return ClosedRows(verdict, latency, attempt)


def as_numbers(column: Column) -> Numbers | Texts:
    """The values themselves."""
    return column.numbers() if isinstance(column, Bounded) else column


# --- arithmetic -----------------------------------------------------------------------------------------------------


def _bounds(values: npt.NDArray[Any]) -> int:
    if not len(values) or values.dtype.kind == "b":
        return 1
    return max(abs(int(values.min())), abs(int(values.max())))


def combined(operator: str, left: Column | int, right: Column | int) -> Numbers | None:
    """Whole numbers reckoned with row by row; None where that cannot be done exactly."""
    sides: list[Numbers | int] = []
    for given in (left, right):
        one = given if isinstance(given, int) else as_numbers(given)
        if isinstance(one, Texts) or (isinstance(one, Numbers) and one.values.dtype.kind not in "iu"):
            return None
        sides.append(one)
    most = [_bounds(one.values) if isinstance(one, Numbers) else abs(one) for one in sides]
    if (most[0] * most[1] if operator == "*" else most[0] + most[1]) > FARTHEST:
        return None
    a, b = (one.values.astype(np.int64) if isinstance(one, Numbers) else np.int64(one) for one in sides)
    there: Masks | None = None
    unsure: Masks | None = None
    for one in sides:
        if isinstance(one, Numbers):
            there = one.there if there is None else there if one.there is None else there & one.there
            unsure = one.unsure if unsure is None else unsure if one.unsure is None else unsure | one.unsure
    if operator in ("/", "%"):
        apart = np.asarray(b != 0)
        divisor = np.where(apart, b, 1)
        result = a // divisor if operator == "/" else a % divisor
        result = np.broadcast_to(result, _shape(a, b)).copy()
        nonzero: Masks = np.broadcast_to(apart, result.shape)
        return Numbers(result, nonzero.copy() if there is None else there & nonzero, unsure)
    made = {"+": np.add, "-": np.subtract, "*": np.multiply, "&": np.bitwise_and}[operator](a, b)
    return Numbers(np.asarray(made), there, unsure)


def _shape(*values: Any) -> tuple[int, ...]:
    return np.broadcast_shapes(*(np.shape(one) for one in values))
