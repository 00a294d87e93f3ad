"""Filters over tables: for the columns of a row that a table holds, which of its rows a comparison accepts. Pure.

A mask speaks of plain rows only; what is odd in a table is asked row by row (`Filter.mask` in filtering.py).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from dissectors.columns import DAMAGES, FOUNDS, NONE, ROLES, VERDICTS, Masks
from sniff.engine.closings import Closings
from sniff.engine.table import Table

Scalar = int | float | str
Accepts = Callable[[Scalar], bool]
Remembered = dict[int, tuple[Sequence[str | None], Masks]]
"""Which texts were accepted, by the identity of the texts, which many tables share."""

DENSE = 1 << 12
"""Numbers this near to one another are not sorted to find which there are."""


@runtime_checkable
class AcceptsMany(Protocol):
    """A test of values that can test many at once."""

    def many(self, values: npt.NDArray[Any]) -> Masks:
        """Which numbers are accepted."""
        ...


@dataclass(frozen=True, slots=True)
class Numbers:
    """Numbers by row; `there`: where a row has one, None: everywhere."""

    values: npt.NDArray[Any]
    there: Masks | None = None

    def where(self, accepts: Accepts, remembered: Remembered) -> Masks:
        """Rows whose value is accepted; each distinct value is asked once."""
        chosen = accepts.many(self.values) if isinstance(accepts, AcceptsMany) else self._one_by_one(accepts)
        if self.there is not None:
            chosen &= self.there
        return chosen

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


Column = Numbers | Texts


def _optional(values: npt.NDArray[np.integer[Any]]) -> Numbers:
    return Numbers(values, values != NONE)


_ROLE_WORDS = tuple(role.value for role in ROLES)
_FOUND_WORDS = tuple(found.value for found in FOUNDS)
_DAMAGE_WORDS = tuple(None if one is None else one.value for one in DAMAGES)
_VERDICT_WORDS = (None, *(verdict.value for verdict in VERDICTS))
_REMEMBERED = 64


MASKED: dict[str, Callable[[Table], tuple[Column, ...]]] = {
    "no": lambda table: (Numbers(table.first + np.arange(len(table))),),
    "src": lambda table: (_optional(table.shown("source")),),
    "dst": lambda table: (_optional(table.shown("destination")),),
    "addr": lambda table: (_optional(table.shown("source")), _optional(table.shown("destination"))),
    "proto": lambda table: (Texts(np.zeros(len(table), np.uint8), (table.protocol,)),),
    "role": lambda table: (Texts(table.shown("role"), _ROLE_WORDS),),
    "kind": lambda table: (Texts(table.frames.kind, table.frames.names),),
    "func": lambda table: (_optional(table.frames.function),),
    "register": lambda table: (_optional(table.frames.address),),
    "count": lambda table: (_optional(table.frames.count),),
    "ok": lambda table: (Numbers(table.good.astype(np.int8)),),
    "error": lambda table: (_errors(table),),
    "noise": lambda table: (Numbers(np.zeros(len(table), np.int8)),),
    "found": lambda table: (Texts(table.frames.found, _FOUND_WORDS),),
    "damage": lambda table: (Texts(table.frames.damage, _DAMAGE_WORDS),),
    "len": lambda table: (Numbers(table.frames.length),),
    "marks": lambda table: (Numbers(np.zeros(len(table), np.int8)),),
    "tx": lambda table: (Numbers(table.placed.tx, table.placed.tx > 0),),
}
"""Columns of a filter that a table holds."""

CLOSED: dict[str, Callable[[Closings], Column]] = {
    "verdict": lambda closed: Texts(closed.verdict + 1, _VERDICT_WORDS),
    "latency_ms": lambda closed: Numbers(closed.latency / 1e6, closed.latency != NONE),
    "attempt": lambda closed: Numbers(closed.attempt, closed.verdict >= 0),
}
"""Columns of a filter that the transactions of its rows hold."""


def accepted(
    table: Table, name: str, accepts: Accepts, remembered: Remembered, closings: Closings | None = None
) -> Masks:
    """Rows of which any value of that name is accepted; right for plain rows."""
    columns = (CLOSED[name](closings),) if closings is not None and name in CLOSED else MASKED[name](table)
    chosen = columns[0].where(accepts, remembered)
    for column in columns[1:]:
        chosen |= column.where(accepts, remembered)
    return chosen


def _errors(table: Table) -> Column:
    """Error 0 is none."""
    codes, names = table.frames.error, table.frames.names
    return Texts(codes, _error_words(names) if codes.any() else _NO_WORDS)


_NO_WORDS = (None,)


@lru_cache(_REMEMBERED)
def _error_words(names: tuple[str, ...]) -> tuple[str | None, ...]:
    return (None, *names[1:])
