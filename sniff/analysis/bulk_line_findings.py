"""The line's findings from many rows at once. Pure.

What is the same whatever lies between (octets, load, silences, rhythms) is taken a table at a time; good frames that
follow one another only move the state by which damage between them is judged; every other row goes the way of one row.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from dissectors.frame import Role
from sniff.analysis.line_findings import COUNTED_OCTETS, LineFindings
from sniff.analysis.other_settings import SAMPLE_OCTETS

if TYPE_CHECKING:
    from dissectors.columns import Masks, TransactionColumns
    from sniff.analysis.line_columns import LineColumns
    from sniff.engine.table import Table


class BulkLineFindings(LineFindings):
    """The same findings, from single rows and from tables in any order of both."""

    def add_table(self, table: Table) -> None:
        """Take rows that were all heard with the settings of the bus, and what they closed; as one after the other."""
        begin = self._take_begin(table)
        if begin < len(table):
            self._take(table.part(begin, len(table)) if begin else table)
        self._settle_many(table.transactions)

    def _take_begin(self, table: Table) -> int:
        """Take the first rows of the bus, of which octets are kept; how many."""
        begin = 0
        while begin < len(table) and (not self._rows or self._sampled < SAMPLE_OCTETS):
            self.see(table.row(begin))
            begin += 1
        return begin

    def _take(self, table: Table) -> None:
        from sniff.analysis.line_columns import LineColumns

        columns = LineColumns.of(table)
        plain = columns.plain & ~columns.is_new(self._senders, self._nouns)
        self._count_all(table)
        self._patterns.take(table, columns.sound, columns.asks)
        self._use.take(table, columns.broadcast)
        for begin, end, odd in columns.runs(plain):
            if begin < end:
                self._see_run(columns, begin, end)
            if odd is not None:
                row = table.row(odd)
                self._patterns.see_trouble(row.no, row.event, self._see_event(row))
        self._count_plain(columns, plain)

    def _count_plain(self, columns: LineColumns, plain: Masks) -> None:
        """Count good frames of which columns say all, and at their senders."""
        for name, count, octets in columns.sent(plain, self._nouns):
            self._senders.count(name, count, octets)
            self._frames += count
            self._good += count
            self._in_frames += octets

    def _count_all(self, table: Table) -> None:
        """Count what all rows have."""
        import numpy as np

        frames = table.frames
        self._rows += len(table)
        self._now = max(self._now, int(frames.end.max()))
        self._octets += int(frames.length.sum())
        held = table.octets[int(frames.offset[0]) : int(frames.offset[-1]) + int(frames.length[-1])]
        counts = np.bincount(held, minlength=256)
        for place in np.flatnonzero(frames.length > COUNTED_OCTETS).tolist():
            begin = int(frames.offset[place])
            counts -= np.bincount(table.octets[begin : begin + int(frames.length[place])], minlength=256)
        self._values.update({value: count for value, count in enumerate(counts.tolist()) if count})

    def _see_run(self, columns: LineColumns, begin: int, end: int) -> None:
        """Take good frames that follow one another, which have been counted."""
        from dissectors.columns import NONE

        table = columns.table
        first, last = (columns.name(int(columns.sender[place]), self._nouns) for place in (begin, end - 1))
        self._between.see_good(first, int(table.slack[begin]))
        only_master = bool(columns.asks[begin:end].all())
        self._senders.see_good(last, int(table.frames.end[end - 1]), only_master)
        role = columns.role_before(begin, end)
        self._awaiting = self._awaiting if role is None else role is Role.REQUEST
        asker = last if columns.role_before(end - 1, end) is Role.REQUEST else None
        asked = int(table.placed.destination[end - 1]) if table.placed.tx[end - 1] else NONE
        self._between.follow(asker, self._called(None if asked == NONE else asked, table.protocol), ok=True)
        self._patterns.see_good(table.frames.end[begin:end])

    def _settle_many(self, closed: TransactionColumns) -> None:
        """Take transactions that closed."""
        if not len(closed):
            return
        self._patterns.settle_many(closed)
        self._echoes.settle_many(closed)
