"""Evidence about the stations in a stretch of regular exchanges.

Many in a row are taken together where there is nothing to say of them but that they were answered, all others one by
one.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from dissectors.modbus.exchange_columns import SAMPLES
from dissectors.modbus.exchanged import Exchanged
from dissectors.modbus.heard import Heard
from dissectors.modbus.learned_timing import READ
from dissectors.modbus.limits import ILLEGAL, beyond_limits
from dissectors.modbus.long_silences import SILENCE_LEAST
from dissectors.modbus.regular_exchanges import REFUSED, REPEATED, TO_ALL, UNANSWERED
from dissectors.modbus.remembered import BEGIN, LAST_STANDARD_UNIT, OPEN_KEPT, SLOW_UNLEARNT, slow_limit
from dissectors.modbus.response_groups import SameRequest
from dissectors.modbus.station_record import Key, Requested, StationRecord
from dissectors.rhythm import TURNS_KEPT

if TYPE_CHECKING:
    from dissectors.columns import Masks, Times
    from dissectors.modbus.observer import ModbusFindings


MANY = 64
"""Exchanges in a row from which on it is worth while to take them together."""


@dataclass(slots=True)
class _Request:
    """One request, octet for octet, where it counts, and its answers of this stretch that are compared, by place.

    `took`: exchanges with its station that are not counted yet.
    """

    key: Key
    address: int
    kind: int
    requested: Requested
    took: list[int]
    same: SameRequest | None = None
    is_new: bool = True  # no answer that could be compared has come yet
    answers: list[int] = field(default_factory=list)


@dataclass(slots=True)
class _Took:
    """A station, and the exchanges with it that are not counted yet, by place."""

    unit: int
    station: StationRecord
    exchanges: list[int] = field(default_factory=list)


class StretchEvidence:
    """One judge and the regular exchanges of some rows."""

    def __init__(self, judge: ModbusFindings, exchanged: Exchanged) -> None:
        self._judge, self._exchanged = judge, exchanged
        self._requests: dict[bytes, _Request] = {}
        self._took: dict[int, _Took] = {}
        self._compared: list[_Request] = []
        self._pause_rows: list[int] = []
        self._pauses: list[int] = []
        self._turns: tuple[Times, Times, Masks] = np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0, bool)
        self._hurried: set[int] = set()
        self._paused = 0
        self._learn_timeout()

    def go_through(
        self,
        begin: int,
        end: int,
        pause_rows: list[int],
        pauses: list[int],
        turns: tuple[Times, Times, Masks],
        hurried: list[int],
    ) -> None:
        """Take exchanges [begin, end). `pauses`: the master's, ns, before the rows `pause_rows`, and which of them are
        far below the usual; `turns`: see `turns_before`."""
        self._turns = turns
        self._pause_rows, self._pauses, self._hurried, self._paused = pause_rows, pauses, set(hurried), 0
        self._learn_timeout()
        one, place, late_speakers = self._exchanged, begin, self._judge.seen.late_speakers
        while place < end:
            plain, behind = self._plain_segment(place, end)
            known = self._timeout, late_speakers.until
            self._one_by_one(place, plain)
            place = plain
            if plain < behind and known == (self._timeout, late_speakers.until):  # else what is plain is asked anew
                self._together(plain, behind)
                place = behind
        if min(one.became[begin:end]) <= REFUSED:
            self._judge.seen.strikes.whole()
        self._see_newest(begin, end)
        self._pause_until(one.last[end - 1])
        self._count_all()
        for request in self._compared:
            if request.answers and request.same is not None:
                request.same.add([one.answered(at) for at in request.same.needed(request.answers)])
                request.answers.clear()

    def _see_newest(self, begin: int, end: int) -> None:
        """The newest answer among exchanges [begin, end)."""
        one = self._exchanged
        newest = next((at for at in range(end - 1, begin - 1, -1) if one.became[at] <= REPEATED), None)
        if newest is not None:
            self._judge.seen.newest_answer = one.rows.first + one.last[newest], one.unit[newest]

    def _one_by_one(self, begin: int, end: int) -> None:
        """Take exchanges [begin, end), each as what it is."""
        if begin == end:
            return
        one, cycles, requests = self._exchanged, self._judge.seen.cycles, self._requests
        octets, begins, ends, became, low = one.octets, one.begin, one.end, one.became, one.low
        address, kind, started = one.address, one.kind, one.started
        has_reserved = max(one.unit[begin:end]) > LAST_STANDARD_UNIT
        late_speakers = self._judge.seen.late_speakers
        waiting: int | None = None  # the exchange before, if nothing answered it
        for at in range(begin, end):
            said = octets[begins[at] : ends[at]]
            if waiting is not None:
                self._give_up(waiting, at)
                waiting = None
            what = became[at]
            if has_reserved and one.unit[at] > LAST_STANDARD_UNIT:
                self._see_reserved(at)
            if what > REFUSED:
                self._see_unusual(at, what, said)
                waiting = at if what == UNANSWERED else None
                continue
            request = requests.get(said)
            if request is None or request.address != address[at] or request.kind != kind[at]:
                request = self._request(at, said)
            if started[at] < late_speakers.until:
                late_speakers.answered(one.unit[at], f"station {one.unit[at]}", started[at])
            requested = request.requested
            requested.tries += 1
            requested.turns += 1
            cycles.add(said, request.key, started[at])
            teaches = self._timeout is not None and one.nominal[at] > self._timeout  # that the master waits longer
            if teaches:
                self._count_all()
            request.took.append(at)
            if teaches:
                self._count_all()
            if low[at] > self._slow:
                self._took_long(at)
            if what == REFUSED:
                self._refused(at, request.key)
            elif request.same is not None:
                request.answers.append(at)
            elif request.is_new:
                self._compare(at, said, request)

    # ---- many in a row of which there is nothing to say but that they were answered

    def _plain_segment(self, begin: int, end: int) -> tuple[int, int]:
        """The first exchanges in [begin, end), MANY at least, that were all answered or refused, not slowly, and of
        which none ends the wait of another or shows who speaks late; nothing at `end` where there are none."""
        if end - begin < MANY:
            return end, end
        one, which = self._exchanged, slice(begin, end)
        closed, became = one.closed, one.found.became[which]
        plain = (became <= REFUSED) & (closed.least[which] <= self._slow)
        plain &= closed.station[which] <= LAST_STANDARD_UNIT
        plain &= closed.start[which] >= self._judge.seen.late_speakers.until
        plain[1:] &= became[:-1] != UNANSWERED
        if self._timeout is not None:
            plain &= closed.latency[which] <= self._timeout
        edges = np.flatnonzero(np.diff(plain, prepend=False, append=False))
        long = np.flatnonzero(edges[1::2] - edges[::2] >= MANY)
        if not len(long):
            return end, end
        first, behind = edges[2 * int(long[0]) : 2 * int(long[0]) + 2].tolist()
        return begin + first, begin + behind

    def _together(self, begin: int, end: int) -> None:
        """Take the exchanges of such a segment, request by request in the order in which each came first."""
        one, cycles = self._exchanged, self._judge.seen.cycles
        octets, which = one.octets, slice(begin, end)
        numbers: dict[bytes, int] = {}
        limits = zip(one.begin[which], one.end[which], strict=True)
        same = np.fromiter((numbers.setdefault(octets[a:b], len(numbers)) for a, b in limits), np.int64, end - begin)
        order = np.argsort(same, kind="stable")
        behind = np.cumsum(np.bincount(same))
        first = order[np.append(0, behind[:-1])]
        address, kind = (column[one.found.request[which]] for column in (one.rows.frames.address, one.rows.frames.kind))
        if (address != address[first[same]]).any() or (kind != kind[first[same]]).any():
            self._one_by_one(begin, end)  # the same octets, read in two ways
            return
        if cycles.order.looks_at(len(same)):
            places = zip(numbers, (begin + first).tolist(), strict=True)
            cycles.order.add_all(same, [(said[0], one.key(at)) for said, at in places])
        else:
            cycles.order.skip(len(same))
        refused = one.found.became[which] == REFUSED
        places, started = (begin + order).tolist(), one.closed.start[which][order].tolist()
        is_refused = refused[order].tolist() if refused.any() else []
        answered: list[tuple[bytes, _Request, list[int]]] = []
        periods: list[tuple[int, bytes, list[int]]] = []
        at = 0
        for said, stop in zip(numbers, behind.tolist(), strict=True):
            asked = places[at:stop]
            request = self._request(asked[0], said)
            request.requested.tries += stop - at
            request.requested.turns += stop - at
            period = cycles.again(said, request.key, started[at:stop])
            if period is not None:
                periods.append((asked[period[0]], said, period[1]))
            if request.same is not None or request.is_new:
                if True in is_refused[at:stop]:
                    asked = [place for place, no in zip(asked, is_refused[at:stop], strict=True) if not no]
                if asked:
                    answered.append((said, request, asked))
            at = stop
        for _, said, each in sorted(periods):
            cycles.keep(said, each)
        for place in (begin + np.flatnonzero(refused)).tolist():
            self._refused(place, self._requests[octets[one.begin[place] : one.end[place]]].key)
        unit = one.closed.station[which]
        for took in self._took.values():
            took.exchanges.extend((begin + np.flatnonzero(unit == took.unit)).tolist())
        answered.sort(key=lambda each: each[2][0])
        for said, request, answers in answered:
            if request.is_new and request.same is None:
                self._compare(answers.pop(0), said, request)
            if request.same is not None:
                request.answers += answers

    def _request(self, at: int, said: bytes) -> _Request:
        """The record of what an exchange asks."""
        request, one = self._requests.get(said), self._exchanged
        if request is None or request.address != one.address[at] or request.kind != one.kind[at]:
            request = self._new_request(at, said)
        return request

    # ---- what is rarer

    def _new_request(self, at: int, said: bytes) -> _Request:
        one, judge, unit = self._exchanged, self._judge, self._exchanged.unit[at]
        self._note_begin(said)
        station, key = judge.station(unit), one.key(at)
        took = self._took.get(unit)
        if took is None:
            took = self._took[unit] = _Took(unit, station)
        request = _Request(key, one.address[at], one.kind[at], station.request(key), took.exchanges)
        self._requests[said] = request
        return request

    def _note_begin(self, said: bytes) -> None:
        begins = self._judge.begins
        if len(said) > BEGIN and len(begins) < OPEN_KEPT:
            begins.add(said[:BEGIN])

    def _compare(self, at: int, said: bytes, request: _Request) -> None:
        """The first answer to a request in these rows."""
        request.is_new = False
        request.same = self._took[self._exchanged.unit[at]].station.same_request(request.key, said)
        if request.same is not None:
            request.answers.append(at)
            self._compared.append(request)

    def _refused(self, at: int, key: Key) -> None:
        one, station = self._exchanged, self._took[self._exchanged.unit[at]].station
        first, code = one.rows.first, one.octets[one.answer_begin[at] + 2]
        rows = first + one.request[at], first + one.last[at]
        beyond = beyond_limits(one.octets[one.begin[at] : one.end[at]]) if code in ILLEGAL else None
        if beyond is None:
            station.exception(key, code).add(one.ended[at], *rows)
        else:
            station.impossible.add(beyond, one.started[at], *rows)
            station.impossible.codes[code] += 1

    def _see_unusual(self, at: int, what: int, said: bytes) -> None:
        """A repeat, a request that nobody answers (what that means is known when the next one comes), one to all."""
        one, judge = self._exchanged, self._judge
        self._note_begin(said)
        if what == TO_ALL:
            judge.seen.cycles.add(said, one.key(at), one.started[at])
        elif what != UNANSWERED:
            self._settle(at)
            refused = bool(one.found.refused[at])
            code, answer = (one.octets[one.answer_begin[at] + 2], b"") if refused else (None, one.answer(at))
            asked = one.asked(at)
            heard = Heard(asked, code, answer)
            judge.settle_request(judge.station(one.unit[at]), one.transaction(at), asked, heard)
            self._learn_timeout()

    def _see_reserved(self, at: int) -> None:
        """Frames to or from an address outside the standard."""
        one, station = self._exchanged, self._judge.station(self._exchanged.unit[at])
        for place in range(one.request[at], one.last[at] + 1):
            station.reserved.add(int(one.rows.frames.start[place]), one.rows.first + place)

    def _give_up(self, before: int, at: int) -> None:
        """A request that nothing answered until the next one."""
        one, judge = self._exchanged, self._judge
        self._settle(before)
        asked, following = one.asked(before), one.asked(at)
        gap = following.frame.start - asked.frame.end
        if gap < SILENCE_LEAST or not judge.silences.note(asked.no, gap):
            judge.waited_in_vain(asked, following)
        judge.settle_request(judge.station(one.unit[before]), one.transaction(before), asked, Heard(asked))
        self._learn_timeout()

    def _took_long(self, at: int) -> None:
        self._pause_until(self._exchanged.last[at])
        took = self._took[self._exchanged.unit[at]]
        if took.exchanges:
            self._count(took)
        self._judge.gaps.took_long(took.station.slow, self._exchanged.transaction(at))

    # ---- what is put off until somebody asks

    def _settle(self, at: int) -> None:
        """Everything up to the rows of an exchange."""
        self._pause_until(self._exchanged.last[at])
        self._count_all()

    def _pause_until(self, row: int) -> None:
        """The master's pauses up to a row."""
        begin, end = self._paused, bisect_right(self._pause_rows, row, self._paused)
        if begin == end:
            return
        gaps, first = self._judge.gaps, self._exchanged.rows.first
        if self._hurried:
            gaps.hurried.extend(first + self._pause_rows[at] - 1 for at in range(begin, end) if at in self._hurried)
        newest = slice(max(begin, end - TURNS_KEPT), end)
        cycles, answers, known = (column[newest] for column in self._turns)
        turns = zip(cycles[known].tolist(), answers[known].tolist(), strict=True)
        gaps.paused(self._pauses[begin:end], turns)
        self._paused = end

    def _count_all(self) -> None:
        for took in self._took.values():
            if took.exchanges:
                self._count(took)

    def _count(self, took: _Took) -> None:
        """Answers of one station, which are all compared with the same limit."""
        one, station, which, learnt = self._exchanged, took.station, took.exchanges, self._judge.learnt
        station.asked += len(which)
        station.answered += len(which)
        station.last_start = one.started[which[-1]]
        station.heard(one.ended[which[-1]])
        station.copies += sum([one.copy[at] for at in which])
        station.times.extend(
            [one.low[at] for at in which], [one.nominal[at] for at in which], [one.high[at] for at in which]
        )
        learnt.answered_often(took.unit, READ, [one.nominal[at] for at in which[-SAMPLES:]])  # no more are kept
        if learnt.timeout != self._timeout:
            self._learn_timeout()
        station.compare_with(self._limit, len(which))
        which.clear()

    def _learn_timeout(self) -> None:
        """Ask anew from when on an answer is slow; no answer before is uncounted."""
        self._timeout = self._judge.learnt.timeout
        self._limit = slow_limit(self._timeout)
        self._slow = SLOW_UNLEARNT if self._limit is None else self._limit
