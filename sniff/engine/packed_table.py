"""Tables packed into a third of their memory: every column as narrow as its values allow. Nothing is lost. Pure.

A column is a constant, or what each value is above the least, or above the value before it, in 1, 2, 4 or 8 octets.
What follows from another column is kept as the difference from it, which often is a constant: where a frame lies among
the octets from the lengths before it, when it began from its end and its length, what the tracker says of its ends
from what its header says.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from dissectors.columns import NONE, FrameColumns, Masks, Octets, PlacementColumns, TransactionColumns
from sniff.engine.engine import Row
from sniff.engine.table import Table, good_rows

Values = npt.NDArray[Any]

_FRAMES = tuple(one.name for one in fields(FrameColumns) if one.name != "names")
_PLACED = tuple(one.name for one in fields(PlacementColumns))
_CLOSED = tuple(one.name for one in fields(TransactionColumns) if one.name != "names")
_FAR = 1 << 62


@dataclass(frozen=True, slots=True)
class PackedColumn:
    """`count` values of one type. `narrow`: None where all are `base`. `missing`: what stands for `none`."""

    form: np.dtype[Any]
    count: int
    base: int
    narrow: Values | None = None
    step: int | None = None  # of values above those before them: the least difference
    none: int = NONE
    missing: int | None = None

    @property
    def octets(self) -> int:
        """Of memory, without what every column costs."""
        return 0 if self.narrow is None else self.narrow.nbytes

    def values(self) -> Values:
        """The column as it was."""
        narrow = self.narrow
        if narrow is None:
            return np.full(self.count, self.base, self.form)
        if self.step is not None:
            whole = np.empty(self.count, np.int64)
            whole[0] = self.base
            np.add(narrow, self.step, out=whole[1:], dtype=np.int64)
            np.cumsum(whole, out=whole)
        elif self.missing is None:
            made: Values = (
                narrow.astype(self.form, copy=False)
                if not self.base
                else np.add(narrow, self.base, dtype=self.form, casting="unsafe")
            )
            return made
        else:
            whole = np.add(narrow, self.base, dtype=np.int64)
        if self.missing is not None:
            whole[whole == self.missing] = self.none
        return whole.astype(self.form, copy=False)


def packed(values: Values, none: int | None = None) -> PackedColumn:
    """A column of integers or truth values, narrow. `none`: a value that stands apart from the others."""
    form, count = values.dtype, len(values)
    if not count:
        return PackedColumn(form, 0, 0)
    if form == np.bool_:
        values = values.view(np.uint8)
    missing: int | None = None
    least, most = int(values.min()), int(values.max())
    if none is not None and least != most and least <= none:
        there = values != none
        least = int(np.min(values, where=there, initial=most))
        if least - 1 > none:
            missing = least - 1
            values = np.where(there, values, missing)
        least = int(values.min())
    if least == most:
        return PackedColumn(form, count, least)
    if most - least >= _FAR:
        return PackedColumn(form, count, 0, values.copy())
    width, apart = _width(most - least), NONE if none is None else none
    if width > 1:
        steps = np.diff(values) if values.dtype.itemsize == 8 else np.diff(values.astype(np.int64))
        low, high = int(steps.min()), int(steps.max())
        if _width(high - low) < width:
            narrow = (steps - low).astype(_FORMS[_width(high - low)])
            return PackedColumn(form, count, int(values[0]), narrow, low, apart, missing)
    narrow = np.subtract(values, least, dtype=np.int64).astype(_FORMS[width])
    return PackedColumn(form, count, least, narrow, None, apart, missing)


_FORMS = {1: np.uint8, 2: np.uint16, 4: np.uint32, 8: np.uint64}


def _width(span: int) -> int:
    return 1 if span < 1 << 8 else 2 if span < 1 << 16 else 4 if span < 1 << 32 else 8


@dataclass(frozen=True, slots=True)
class PackedParts:
    """What a packed table is made of. `count`: of its rows; `closed`: of its transactions. `char`: ns of a character,
    or nearly so: what an octet of a frame takes. `columns`: "frames.end", "slack" …; those are absent that follow from
    others. The rest as of a table."""

    protocol: str
    first: int
    count: int
    closed: int
    char: int
    octets: Octets
    names: tuple[str, ...]
    closed_names: tuple[str, ...]
    columns: Mapping[str, PackedColumn]
    odd: Mapping[int, Row]

    @classmethod
    def of(cls, table: Table) -> PackedParts:
        """A table, taken apart."""
        frames, placed, closed = table.frames, table.placed, table.transactions
        held = {f"frames.{name}": packed(getattr(frames, name)) for name in _FRAMES if name not in ("offset", "start")}
        if not np.array_equal(frames.offset, _begins(frames.length)):
            held["frames.offset"] = packed(frames.offset)
        char = int((frames.end[0] - frames.start[0]) // max(1, int(frames.length[0]))) if len(table) else 0
        held["frames.start"] = packed(frames.end - frames.start - np.int64(char) * frames.length)
        held["slack"], held["is_frame"] = packed(table.slack), packed(table.is_frame)
        held["placed.tx"] = packed(placed.tx, none=0)
        for name in ("role", "source", "destination"):
            values = getattr(placed, name)
            if not np.array_equal(values, _as_headers_say(getattr(frames, name), placed.tx)):
                held[f"placed.{name}"] = packed(values)
        for name in _CLOSED:
            values = getattr(closed, name)
            if name == "start":
                values = closed.end - values
            elif name in ("least", "most"):
                values = values - closed.latency
            held[f"closed.{name}"] = packed(values, none=NONE if values.dtype == np.int64 else None)
        held["closed_by"] = packed(table.closed_by)
        octets = table.octets if table.octets.base is None else table.octets.copy()
        return cls(
            table.protocol,
            table.first,
            len(table),
            len(closed),
            char,
            octets,
            frames.names,
            closed.names,
            held,
            table.odd,
        )

    def column(self, name: str) -> Values:
        """A column as a table has it: "frames.end", "placed.tx", "closed.verdict", "slack", "is_frame", "closed_by"."""
        held = self.columns.get(name)
        if name == "frames.start":
            made: Values = self.column("frames.end")
            apart = self.columns[name]
            made = made - (apart.base if apart.narrow is None else apart.values())
            made -= np.multiply(self.column("frames.length"), self.char, dtype=np.int64)
            return made
        if name == "closed.start":
            return self.column("closed.end") - self.columns[name].values()
        if name in ("closed.least", "closed.most"):
            return self.column("closed.latency") + self.columns[name].values()
        if held is not None:
            return held.values()
        if name == "frames.offset":
            return _begins(self.column("frames.length"))
        return _as_headers_say(self.column(name.replace("placed.", "frames.")), self.column("placed.tx"))

    def table(self) -> Table:
        """The table as it was."""
        return Table(
            self.protocol,
            self.first,
            self.octets,
            FrameColumns(**{name: self.column(f"frames.{name}") for name in _FRAMES}, names=self.names),
            self.column("slack"),
            self.column("is_frame"),
            PlacementColumns(*(self.column(f"placed.{name}") for name in _PLACED)),
            TransactionColumns(**{name: self.column(f"closed.{name}") for name in _CLOSED}, names=self.closed_names),
            self.column("closed_by"),
            self.odd,
        )


class PackedTable:
    """A table that is only looked at. `first`, `odd`, `protocol`, and what a row is: as of a table.

    `closed`: how many transactions. `ids`: the least and the greatest of theirs. `rows_closed`: the last row that they
    name. `begin`: of the first row, ns; `begins`: of the first and the last in time. `placed_ids`: least and greatest
    of the transactions that its rows belong to. `remembered`: what whoever keeps it has found out of its rows, and
    from which tables.
    """

    def __init__(self, table: Table) -> None:
        self.remembered: dict[str, tuple[list[Any], Values]] = {}
        parts = self._parts = PackedParts.of(table)
        frames, placed, closed = table.frames, table.placed, table.transactions
        self.protocol, self.first, self.odd = parts.protocol, parts.first, parts.odd
        self.octets, self.closed = parts.octets, parts.closed
        ids, numbers = closed.id, np.concatenate((closed.request, closed.response))
        self.ids = (int(ids.min()), int(ids.max())) if len(ids) else (0, -1)
        self.rows_closed = int(numbers.max(initial=0))
        self.begin = int(frames.start[0]) if len(table) else 0
        self.begins = (int(frames.start.min()), int(frames.start.max())) if len(table) else (0, 0)
        self.placed_ids = span_of(placed.tx)
        self._all_placed = bool((placed.tx > 0).all())

    def __len__(self) -> int:
        return self._parts.count

    @property
    def names(self) -> tuple[str, ...]:
        """Texts of its rows."""
        return self._parts.names

    @property
    def closed_names(self) -> tuple[str, ...]:
        """Texts of its transactions."""
        return self._parts.closed_names

    def share_names(self, known: dict[tuple[str, ...], tuple[str, ...]]) -> None:
        """Keep texts once that other tables have, too. `known`: those so far."""
        names, closed = (known.setdefault(one, one) for one in (self.names, self.closed_names))
        self._parts = replace(self._parts, names=names, closed_names=closed)

    @property
    def memory(self) -> int:
        """Octets of memory that columns and the octets of the wire take."""
        return self.octets.nbytes + sum(one.octets for one in self._parts.columns.values())

    def column(self, name: str) -> Values:
        """A column as a table has it: "frames.end", "placed.tx", "closed.verdict", "slack", "is_frame", "closed_by"."""
        return self._parts.column(name)

    def ranks(self) -> tuple[Values, int]:
        """Which of `placed_ids` each row belongs to, and what is to be added: 1 is the least then, 0 is none."""
        column = self._parts.columns["placed.tx"]
        least, _ = self.placed_ids
        narrow, base, missing = column.narrow, column.base, column.missing
        if narrow is None or missing not in (None, least - 1) or not (self._all_placed or missing is not None):
            return ranks_of(column.values(), least), 0
        if column.step is None:
            return narrow, base - (least - 1)
        if missing is not None:
            return ranks_of(column.values(), least), 0
        ranks = np.empty(column.count, np.intp)
        ranks[0] = base - (least - 1)
        if column.step:
            np.add(narrow, column.step, out=ranks[1:], dtype=np.intp)
            np.cumsum(ranks, out=ranks)
        else:
            np.cumsum(narrow, out=ranks[1:])
            ranks[1:] += ranks[0]
        return ranks, 0

    def as_headers_say(self, name: str) -> bool:
        """Whether the tracker says of all rows that have a place what their headers say: "source", "role" …."""
        return f"placed.{name}" not in self._parts.columns

    def table(self) -> Table:
        """The table as it was."""
        return self._parts.table()


def span_of(tx: Values) -> tuple[int, int]:
    """Least and greatest id of the rows that have a transaction; (1, 1) where none has."""
    placed = tx[tx > 0]
    return (int(placed.min()), int(placed.max())) if len(placed) else (1, 1)


def ranks_of(tx: Values, least: int) -> Values:
    """1 for the least id, 0 for none."""
    ranks: Values = np.where(tx > 0, tx - (least - 1), 0)
    return ranks


def _begins(lengths: Values) -> Values:
    begins: Values = np.cumsum(lengths, dtype=np.int64)
    begins -= lengths
    return begins


def _as_headers_say(values: Values, tx: Values) -> Values:
    """What a placement without any news would say; of a row without a place nothing."""
    return np.where(tx > 0, values, values.dtype.type(0 if values.dtype == np.uint8 else NONE))


class _Columns:
    """Columns of one kind; each is unpacked when somebody asks for it."""

    def __init__(self, whole: PackedTable, kind: str, names: tuple[str, ...] = ("",)) -> None:
        self._whole, self._kind = whole, kind
        self.names = names

    def __getattr__(self, name: str) -> Values:
        values = self._whole.column(f"{self._kind}.{name}")
        setattr(self, name, values)
        return values


class TableView:
    """What a filter asks of a table, unpacked as far as it is asked for."""

    def __init__(self, whole: PackedTable) -> None:
        self._whole = whole
        self.protocol, self.first = whole.protocol, whole.first
        self.odd: Mapping[int, Row] = whole.odd
        self.octets = whole.octets
        self.begins = whole.begins
        self.frames = _Columns(whole, "frames", whole.names)
        self.placed = _Columns(whole, "placed")

    def __len__(self) -> int:
        return len(self._whole)

    def shown(self, name: str) -> Values:
        """As of a table."""
        if self._whole.as_headers_say(name):
            made: Values = getattr(self.frames, name)
            return made
        values: Values = np.where(self.placed.tx > 0, getattr(self.placed, name), getattr(self.frames, name))
        return values

    @cached_property
    def is_frame(self) -> Masks:
        """As of a table."""
        return self._whole.column("is_frame")

    @property
    def good(self) -> Masks:
        """As of a table."""
        return good_rows(self.is_frame, self.frames.damage, self.frames.check)
