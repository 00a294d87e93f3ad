"""Rows of tables joined with their transactions by columns: stretches of rows whose verdicts are settled. Pure.

The rule is that of `verdict_join.py`: a row waits until its transaction has closed, but not for more than `HELD` rows.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dissectors.columns import Times, TransactionColumns
from dissectors.tracker import Transaction
from sniff.engine.closings import Closings
from sniff.engine.row_packing import transaction_columns
from sniff.engine.table import Table, joined_columns
from sniff.engine.verdict_join import HELD, REMEMBERED, JudgedRow


@dataclass(frozen=True, slots=True)
class SettledRows:
    """Rows `begin` … `end` - 1 of a table. `which`: int64[n], the place of each row's transaction in `closed`, -1 where
    it has none."""

    table: Table
    begin: int
    end: int
    which: Times
    closed: TransactionColumns

    def __len__(self) -> int:
        return self.end - self.begin

    def transaction(self, place: int) -> Transaction | None:
        """Of the row at a place in the table."""
        which = int(self.which[place - self.begin])
        return None if which < 0 else self.closed.transaction(which)

    @property
    def closings(self) -> Closings:
        """What became of all rows of the table, as far as it is settled: of the others nothing."""
        ranks, closed = np.zeros(len(self.table), np.int64), self.closed
        ranks[self.begin : self.end] = self.which + 1
        numbers = np.arange(1, len(closed) + 1)
        return Closings(ranks, 0, 1, len(closed), [lambda name: numbers if name == "id" else getattr(closed, name)])

    def item(self, place: int) -> JudgedRow:
        """The row at a place in the table, as an object."""
        return JudgedRow(self.table.row(place), self.transaction(place))


class ColumnJoin:
    """Fed tables in order; gives all their rows in order."""

    def __init__(self) -> None:
        self._held: deque[tuple[Table, int]] = deque()  # with the first place that was not given
        self._closed = transaction_columns(())
        self._order: Times = np.zeros(0, np.int64)
        self._next = 1  # number of the row to come

    def add(self, table: Table) -> Iterator[SettledRows]:
        """Take the table that follows; give what is settled by it."""
        self._held.append((table, 0))
        self._next = table.first + len(table)
        self._remember(table)
        while self._held:
            held = len(self._held)
            given = self._settled(last=False)
            if given is not None:
                yield given
            if len(self._held) == held:  # the oldest row left waits
                return

    def flush(self) -> Iterator[SettledRows]:
        """Give all that is left."""
        while self._held:
            given = self._settled(last=True)
            if given is not None:
                yield given

    def _remember(self, table: Table) -> None:
        """Know what closed, and forget what no row can ask for any more."""
        first, begin = self._held[0]
        closed, oldest = self._closed, first.first + begin - 1 - REMEMBERED
        closed = closed.take(np.maximum(np.maximum(closed.request, closed.response), 0) >= oldest)
        both = [one for one in (closed, table.transactions) if len(one)]
        self._closed = joined_columns(TransactionColumns, both) if both else closed
        self._order = np.argsort(self._closed.id, kind="stable")

    def _settled(self, *, last: bool) -> SettledRows | None:
        """The oldest rows, as far as they are settled."""
        table, begin = self._held[0]
        which = self._which(table, begin)
        end = len(table)
        if not last:
            waits = (which < 0) & (table.placed.tx[begin:] > 0)
            waits[: max(0, self._next - HELD - (table.first + begin))] = False  # waited long enough
            first = int(waits.argmax()) if waits.any() else len(waits)
            end = begin + first
        if end == len(table):
            self._held.popleft()
        else:
            self._held[0] = table, end
        if end == begin:
            return None
        return SettledRows(table, begin, end, which[: end - begin], self._closed)

    def _which(self, table: Table, begin: int) -> Times:
        """The place of each row's transaction in what closed; -1 for none that it could have waited for."""
        asked, closed = table.placed.tx[begin:], self._closed
        if not len(closed):
            return np.full(len(asked), -1, np.int64)
        ids = closed.id[self._order]
        found = np.searchsorted(ids, asked, side="right") - 1
        hit = (found >= 0) & (ids[found] == asked) & (asked > 0)
        which: Times = np.where(hit, self._order[found], -1)
        return which
