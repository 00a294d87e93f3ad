"""The tables of one bus that follow one another, kept packed: a row by its number, a transaction by its closing.

What comes in small tables is joined until it is worth packing. An object is made for a row that somebody asks for.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections import OrderedDict
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from dissectors.columns import NONE
from dissectors.tracker import Transaction
from sniff.engine.engine import Row
from sniff.engine.packed_table import PackedTable, TableView, ranks_of, span_of
from sniff.engine.table import Table, joined

PACKED = 16_384
"""Rows from which on a table is packed."""
LOOSE = 32
"""Tables that are not packed yet; so many are joined."""
UNPACKED = 4
"""Tables that are kept unpacked too, because somebody looks at them."""
OBJECTS = 2048
"""Rows, and transactions, kept as objects too."""

Values = npt.NDArray[Any]


class Part:
    """Some of the rows, and the transactions that closed with them.

    `first`: number of its first row, or of the row to come where it has none. `closed_first`: number of its first
    closing. `begin`: of its first row, ns. `ids`: least and greatest of its transactions' ids; `rows_closed`: the last
    row that they name. `placed_ids`: least and greatest of the transactions that its rows belong to.
    `remembered`: what became of its rows, by name, and the tables that told it (`closings_ahead.py`).
    """

    def __init__(self, whole: Table | PackedTable, first: int, closed_first: int) -> None:
        self.whole = whole
        self.remembered = whole.remembered if isinstance(whole, PackedTable) else {}
        self.first, self.rows = first, len(whole)
        self.closed_first = closed_first
        if isinstance(whole, PackedTable):
            self.closed, self.ids, self.rows_closed = whole.closed, whole.ids, whole.rows_closed
            self.begin, self.placed_ids = whole.begin, whole.placed_ids
        else:
            self.begin = int(whole.frames.start[0]) if self.rows else 0
            held = whole.transactions
            self.closed = len(held)
            self.ids = (int(held.id.min()), int(held.id.max())) if self.closed else (0, -1)
            self.placed_ids = span_of(whole.placed.tx)
            self.rows_closed = max(int(held.request.max(initial=0)), int(held.response.max(initial=0)))

    @property
    def last(self) -> int:
        """Number of its last row."""
        return self.first + self.rows - 1

    def column(self, name: str) -> Values:
        """As `PackedTable.column`."""
        whole = self.whole
        if isinstance(whole, PackedTable):
            return whole.column(name)
        kind, _, one = name.rpartition(".")
        held = {"frames": whole.frames, "placed": whole.placed, "closed": whole.transactions}.get(kind, whole)
        values: Values = getattr(held, one)
        return values

    def closed_column(self, name: str) -> Values:
        """Of its transactions."""
        return self.column(f"closed.{name}")

    @property
    def closed_names(self) -> tuple[str, ...]:
        """Texts of its transactions."""
        whole = self.whole
        return whole.closed_names if isinstance(whole, PackedTable) else whole.transactions.names

    def ranks(self) -> tuple[Values, int]:
        """As `PackedTable.ranks`."""
        whole = self.whole
        return whole.ranks() if isinstance(whole, PackedTable) else (ranks_of(whole.placed.tx, self.placed_ids[0]), 0)

    def view(self) -> Table | TableView:
        """For filters."""
        return TableView(self.whole) if isinstance(self.whole, PackedTable) else self.whole


class KeptTables:
    """Rows `first_no` … `last_no` and the closings that have a row among them; the oldest can be let go."""

    def __init__(self) -> None:
        self.parts: list[Part] = []
        self.first_no = 1
        self.last_no = 0
        self.first_closed = 1
        self.last_closed = 0
        self._unpacked: OrderedDict[int, Table] = OrderedDict()  # by the identity of the packed one
        self._rows: dict[int, Row] = {}
        self._closings: dict[int, Transaction] = {}
        self._numbers: dict[int, int] = {}  # of closings, by id
        self._names: dict[tuple[str, ...], tuple[str, ...]] = {}
        self._spans: tuple[Values, Values] | None = None

    # -- taking and letting go ---------------------------------------------------------------------------------

    def append(self, table: Table | PackedTable) -> None:
        """Take what follows."""
        if not self.parts and len(table):
            self.first_no = table.first
            self.last_no = table.first - 1
        first = self.last_no + 1
        if isinstance(table, Table):
            table = _placed_at(table, first)
            if len(table) >= PACKED:
                table = PackedTable(table)
        if isinstance(table, PackedTable):  # most tables have the same texts
            table.share_names(self._names)
        part = Part(table, first, self.last_closed + 1)
        self.parts.append(part)
        self.last_no += part.rows
        self.last_closed += part.closed
        self._spans = None
        if isinstance(table, Table):
            self._join()

    def _join(self) -> None:
        """Join small tables at the end, so that there are never many: all, where that is worth packing, else those
        that are of a size."""
        loose: list[Table] = []
        for part in reversed(self.parts):
            if not isinstance(part.whole, Table) or part.whole.protocol != self.parts[-1].whole.protocol:
                break
            loose.append(part.whole)
        rows = sum(map(len, loose))
        if len(loose) < 2 or (len(loose) < LOOSE and rows < PACKED):
            return
        taken = len(loose)
        if rows < PACKED:
            sizes = [len(table) for table in loose]
            while taken > LOOSE // 2 and sizes[taken - 1] > 4 * sum(sizes[: taken - 1]):
                taken -= 1
        begin = self.parts[-taken]
        del self.parts[-taken:]
        whole = _joined(loose[taken - 1 :: -1])
        self.parts.append(Part(PackedTable(whole) if rows >= PACKED else whole, begin.first, begin.closed_first))

    def drop(self, count: int) -> None:
        """Let the oldest rows go, and the closings of which nothing is left."""
        self.first_no = min(self.first_no + count, self.last_no + 1)
        while self.first_closed <= self.last_closed:
            part = self.parts[self._closed_part(self.first_closed)]
            if part.rows_closed >= self.first_no:
                rows = np.maximum(part.column("closed.request"), part.column("closed.response"))
                kept = np.flatnonzero(rows[self.first_closed - part.closed_first :] >= self.first_no)
                if len(kept):
                    self.first_closed += int(kept[0])
                    break
            self.first_closed = part.closed_first + part.closed
        gone = 0
        for part in self.parts[:-1]:
            if part.last >= self.first_no or part.closed_first + part.closed > self.first_closed:
                break
            gone += 1
        del self.parts[:gone]
        self._spans = None
        for held in (self._rows, self._closings, self._numbers, self._unpacked):
            held.clear()

    # -- rows --------------------------------------------------------------------------------------------------

    def part_of(self, no: int) -> Part | None:
        """The part that holds a row; None where it was dropped or never was."""
        if not self.first_no <= no <= self.last_no:
            return None
        at = bisect_right(self.parts, no, key=lambda part: part.first) - 1
        while not self.parts[at].rows:
            at -= 1
        return self.parts[at]

    def row(self, no: int) -> Row | None:
        """The row of that number; None where it was dropped or never was."""
        row = self._rows.get(no)
        if row is None and (part := self.part_of(no)) is not None:
            row = self.table(part).row(no - part.first)
            if len(self._rows) >= OBJECTS:
                self._rows.clear()
            self._rows[no] = row
        return row

    def parts_with(self, first: int, last: int, most: int) -> list[Part]:
        """Parts that hold rows `first` … `last`, at most so many: the latest of them."""
        end = bisect_right(self.parts, last, key=lambda part: part.first)
        begin = max(bisect_left(self.parts, first, key=lambda part: part.last), end - most)
        return [part for part in self.parts[begin:end] if part.rows]

    def table(self, part: Part) -> Table:
        """A part as a table; what was asked for last stays unpacked."""
        whole = part.whole
        if isinstance(whole, Table):
            return whole
        table = self._unpacked.get(id(whole))
        if table is None:
            table = self._unpacked[id(whole)] = whole.table()
            if len(self._unpacked) > UNPACKED:
                self._unpacked.popitem(last=False)
        else:
            self._unpacked.move_to_end(id(whole))
        return table

    def row_at(self, time: int) -> int:
        """Number of the first row that begins at `time` (ns) or after; one after the last where there is none."""
        holding = [part for part in self.parts if part.rows]
        at = bisect_left(holding, time, key=lambda part: part.begin) - 1
        if at < 0:
            return self.first_no
        return max(self.first_no, holding[at].first + int(np.searchsorted(holding[at].column("frames.start"), time)))

    # -- transactions ------------------------------------------------------------------------------------------

    def part_of_closing(self, no: int) -> Part | None:
        """The part that holds a closing; None where it was dropped or is still to come."""
        return self.parts[self._closed_part(no)] if self.first_closed <= no <= self.last_closed else None

    def _closed_part(self, no: int) -> int:
        at = bisect_right(self.parts, no, key=lambda part: part.closed_first) - 1
        while not self.parts[at].closed:
            at -= 1
        return at

    def closing(self, no: int) -> Transaction | None:
        """The transaction that closed as number `no`; None where it was dropped or is still to close."""
        if not self.first_closed <= no <= self.last_closed:
            return None
        found = self._closings.get(no)
        if found is None:
            part = self.parts[self._closed_part(no)]
            found = self.table(part).transaction(no - part.closed_first)
            if len(self._closings) >= OBJECTS:
                self._closings.clear()
            self._closings[no] = found
        return found

    def closing_of(self, transaction: int) -> int | None:
        """The number under which a transaction closed, by its id; None where it was dropped or is open."""
        no = self._numbers.get(transaction)
        if no is not None:
            return no
        for part in self.closing_parts(transaction, transaction):
            places = np.flatnonzero(self.table(part).transactions.id == transaction)
            if len(places) and part.closed_first + int(places[0]) >= self.first_closed:
                if len(self._numbers) >= OBJECTS:
                    self._numbers.clear()
                found = self._numbers[transaction] = part.closed_first + int(places[0])
                return found
        return None

    def closing_parts(self, least: int, most: int) -> list[Part]:
        """Parts that may hold transactions with these ids."""
        if self._spans is None:
            spans = np.array([part.ids for part in self.parts], np.int64).reshape(-1, 2)
            self._spans = spans[:, 0], spans[:, 1]
        low, high = self._spans
        return [self.parts[at] for at in np.flatnonzero((low <= most) & (high >= least)).tolist()]

    def rows_of_closings(self, first: int, last: int) -> Values:
        """int64[n]: numbers of the rows that closings `first` … `last` name."""
        named: list[Values] = []
        for part in reversed(self.parts):
            if part.closed_first + part.closed <= first:
                break
            which = slice(max(0, first - part.closed_first), max(0, last + 1 - part.closed_first))
            named += [part.column("closed.request")[which], part.column("closed.response")[which]]
        numbers: Values = np.concatenate(named) if named else np.zeros(0, np.int64)
        there: Values = numbers[numbers != NONE]
        return there


def _placed_at(table: Table, first: int) -> Table:
    """The same table where its rows really are; what closed at an end closed with the last of them."""
    closed_by = np.where(table.closed_by < 0, len(table) - 1, table.closed_by)
    return replace(table, first=first, closed_by=closed_by)


def _joined(tables: list[Table]) -> Table:
    """Tables in a row; what closed without a row closed with the last row before it."""
    whole = joined(tables[0].protocol, tables[0].first, tables)
    closings = [len(one.transactions) for one in tables]
    lone = np.repeat([not len(one) for one in tables], closings)
    if not lone.any():
        return whole
    ends = np.repeat(np.cumsum([len(one) for one in tables]) - 1, closings)
    return replace(whole, closed_by=np.where(lone, ends, whole.closed_by))
