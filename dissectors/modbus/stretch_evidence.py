"""Evidence about the stations in a stretch of regular exchanges (`regular_exchanges.py`), one by one."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Self

import numpy as np

from dissectors.frame import Frame
from dissectors.modbus.asked import AskedRequest
from dissectors.modbus.exchange_columns import SAMPLES
from dissectors.modbus.learned_timing import READ
from dissectors.modbus.long_silences import SILENCE_LEAST
from dissectors.modbus.regular_exchanges import REFUSED, TO_ALL, UNANSWERED
from dissectors.modbus.remembered import BEGIN, LAST_STANDARD_UNIT, OPEN_KEPT, SLOW_UNLEARNT, slow_limit
from dissectors.modbus.response_groups import AnsweredRequest, SameRequest
from dissectors.modbus.station_record import Key, Requested, StationRecord
from dissectors.rhythm import TURNS_KEPT
from dissectors.tracker import Interval, Transaction

if TYPE_CHECKING:
    from dissectors.columns import Times, TransactionColumns
    from dissectors.modbus.observer import ModbusFindings
    from dissectors.modbus.regular_exchanges import Adus, Regular
    from dissectors.row_columns import RowColumns


@dataclass(frozen=True, slots=True)
class Exchanged:
    """Regular exchanges as lists, which a loop reads faster than arrays, by place among them.

    `octets`: unit and PDU of all frames; those of a request stand in [begin, end), of an answer in [answer_begin,
    answer_end). `request`, `last`: rows. `copy`: whether the answer says what the request said. Times and readings: ns.
    """

    rows: RowColumns
    found: Regular
    closed: TransactionColumns
    octets: bytes
    copy: list[bool]
    request: list[int]
    last: list[int]
    begin: list[int]
    end: list[int]
    answer_begin: list[int]
    answer_end: list[int]
    unit: list[int]
    kind: list[int]
    address: list[int]
    became: list[int]
    started: list[int]
    ended: list[int]
    low: list[int]
    nominal: list[int]
    high: list[int]

    @classmethod
    def of(cls, rows: RowColumns, found: Regular, adus: Adus) -> Self:
        """Of some rows."""
        request, last = found.request, found.request + found.answered
        closed = rows.transactions.take(found.transaction)
        ends = adus.offset + adus.length
        columns = (
            request,
            last,
            adus.offset[request],
            ends[request],
            adus.offset[last],
            ends[last],
            closed.station,
            rows.frames.kind[request],
            rows.frames.address[request],
            found.became,
            closed.start,
            closed.end,
            closed.least,
            closed.latency,
            closed.most,
        )
        octets = adus.octets.tobytes()
        same = found.answered & ~found.refused & (adus.length[request] == adus.length[last])
        copies = [False] * len(found)
        for at in np.flatnonzero(same).tolist():
            asked, came, size = int(columns[2][at]), int(columns[4][at]), int(adus.length[request[at]])
            copies[at] = octets[asked : asked + size] == octets[came : came + size]
        return cls(rows, found, closed, octets, copies, *(column.tolist() for column in columns))

    def said(self, at: int) -> bytes:
        """Unit and PDU of a request."""
        return self.octets[self.begin[at] : self.end[at]]

    def answer(self, at: int) -> bytes:
        """Unit and PDU of an answer."""
        return self.octets[self.answer_begin[at] : self.answer_end[at]]

    def key(self, at: int) -> Key:
        """What a request asks for, as a poll list has it."""
        address = self.address[at]
        return self.rows.frames.names[self.kind[at]], None if address < 0 else address

    def asked(self, at: int) -> AskedRequest:
        """A request as the rules see it."""
        row = self.rows.row(self.request[at])
        assert isinstance(row.event, Frame)
        assert row.header is not None
        return AskedRequest(row.no, row.event, row.header, self.said(at))

    def transaction(self, at: int) -> Transaction:
        """As it closed."""
        return self.rows.transaction(int(self.found.transaction[at]))

    def answered(self, at: int) -> AnsweredRequest:
        """An answer, to be compared with others."""
        latency = Interval(self.nominal[at], self.low[at], self.high[at])
        return AnsweredRequest(self.rows.first + self.last[at], self.ended[at], latency, self.answer(at))


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
        self._turns: tuple[Times, Times] = np.zeros(0, np.int64), np.zeros(0, np.int64)
        self._hurried: set[int] = set()
        self._paused = 0
        self._learn_timeout()

    def go_through(
        self,
        begin: int,
        end: int,
        pause_rows: list[int],
        pauses: list[int],
        turns: tuple[Times, Times],
        hurried: list[int],
    ) -> None:
        """Take exchanges [begin, end). `pauses`: the master's, ns, before the rows `pause_rows`, and which of them are
        far below the usual; `turns`: see `turns_before`."""
        self._turns = turns
        self._pause_rows, self._pauses, self._hurried, self._paused = pause_rows, pauses, set(hurried), 0
        self._learn_timeout()
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
                request = self._new_request(at, said)
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
        if min(became[begin:end]) <= REFUSED:
            self._judge.seen.strikes.whole()
        self._pause_until(one.last[end - 1])
        self._count_all()
        for request in self._compared:
            if request.answers and request.same is not None:
                request.same.add([one.answered(at) for at in request.same.needed(request.answers)])
                request.answers.clear()

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
        first = one.rows.first
        tally = station.exception(key, one.octets[one.answer_begin[at] + 2])
        tally.add(one.ended[at], first + one.request[at], first + one.last[at])

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
            judge.settle_request(judge.station(one.unit[at]), one.transaction(at), one.asked(at), code, answer)
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
        if gap >= SILENCE_LEAST:
            judge.silences.note(asked.no, gap)
        judge.waited_in_vain(asked, following)
        judge.settle_request(judge.station(one.unit[before]), one.transaction(before), asked, None, b"")
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
        cycles, answers = (times[newest].tolist() for times in self._turns)
        turns = [turn for turn in zip(cycles, answers, strict=True) if turn[1]]
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
        for at in which[-SAMPLES:]:  # no more are kept
            learnt.answered(took.unit, READ, one.nominal[at])
        if learnt.timeout != self._timeout:
            self._learn_timeout()
        station.compare_with(self._limit, len(which))
        which.clear()

    def _learn_timeout(self) -> None:
        """Ask anew from when on an answer is slow; no answer before is uncounted."""
        self._timeout = self._judge.learnt.timeout
        self._limit = slow_limit(self._timeout)
        self._slow = SLOW_UNLEARNT if self._limit is None else self._limit
