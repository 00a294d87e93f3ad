"""The rules of an N2 bus over many rows at once: stretches of regular exchanges by columns, all else row by row.

    a command, and its answer or refusal in the next row, which closes it
    a command, and a regular one in the next row, late enough that it tells of no second master, which closes it
    a command to all, which the next one closes

In a stretch only what is asked of a station's memory in order goes one by one: commands that change it, refusals, what
nobody answered, what took long. All else is counted.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from dissectors import stretches
from dissectors.columns import NONE, ROLES, VERDICTS
from dissectors.frame import Frame, Role
from dissectors.n2.commands import parse_command
from dissectors.n2.findings import ANSWERS_KEPT, N2Findings, refusal_code
from dissectors.n2.header import BROADCAST, meant
from dissectors.n2.masters import HASTE, OpenCommand
from dissectors.n2.misfits import FRAMED, READ, READ_LENGTH, asked_for
from dissectors.n2.unheard import ONLY_LOOKS, SOON
from dissectors.n2.wording import SLOW
from dissectors.rhythm import TURNS_KEPT
from dissectors.row_columns import in_turn
from dissectors.tracker import Verdict

if TYPE_CHECKING:
    from dissectors.columns import Masks, Times
    from dissectors.n2.record import N2StationRecord
    from dissectors.row_columns import RowColumns

_RESPONSE = ROLES.index(Role.RESPONSE)
_ANSWERED, _RETRY, _EXCEPTION, _NO_RESPONSE, _TO_ALL = (
    VERDICTS.index(verdict)
    for verdict in (Verdict.ANSWERED, Verdict.RETRY, Verdict.EXCEPTION, Verdict.NO_RESPONSE, Verdict.BROADCAST)
)
_COMMAND, _REFUSAL = ord(">"), ord("N")
_REMEMBERED: Final = (ONLY_LOOKS, "warm-reset", "override", "release-override")
"""Kinds of commands after which a station is another one than before."""


@dataclass(frozen=True, slots=True)
class _Regular:
    """Regular exchanges among some rows. `answered`: by the next row; `refused`: that is a refusal; `to_all`: asks all.

    `unit`: station asked. `kind`: place in the names of the frames.
    """

    stretches: stretches.Stretches
    answered: Masks
    refused: Masks
    to_all: Masks
    unit: Times
    kind: Times


_LOOKED_AT = 1024  # exchanges at a time


class BulkN2Findings(N2Findings):
    """The same from many rows at once (`dissectors.row_columns.JudgesColumns`)."""

    def take(self, rows: RowColumns) -> None:
        """Take many rows; few go one by one."""
        if len(rows) < stretches.LEAST:
            in_turn(self, rows)
            return
        judging = _Judging(self, rows)
        stretches.take(self, rows, judging.found.stretches, judging.is_at_rest, judging.pass_by)


def _regular(rows: RowColumns) -> _Regular:
    frames, placed, closed, count = rows.frames, rows.placed, rows.transactions, len(rows)
    fine = rows.good & rows.is_frame & frames.ok & (frames.length > 1)
    if rows.odd:
        fine[list(rows.odd)] = False
    starts = np.append(rows.octets, np.uint8(0))[frames.offset]
    request, response = closed.request - rows.first, closed.response - rows.first
    inside = (closed.request != NONE) & (request >= 0) & (request < count) & (closed.station != NONE)
    request = np.where(inside, request, 0)
    behind = np.minimum(request + 1, count - 1)
    asks = inside & fine[request] & (starts[request] == _COMMAND) & (placed.tx[request] == closed.id)
    asks &= placed.destination[request] == closed.station
    verdict = closed.verdict
    refusal = starts[behind] == _REFUSAL
    right = np.where(refusal, verdict == _EXCEPTION, (verdict == _ANSWERED) | (verdict == _RETRY))
    answered = asks & right & (response == request + 1) & (response < count) & (rows.closed_by == response)
    answered &= (closed.latency != NONE) & fine[behind] & (starts[behind] != _COMMAND) & (closed.response != NONE)
    answered &= (placed.tx[behind] == closed.id) & (placed.source[behind] == closed.station)
    held = asks & (closed.response == NONE) & (rows.closed_by == request + 1) & (request + 1 < count)
    patient = frames.start[behind] - frames.end[request] >= HASTE
    unanswered = held & (verdict == _NO_RESPONSE) & patient & (closed.station != BROADCAST)
    to_all = held & (verdict == _TO_ALL) & (closed.station == BROADCAST)
    which = np.flatnonzero(answered | unanswered | to_all)
    at_once = np.zeros(len(which), bool)
    return _Regular(
        stretches.Stretches.of(which, request[which], answered[which], at_once, rows),
        answered[which],
        (answered & refusal)[which],
        to_all[which],
        closed.station[which].astype(np.int64),
        frames.kind[request[which]].astype(np.int64),
    )


class _Judging:
    """One judge and the stretches of some rows."""

    def __init__(self, judge: N2Findings, rows: RowColumns) -> None:
        self._judge, self._rows = judge, rows
        self.found = found = _regular(rows)
        self._closed = rows.transactions.take(found.stretches.transaction)
        names = rows.frames.names
        self._is_identify = found.kind == (names.index(ONLY_LOOKS) if ONLY_LOOKS in names else NONE)
        kinds = [at for at, name in enumerate(names) if name in _REMEMBERED]
        told = found.refused | (found.answered & np.isin(found.kind, kinds))
        slow = found.answered & (self._closed.least > SLOW)
        length = rows.frames.length[found.stretches.request]
        is_read = found.answered & ~found.refused & (length == READ_LENGTH)
        self._reads = is_read & (found.kind == names.index(READ)) if READ in names else np.zeros(len(is_read), bool)
        self._unheard = np.zeros(len(found.answered), bool)
        self._events = told | slow | ~(found.answered | found.to_all)

    def is_at_rest(self, begin: int, end: int) -> bool:
        """Whether no command waits, and no frame may yet be the rest of another."""
        return self._judge.masters.is_at_rest and self._judge.torn.is_quiet

    def pass_by(self, begin: int, end: int) -> None:
        """Put the judge behind exchanges [begin, end)."""
        rows, judge, found, which = self._rows, self._judge, self.found.stretches, slice(begin, end)
        stretch = slice(int(found.request[begin]), int(found.last[end - 1]) + 1)
        frames = rows.frames
        judge.first = int(frames.start[stretch.start]) if judge.first is None else judge.first
        judge.now = max(judge.now, int(frames.end[stretch].max()))
        if self.found.answered[which].any():
            judge.strikes.whole()
        judge.torn.pass_by(rows.first + stretch.start, rows.slack[stretch])
        self._count(which)
        for at in (begin + np.flatnonzero(self._events[which])).tolist():
            self._see_event(at)
        self._see_silence(begin, end)
        self._see_late(begin, end)
        self._see_fits(begin, end)
        judge.newest = int(frames.start[stretch.stop - 1])
        self._see_rhythm(begin, end)
        self._keep_answers(begin, end)
        unit, begun = self.found.unit[which], frames.start[found.request[which]]
        for at in (*np.flatnonzero(unit[1:] != unit[:-1])[-1:].tolist(), -1):  # before it turned last; the newest
            judge.take_turn(int(unit[at]), int(begun[at]))

    def _see_rhythm(self, begin: int, end: int) -> None:
        """The master's newest turns, which tell whether it has a clock."""
        clocked, found, frames = self._judge.clocked, self.found, self._rows.frames
        request, last = found.stretches.request[begin:end], found.stretches.last[begin:end]
        clocked.see_command(int(frames.start[request[0]]))
        begins, ends, answered = frames.start[request], frames.end[request], found.answered[begin:end]
        soon = np.flatnonzero(answered[:-1] & (begins[1:] - ends[:-1] < SOON))[-TURNS_KEPT:]
        cycles, answers = begins[soon + 1] - begins[soon], frames.end[last[soon]] - begins[soon]
        clocked.rhythm.turns.extend(zip(cycles.tolist(), answers.tolist(), strict=True))
        if answered[-1]:
            clocked.answered(int(begins[-1]), int(ends[-1]), int(frames.end[last[-1]]))

    def _count(self, which: slice) -> None:
        """What is counted of commands and answers, by station."""
        judge, found, frames = self._judge, self.found, self._rows.frames
        unit, answered = found.unit[which], found.answered[which]
        request, last = found.stretches.request[which], found.stretches.last[which]
        judge.master.frames += len(unit)
        judge.master.octets += int(frames.length[request].sum())
        turns = np.append(judge.turn if judge.turn is not None else NONE, unit[:-1]) != unit
        size = int(unit.max()) + 1
        asked = ~found.to_all[which]
        columns = (
            np.bincount(unit[turns], minlength=size),
            np.bincount(unit[asked], minlength=size),
            np.bincount(unit[asked & ~self._is_identify[which]], minlength=size),
            np.bincount(unit[answered], minlength=size),
            np.bincount(unit[answered], weights=frames.length[last[answered]], minlength=size).astype(np.int64),
        )
        quickest = np.full(size, np.iinfo(np.int64).max)
        np.minimum.at(quickest, unit[answered], self._closed.least[which][answered])
        counts = list(zip(*(column.tolist() for column in (*columns, quickest)), strict=True))
        distinct, first = np.unique(unit, return_index=True)
        for one in distinct[np.argsort(first)].tolist():
            _add(judge.station(one), *counts[one])

    def _see_late(self, begin: int, end: int) -> None:
        """What came while an answer was overdue, and what no answer came to."""
        judge, rows, found, start = self._judge, self._rows, self.found, self._closed.start
        late = judge.late_speakers
        silent = ~(found.answered | found.to_all | self._unheard)
        at = begin
        while at < end:
            some = slice(at, min(at + _LOOKED_AT, end))
            told = np.flatnonzero(silent[some] | (start[some] < late.until))
            if not len(told):
                at = some.stop
                continue
            at += int(told[0])
            station = int(found.unit[at])
            if found.answered[at]:
                late.answered(station, f"station {station}", int(start[at]))
            elif silent[at]:
                place = int(found.stretches.request[at])
                after = int(rows.frames.start[place + 1])
                judge.unanswered(station, int(start[at]), int(self._closed.end[at]), after)
            at += 1

    def _see_silence(self, begin: int, end: int) -> None:
        """What stations left without an answer since they were heard last; where they were, `_count` has ended it."""
        judge, rows, found, closed = self._judge, self._rows, self.found, self._closed
        unit, answered = found.unit[begin:end], found.answered[begin:end]
        missed = ~(answered | found.to_all[begin:end])
        for one in np.unique(unit[missed]).tolist():
            its = unit == one
            heard = np.flatnonzero(its & answered)
            since = int(heard[-1]) if len(heard) else -1
            silence = judge.station(one).silence
            for at in (begin + np.flatnonzero(its & missed)).tolist():
                if at - begin > since:
                    no = rows.first + int(found.stretches.request[at])
                    silence.miss(int(closed.start[at]), no, is_repeat=int(closed.attempt[at]) > 1)

    def _see_event(self, at: int) -> None:
        """What changes what is known of a station."""
        judge, rows, found, closed = self._judge, self._rows, self.found, self._closed
        station, place = judge.station(int(found.unit[at])), int(found.stretches.request[at])
        if not found.answered[at]:
            waited, kind = int(rows.frames.start[place + 1] - rows.frames.end[place]), rows.frames.names[found.kind[at]]
            again = self._octets(place) == self._octets(place + 1)
            self._unheard[at] = unheard = judge.patience.is_unheard(waited, again, int(closed.attempt[at]), kind)
            missed = station.unheard if unheard else station.missing
            missed.add(int(closed.id[at]), int(closed.end[at]), rows.first + place)
            return
        least = int(closed.least[at])
        if least > SLOW:
            station.slow.add(int(closed.end[at]), rows.first + place + 1)
            station.slowest = max(station.slowest, least)
        row, transaction = rows.row(place), rows.transaction(int(found.stretches.transaction[at]))
        assert isinstance(row.event, Frame)
        asked = OpenCommand(row.no, row.event, parse_command(meant(row.event)))
        if found.refused[at]:
            judge.refused(station, asked, refusal_code(self._octets(place + 1)), transaction)
        else:
            judge.obeyed(station, asked, transaction)

    def _see_fits(self, begin: int, end: int) -> None:
        """Acknowledges of reads, by what was asked; one by one only those that do not fit."""
        judge, found, frames = self._judge, self.found, self._rows.frames
        in_turn = found.answered[begin:end] | found.to_all[begin:end]
        reads = np.append(not judge.is_overdue, in_turn[:-1]) & self._reads[begin:end]
        judge.is_overdue = not in_turn[-1]
        at = begin + np.flatnonzero(reads)
        request, last = found.stretches.request[at], found.stretches.last[at]
        octets, offset = self._rows.octets, frames.offset[request].astype(np.int64)
        region, high, low = (octets[offset + place].astype(np.int64) for place in (4, 7, 8))
        key = found.unit[at] << 24 | region << 16 | high << 8 | low
        _, first, which = np.unique(key, return_index=True, return_inverse=True)
        told = [asked_for(self._octets(int(request[one]))) for one in first.tolist()]
        odd = np.zeros(len(at), bool)
        for number, asked in enumerate(told):
            if asked is not None:
                same = which == number
                fits = same & np.isin(frames.length[last], [width + FRAMED for width in asked.widths])
                judge.station(int(found.unit[at[first[number]]])).misfits.see_fitting(
                    asked, int(np.count_nonzero(fits))
                )
                odd |= same & ~fits
        for one in np.flatnonzero(odd).tolist():
            asked, place = told[int(which[one])], int(at[one])
            assert asked is not None
            nos = self._rows.first + int(request[one]), self._rows.first + int(last[one])
            misfits = judge.station(int(found.unit[place])).misfits
            misfits.see(asked, int(frames.length[last[one]]), int(self._closed.end[place]), nos)

    def _keep_answers(self, begin: int, end: int) -> None:
        found = self.found
        for at in (begin + np.flatnonzero(found.answered[begin:end])[-ANSWERS_KEPT:]).tolist():
            self._judge.keep_answer(int(self._closed.id[at]), self._octets(int(found.stretches.last[at])))

    def _octets(self, place: int) -> bytes:
        begin = int(self._rows.frames.offset[place])
        return self._rows.octets[begin : begin + int(self._rows.frames.length[place])].tobytes()


def _add(
    station: N2StationRecord, turns: int, asked: int, other: int, answered: int, octets: int, quickest: int
) -> None:
    """Count commands to a station (`other`: those that are no identify) and its answers."""
    station.turns += turns
    station.asked += asked
    station.only_identify &= not other
    if answered:
        station.silence.heard()
        station.answered += answered
        station.sent.frames += answered
        station.sent.octets += octets
        station.quickest = quickest if station.quickest is None else min(station.quickest, quickest)
