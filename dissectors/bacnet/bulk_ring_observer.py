"""The ring's observer for many rows at once: runs of clean rows as columns, all others as `MstpRingObserver` does.

What a run needs is the state that the row before it leaves when nothing else is known (`_is_calm`); it ends where a row
means more because of what was before. So both ways give the same ring, wherever rows are cut into tables.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from dissectors.bacnet.limits import T_USAGE_TIMEOUT
from dissectors.bacnet.ring_observer import MstpRingObserver
from dissectors.bacnet.ring_questions import AskedInRing

if TYPE_CHECKING:
    from dissectors.bacnet.ring_columns import RingColumns
    from dissectors.bacnet.ring_counts import RingCounts
    from dissectors.columns import Masks
    from dissectors.row_columns import RowColumns

RUN_LEAST = 24
"""Clean rows that are worth to be taken at once."""

_LOOKED_AT = 1024  # rows that are looked at while some of them may mean more than others


class BulkRingObserver(MstpRingObserver):
    """The same ring, from single rows and from tables in any order of both."""

    def take(self, rows: RowColumns) -> None:
        """Take many rows: those in which all goes its way as columns, any other as `see` does."""
        from dissectors.bacnet.ring_columns import RingColumns
        from dissectors.bacnet.ring_counts import RingCounts

        if not len(rows):
            return
        columns = RingColumns(rows, self._tally.timing, self._least_gap, self._storms.newest)
        counts = RingCounts(columns, self._tally, self._least_gap)
        place = one_by_one = 0  # before that one, each is seen by itself
        while place < len(rows):
            end = columns.end_of_run(place)
            if place >= one_by_one and end - place >= RUN_LEAST and self._is_calm(columns, place):
                end = self._take_run(columns, counts, place, end)
                if end - place >= RUN_LEAST:
                    place = end
                    continue
                one_by_one = end + 1
            row = rows.row(place)
            self.see(row.no, row.event, row.header)
            place += 1
        counts.add_up()

    def _is_calm(self, columns: RingColumns, begin: int) -> bool:
        """Whether nothing is known but what the row before `begin` says."""
        before, asked = begin - 1, self._questions.asked
        is_token, asks = bool(columns.token[before]), bool(columns.asks[before])
        if self._doubt or self._missed is not None or self._before is None or not self._reads.is_settled:
            return False
        if self._instead is not None or self._repeated.of is not None or self._holder != int(columns.after[before]):
            return False
        if (self._token is not None) != is_token:
            return False
        if self._passed_by != (int(columns.source[before]) if is_token else None):
            return False
        return asked is None if not asks else asked is not None and asked.no == columns.rows.first + before

    def _take_run(self, columns: RingColumns, counts: RingCounts, begin: int, end: int) -> int:
        """Take clean rows from `begin` on, up to the first that must be seen by itself; that row.

        None are taken where they are few.
        """
        end = self._before_special(columns, begin, end)
        if end - begin >= RUN_LEAST:
            end = counts.unknown(begin, end)
        if end - begin >= RUN_LEAST:
            self._hold = counts.take(begin, end, self._hold, self._got)
            self._move(columns, begin, end)
        return end

    def _before_special(self, columns: RingColumns, begin: int, end: int) -> int:
        """The first row that means more because of what was before: a search, a station that left, an answer due."""
        nodes = self._tally.nodes.items()
        searching = [mac for mac, node in nodes if node.searches or node.after_search]
        gone = [mac for mac, node in nodes if node.gone]
        postponed = self._questions.postponed
        if not (searching or gone or postponed):
            return end
        end = min(end, begin + _LOOKED_AT)
        rows = slice(begin, end)
        source, destination = columns.source[rows], columns.destination[rows]
        special = (columns.token[rows] | columns.poll[rows]) & _among(searching)[source]
        special |= columns.poll_reply[rows] & _among(gone)[source]
        for server, client in postponed:
            special |= columns.data[rows] & ~columns.answers[rows] & (source == server) & (destination == client)
        return begin + int(special.argmax()) if special.any() else end

    def _move(self, columns: RingColumns, begin: int, end: int) -> None:
        """Stand behind clean rows that have been counted."""
        rows, last, told = slice(begin, end), end - 1, columns.rows
        frame = told.frames.frame(last, told.octets, told.protocol, int(told.slack[last]))
        source, destination = int(columns.source[last]), int(columns.destination[last])
        tokens = columns.token[rows].nonzero()[0]
        if len(tokens):
            self._got = int(columns.end[begin + tokens[-1]])
            for passed in set(columns.destination[begin + tokens].tolist()):
                self._second.passed(passed)
                self._unheard.heard(passed)
        self._holder, self._passed_by, self._token = int(columns.after[last]), None, None
        if columns.token[last]:
            self._passed_by, self._token, self._disturbed = source, frame, False
        self._questions.asked = self._questions.late = self._questions.found = None
        if columns.poll_reply[last] and columns.gap[last] + columns.slack[last - 1] <= T_USAGE_TIMEOUT:
            self._questions.found = source, destination
        if columns.asks[last]:
            kind = int(columns.kind[last])
            self._questions.asked = AskedInRing(kind, source, destination, frame, told.first + last)
        if not columns.poll[last]:
            self._series.forget()
        elif (began := int(columns.series[last])) >= begin:
            self._series.goes_on(source, int(columns.start[began]))
        self._questions.alone_since = columns.alone_since(last)
        self._storms.see_many(columns.end[rows][columns.to_all[rows]].tolist())
        self._reads.pass_by(frame)
        columns.turns.teach(self._turn, begin, end, frame)
        self._before, self._doubt, self._breaks_in = frame, False, False
        self._quiet_since, self._quiet_slack = frame.end, frame.slack


def _among(macs: Iterable[int]) -> Masks:
    """bool[256]: which address is one of some, to be asked for many at once."""
    import numpy as np

    among: Masks = np.zeros(256, bool)
    among[list(macs)] = True
    return among
