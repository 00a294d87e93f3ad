"""The rules of a Modbus line over many rows at once: stretches of regular exchanges by columns, all else row by row.

What a stretch teaches depends on order only exchange by exchange (a station's response times, the master's timeout, how
often a request came back), so this goes through the exchanges once, without an object for a row; what is counted or
measured of rows goes by columns. Everything is where `see` and `settle` would have left it when a stretch ends.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dissectors import stretches
from dissectors.columns import ROLES
from dissectors.frame import Frame, Role
from dissectors.line import MS
from dissectors.modbus.cut_echo import CutEcho
from dissectors.modbus.envelope import RTU_NAME
from dissectors.modbus.exchanged import Exchanged
from dissectors.modbus.gap_columns import hurried, see_close, see_spacing, silences, turns_before
from dissectors.modbus.gaps import sender_name
from dissectors.modbus.observer import ModbusFindings
from dissectors.modbus.regular_exchanges import UNANSWERED, adus_of, regular
from dissectors.modbus.remembered import FINAL_KEPT, OPEN_KEPT
from dissectors.modbus.stretch_evidence import StretchEvidence
from dissectors.row_columns import in_turn

if TYPE_CHECKING:
    from dissectors.row_columns import RowColumns

_REQUEST = ROLES.index(Role.REQUEST)


class BulkModbusFindings(ModbusFindings):
    """The same from many rows at once (`dissectors.row_columns.JudgesColumns`)."""

    def take(self, rows: RowColumns) -> None:
        """Take many rows; few go one by one."""
        if len(rows) < stretches.LEAST:
            in_turn(self, rows)
            return
        judging = _Judging(self, rows)
        stretches.take(self, rows, judging.found.stretches, judging.is_at_rest, judging.pass_by)


class _Judging:
    """One judge and the stretches of some rows."""

    def __init__(self, judge: ModbusFindings, rows: RowColumns) -> None:
        self._judge, self._rows = judge, rows
        adus = adus_of(rows)
        self.found = regular(rows, adus)
        self._exchanged = Exchanged.of(rows, self.found, adus)
        self._silences = silences(rows, judge.timing, judge.gaps.close)
        self._evidence = StretchEvidence(judge, self._exchanged)

    def is_at_rest(self, begin: int, end: int) -> bool:
        """Whether nothing is open or held that a regular exchange would have to do with."""
        judge = self._judge
        if judge.open is not None or judge.broadcast is not None or judge.ends.newest is not None:
            return False
        if judge.unfit is not None:
            return False
        if max(len(judge.asked), len(judge.codes), len(judge.answers)) >= OPEN_KEPT - 1:
            return False
        return not judge.seen.pairs or not (self.found.became[begin:end] == UNANSWERED).any()

    def pass_by(self, begin: int, end: int) -> None:
        """Put the judge behind exchanges [begin, end)."""
        rows, judge, exchanged, which = self._rows, self._judge, self._exchanged, slice(begin, end)
        stretch = slice(exchanged.request[begin], exchanged.last[end - 1] + 1)
        self._count(stretch, which)
        pause_rows, pauses = self._see_gaps(stretch)
        turns = turns_before(judge.gaps, rows, pause_rows, stretch.start)
        self._evidence.go_through(begin, end, pause_rows, pauses, turns, hurried(judge.gaps, pauses))
        closed = exchanged.closed
        judge.repeats.extend(closed.id[which][closed.attempt[which] > 1].tolist())
        self._keep_answers(begin, end)
        last = rows.row(stretch.stop - 1)
        assert isinstance(last.event, Frame)
        judge.gaps.pass_by(last.event, int(rows.frames.start[stretch.stop - 2]))
        judge.torn.see(last.no, last.event, None, is_good_frame=True)
        judge.seen.carried_over.begin_anew()
        judge.newest = int(closed.id[end - 1])
        judge.given_back = CutEcho()

    def _count(self, stretch: slice, which: slice) -> None:
        """What is counted of frames."""
        rows, judge, seen, found = self._rows, self._judge, self._judge.seen, self.found
        frames, slack = rows.frames, rows.slack[stretch]
        seen.first = int(frames.start[stretch.start]) if seen.first is None else seen.first
        seen.now = max(seen.now, int(frames.end[stretch].max()))
        late = np.flatnonzero(slack > judge.timing.latency + MS)
        judge.late.add((rows.first + stretch.start + late).tolist())
        size = np.maximum(frames.length[stretch], frames.expected[stretch])
        request, answered = found.request[which] - stretch.start, found.answered[which]
        seen.requests += len(request)
        seen.frames["master"] += len(request)
        seen.octets["master"] += int(size[request].sum())
        unit, answers = self._exchanged.closed.station[which][answered], request[answered] + 1
        seen.answers += len(answers)
        counts, octets = np.bincount(unit).tolist(), np.bincount(unit, weights=size[answers]).tolist()
        distinct, first = np.unique(unit, return_index=True)
        for one in distinct[np.argsort(first)].tolist():
            seen.frames[sender_name(one)] += counts[one]
            seen.octets[sender_name(one)] += int(octets[one])

    def _see_gaps(self, stretch: slice) -> tuple[list[int], list[int]]:
        """Silences between and inside RTU frames. Gives the master's pauses, ns, and the rows behind them."""
        rows, gaps, said = self._rows, self._judge.gaps, self._silences
        first, start = stretch.start, int(rows.frames.start[stretch.start])
        if rows.protocol == RTU_NAME:
            offset = int(rows.frames.offset[first])
            octets = rows.octets[offset : offset + int(rows.frames.length[first])].tobytes()
            if gaps.begins_soon(start, octets):
                gaps.seen.too_close("master", start, rows.first + first - 1, rows.first + first)
            see_close(gaps, rows, first + 1 + np.flatnonzero(said.close[first + 1 : stretch.stop]))
            see_spacing(gaps, rows, said, stretch)
        behind = first + 1 + np.flatnonzero(said.pause[first + 1 : stretch.stop] >= 0)
        pause_rows, pauses = behind.tolist(), said.pause[behind].tolist()
        if gaps.answered is not None and rows.placed.role[first] == _REQUEST:
            return [first, *pause_rows], [max(0, start - gaps.answered.end), *pauses]
        return pause_rows, pauses

    def _keep_answers(self, begin: int, end: int) -> None:
        """The last answers, for those that come twice."""
        found, exchanged, final = self.found, self._exchanged, self._judge.final
        newest = begin + np.flatnonzero(found.answered[begin:end] & ~found.refused[begin:end])[-FINAL_KEPT:]
        for at in newest.tolist():
            final[int(exchanged.closed.id[at])] = exchanged.answer(at)
        while len(final) > FINAL_KEPT:
            del final[next(iter(final))]
