"""Pairing MS/TP frames by columns, where it is certain what `MstpTracker` would make of them.

What a row is depends on the row before it alone: a token, a poll and a request wait for the next frame and are over
with it, whatever it is; everything else waits for nothing. So all rows are placed at once, and what one cannot be sure
of is left out:

    segments, Reply Postponed, tests, extended frames with data to one station, damaged frames, answers that come later,
    requests in frames that expect no reply, copies without a pause (echoes), and the row after each of them

`run` decides the rows from a given one on, up to the first that is doubtful, and moves a tracker there; the tracker
takes the doubtful row, and the one behind it, as ever. What a tracker knows of the time before is asked at the begin of
a run: postponed exchanges, and requests that had no answer and may be tried again.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dissectors.bacnet.exchange import Exchange
from dissectors.bacnet.frame_types import HEADER, FrameType
from dissectors.bacnet.limits import BROADCAST, T_NO_TOKEN, T_USAGE_DELAY, TURNAROUND_BITS
from dissectors.bacnet.npdu_columns import NO_KEY, Nets, heads
from dissectors.bacnet.past_exchanges import REMEMBERED, Entry, PastExchanges
from dissectors.bacnet.tracker import LATE_WITHIN, POSTPONED_FOR, SEGMENTS_FOR, MstpTracker
from dissectors.columns import (
    CHECKS,
    FOUNDS,
    NONE,
    ROLES,
    VERDICTS,
    FrameColumns,
    PlacementColumns,
    TransactionColumns,
)
from dissectors.frame import Frame, Role
from dissectors.tracker import Interval, Verdict

if TYPE_CHECKING:
    from collections.abc import Iterator

    from dissectors.bacnet.exchange import Key
    from dissectors.bacnet.tracker import Standing
    from dissectors.bacnet.turn import Turn
    from dissectors.columns import Codes, Masks, Octets, Times
    from dissectors.line import Timing

_DOUBTFUL, _TOKEN, _POLL, _POLL_REPLY, _REQUEST, _ANSWER, _SINGLE = range(7)
_WAITS = np.array([0, 1, 1, 0, 1, 0, 0], bool)  # which of them hold the bus

_V = {verdict: np.uint8(code) for code, verdict in enumerate(VERDICTS)}
_ROLE = {role: np.uint8(code) for code, role in enumerate(ROLES)}
_CRC = 2
_FEW = 4
"""Rows after which it is certain whose turn it is, whatever was before."""


class Run(NamedTuple):
    """What was decided: rows [begin, end), where they belong, and the transactions that they closed, in order."""

    begin: int
    end: int
    placements: PlacementColumns
    transactions: TransactionColumns


class Pairing:
    """The rows of some columns, placed by what each says and the one before it.

    `octets`: where `frames.offset` counts. `nets`: of the tracker that will be moved (`prepare`).
    """

    def __init__(self, frames: FrameColumns, octets: Octets, timing: Timing, nets: Nets) -> None:
        self.frames, self.octets, self._timing, self._nets = frames, octets, timing, nets
        self._source, self._destination = frames.source.astype(np.int64), frames.destination.astype(np.int64)
        self._class, self._key, self._verdict_alone = self._classes()
        self._relate()
        self._close()

    # What each row is by itself

    def _classes(self) -> tuple[Codes, Times, Codes]:
        frames, kinds = self.frames, self.frames.function
        good, to_all = frames.ok, self._destination == BROADCAST
        classes = np.full(len(frames), _DOUBTFUL, np.uint8)
        short = good & (frames.length == HEADER)
        for kind, what in (
            (FrameType.TOKEN, _TOKEN),
            (FrameType.POLL_FOR_MASTER, _POLL),
            (FrameType.REPLY_TO_POLL_FOR_MASTER, _POLL_REPLY),
        ):
            classes[short & (kinds == kind)] = what
        foreign = (kinds > FrameType.REPLY_POSTPONED) & (kinds != FrameType.EXTENDED_DATA_EXPECTING_REPLY)
        classes[good & foreign & (kinds != FrameType.EXTENDED_DATA_NOT_EXPECTING_REPLY)] = _SINGLE
        keys = np.full(len(frames), NO_KEY, np.int64)
        expecting = kinds == FrameType.DATA_EXPECTING_REPLY
        rows = np.flatnonzero(good & (expecting | (kinds == FrameType.DATA_NOT_EXPECTING_REPLY)))
        begin, size = frames.offset[rows] + HEADER, frames.length[rows] - np.int64(HEADER + _CRC)
        head = heads(self.octets, begin, size, self._source[rows], self._destination[rows], self._nets)
        one, asked = ~to_all[rows], expecting[rows]
        classes[rows[head.asks & one & asked]] = _REQUEST
        classes[rows[head.answers & one]] = _ANSWER
        classes[rows[head.unasked & (~one | ~asked)]] = _SINGLE
        keys[rows] = head.key
        return classes, keys, np.where(to_all, _V[Verdict.BROADCAST], _V[Verdict.DATA])

    # What each row is by the one before it

    def _relate(self) -> None:
        frames, classes = self.frames, self._class
        count = len(frames)
        before = np.maximum(np.arange(count) - 1, 0)
        gap = frames.start - frames.end[before]
        back = (self._source == self._destination[before]) & (self._destination == self._source[before])
        in_time = gap < T_NO_TOKEN
        answered = in_time & back & (classes == _POLL_REPLY) & (classes[before] == _POLL)
        asked = in_time & (classes[before] == _REQUEST)
        answered |= asked & back & (classes == _ANSWER) & (self._key == self._key[before])
        doubtful = ((classes == _POLL_REPLY) | (classes == _ANSWER)) & ~answered
        doubtful |= asked & back & ~answered & (classes != _TOKEN) & (classes != _POLL)
        same = (frames.length == frames.length[before]) & (frames.function == frames.function[before])
        same &= (self._source == self._source[before]) & (self._destination == self._destination[before])
        if self._timing.latency < T_USAGE_DELAY:
            doubtful |= same & (gap < self._timing.line.bits(TURNAROUND_BITS))
        doubtful |= classes == _DOUBTFUL
        self._answered, self._in_time = answered, in_time
        self._used = in_time & (self._source == self._destination[before])
        again = same & in_time & (classes == _TOKEN)  # a token passed again
        self._attempt = (np.arange(count) - np.maximum.accumulate(np.where(again, 0, np.arange(count))) + 1).astype(
            np.int32
        )
        self._requests = np.flatnonzero(classes == _REQUEST)
        self._earlier = self._same_key_before()
        within = self._failed_within()
        self._repeating = np.flatnonzero(within)
        doubtful[self._requests] |= within & (np.arange(len(within)) - self._earlier >= REMEMBERED)
        sure = ~doubtful & frames.chained
        sure[1:] &= ~doubtful[:-1]
        self._sure = sure
        self._doubtful_rows = np.append(np.flatnonzero(~sure), count)
        self._opened = np.cumsum(~answered)

    def _same_key_before(self) -> Times:
        """Of each request, the place among requests of the newest one before it with the same key, or NONE."""
        keys = self._key[self._requests]
        order = np.argsort(keys, kind="stable")
        earlier = np.full(len(keys), NONE, np.int64)
        same = keys[order][1:] == keys[order][:-1]
        earlier[order[1:][same]] = order[:-1][same]
        return earlier

    def _failed_within(self) -> Masks:
        """Which requests come so soon after one with the same key that had no answer, that they may repeat it."""
        if not len(self._requests):
            return np.zeros(0, bool)
        older = self._requests[np.maximum(self._earlier, 0)]
        answered = np.append(self._answered, False)[older + 1]
        soon = self.frames.start[self._requests] - self.frames.end[older] < LATE_WITHIN
        failed: Masks = (self._earlier >= 0) & ~answered & soon
        return failed

    # The transactions that each row closes

    def _close(self) -> None:
        frames, classes = self.frames, self._class
        closes = np.zeros(len(frames), bool)
        closes[1:] = _WAITS.take(classes[:-1])
        waited, alone = np.flatnonzero(closes), np.flatnonzero(classes == _SINGLE)
        closing = np.concatenate((waited, alone))
        order = np.argsort(closing, kind="stable")  # what waited goes before what is over at once
        owner = np.concatenate((waited - 1, alone))[order]
        closing = closing[order]
        kind = classes[owner]
        answered, single = self._answered[closing] & (kind != _SINGLE), kind == _SINGLE
        negative = frames.error[closing] != 0
        verdict = np.where(kind == _REQUEST, _V[Verdict.NO_RESPONSE], _V[Verdict.DATA])
        verdict[(kind == _TOKEN) & ~self._used[closing]] = _V[Verdict.NO_RESPONSE]
        verdict[answered] = _V[Verdict.ANSWERED]
        verdict[answered & (kind == _REQUEST) & negative] = _V[Verdict.EXCEPTION]
        verdict = np.where(single, self._verdict_alone[owner], verdict)
        timed = answered | (kind == _TOKEN) & self._used[closing]
        latency = np.maximum(frames.start[closing] - frames.end[owner], 0)
        slack = self._timing.latency
        self._closing, self._owner = closing, owner
        self._transactions = TransactionColumns(
            id=self._opened[owner],
            station=frames.destination[owner],
            kind=frames.kind[owner],
            request=owner,
            response=np.where(answered, closing, NONE),
            verdict=verdict,
            start=frames.start[owner],
            end=np.where(answered, frames.end[closing], frames.end[owner]),
            latency=np.where(timed, latency, NONE),
            least=np.where(timed, np.maximum(latency - slack, 0), NONE),
            most=np.where(timed, latency + slack, NONE),
            attempt=self._attempt[owner],
            of=np.where(self._attempt[owner] > 1, self._opened[owner] - 1, NONE),
            error=np.where(single | answered & (kind == _REQUEST) & negative, frames.error[closing], 0).astype(
                np.uint16
            ),
            names=frames.names,
        )

    # A stretch of rows that a tracker need not see

    def run(self, tracker: MstpTracker, begin: int, no: int) -> Run | None:
        """Decide rows from `begin` on, which has the number `no`, and move the tracker behind them.

        The tracker has just taken the row before. None where `begin` is doubtful: then it must take that row too.
        """
        if not self._sure[begin]:
            return None
        standing = tracker.standing()
        waiting = standing.waiting
        if not self._is_local(waiting, begin, no) or standing.next < 1:
            return None
        past = _past_of(standing)
        end = int(self._doubtful_rows[np.searchsorted(self._doubtful_rows, begin)])
        end = self._before_postponed(standing, begin, end)
        first, beyond = np.searchsorted(self._requests, (begin, end)).tolist()
        end = self._before_repeats(past, begin, end, first, beyond)
        if end == begin:
            return None
        beyond = int(np.searchsorted(self._requests, end))
        base = standing.next - 1 - int(self._opened[begin - 1])  # what turns places among the opened into ids
        attempts = self._attempts(first, beyond, base)
        transactions = self._transactions_of(begin, end, base, no, waiting, attempts)
        placements = self._placements(begin, end, base)
        self._move(tracker, standing, past, begin, end, base, no, attempts, (first, beyond))
        return Run(begin, end, placements, transactions)

    def _is_local(self, waiting: Exchange | None, begin: int, no: int) -> bool:
        """Whether the tracker waits for just what the row before says."""
        kind = int(self._class[begin - 1])
        if not _WAITS[kind]:
            return waiting is None
        if waiting is None or waiting.no != no - 1 or waiting.damaged or waiting.segmented:
            return False
        if kind == _REQUEST:
            return waiting.key is not None and not waiting.postponed and waiting.becomes is None
        return waiting.attempt == int(self._attempt[begin - 1])

    def _before_postponed(self, standing: Standing, begin: int, end: int) -> int:
        """Where postponed exchanges are asked for again, or over by time."""
        if not standing.postponed:
            return end
        over = min(
            exchange.last + (SEGMENTS_FOR if exchange.segmented else POSTPONED_FOR)
            for exchange in standing.postponed.values()
        )
        codes = [self._nets.code(key) for key in standing.postponed]
        stops = np.isin(self._key[begin:end], codes) & (self._class[begin:end] == _REQUEST)
        stops |= self.frames.start[begin:end] >= over
        found = np.flatnonzero(stops)
        return begin + int(found[0]) if len(found) else end

    def _before_repeats(self, past: PastExchanges, begin: int, end: int, first: int, beyond: int) -> int:
        """Where a request may repeat one from before the run that had no answer."""
        if self._class[begin - 1] == _REQUEST:
            again = first + np.flatnonzero(self._earlier[first:beyond] == first - 1)
            if len(again) and not self._answered[begin]:
                end = min(end, int(self._requests[again[0]]))
        if not past.failed:
            return end
        rows = self._requests[first:beyond]
        known = np.isin(self._key[rows], list(past.failed)) & (self._earlier[first:beyond] < first)
        asked: list[int] = rows[known].tolist()
        for row in asked:
            if row >= end:
                break
            if past.may_be_tried_again(int(self._key[row]), int(self.frames.start[row]), LATE_WITHIN):
                return row
        return end

    def _attempts(self, first: int, beyond: int, base: int) -> dict[int, tuple[int, int]]:
        """Row → (attempt, transaction that it repeats) of requests that were made before in the same run."""
        attempts: dict[int, tuple[int, int]] = {}
        begin, end = np.searchsorted(self._repeating, (first, beyond)).tolist()
        for place in self._repeating[begin:end].tolist():
            earlier = int(self._earlier[place])
            row, before = int(self._requests[place]), int(self._requests[earlier])
            if earlier >= first and self._body(row) == self._body(before):
                attempts[row] = attempts.get(before, (1, 0))[0] + 1, base + int(self._opened[before])
        return attempts

    def _body(self, row: int) -> bytes:
        return self._octets_of(row)[HEADER:]

    def _octets_of(self, row: int) -> bytes:
        begin = int(self.frames.offset[row])
        return self.octets[begin : begin + int(self.frames.length[row])].tobytes()

    def _transactions_of(
        self,
        begin: int,
        end: int,
        base: int,
        no: int,
        waiting: Exchange | None,
        attempts: dict[int, tuple[int, int]],
    ) -> TransactionColumns:
        first, beyond = np.searchsorted(self._closing, (begin, end)).tolist()
        rows = slice(first, beyond)
        closed = self._transactions.take(rows)
        to_number = no - begin
        closed = replace(
            closed,
            id=closed.id + base,
            of=np.where(closed.of == NONE, NONE, closed.of + base),
            request=closed.request + to_number,
            response=np.where(closed.response == NONE, NONE, closed.response + to_number),
            attempt=closed.attempt.copy(),
            verdict=closed.verdict.copy(),
        )
        if waiting is not None:
            attempts = {**attempts, begin - 1: (waiting.attempt, NONE if waiting.of is None else waiting.of)}
        if attempts:
            owners = self._owner[rows]
            for row, (attempt, of) in attempts.items():
                place = int(np.searchsorted(owners, row))
                if place == len(owners) or owners[place] != row:
                    continue  # still waits
                closed.attempt[place], closed.of[place] = attempt, of
                if attempt > 1 and self._class[row] == _REQUEST and closed.verdict[place] == _V[Verdict.ANSWERED]:
                    closed.verdict[place] = _V[Verdict.RETRY]
        return closed

    def _placements(self, begin: int, end: int, base: int) -> PlacementColumns:
        rows = slice(begin, end)
        answered = self._answered[rows]
        role = np.where(answered, _ROLE[Role.RESPONSE], self.frames.role[rows])
        return PlacementColumns(
            self._opened[rows] + base, role, self.frames.source[rows], self.frames.destination[rows]
        )

    # Where the tracker stands behind a run

    def _move(
        self,
        tracker: MstpTracker,
        standing: Standing,
        past: PastExchanges,
        begin: int,
        end: int,
        base: int,
        no: int,
        attempts: dict[int, tuple[int, int]],
        requests: tuple[int, int],
    ) -> None:
        last = end - 1
        to_number = no - begin
        waiting = standing.waiting
        self._remember(past, waiting, begin, end, base, to_number, attempts, requests)
        for key in standing.reassembler.open_keys:  # what a request or an Abort ends
            for row in np.flatnonzero(self._key[begin:end] == self._nets.code(key)).tolist():
                standing.reassembler.add(no + row, self._frame(begin + row))
        self._teach(standing.turn, begin, end)
        frame = self._frame(last)
        standing.waiting = None
        if _WAITS[self._class[last]]:
            standing.waiting = self._exchange(last, base, last + to_number, attempts)
        standing.previous = frame, base + int(self._opened[last])
        standing.next = base + int(self._opened[last]) + 1
        tracker.resume(standing)

    def _frame(self, row: int) -> Frame:
        frames = self.frames
        return Frame(
            "mstp",
            self._octets_of(row),
            int(frames.start[row]),
            int(frames.end[row]),
            CHECKS[frames.check[row]],
            FOUNDS[frames.found[row]],
            None,
            int(frames.expected[row]),
            0,
            self._timing.latency,
        )

    def _exchange(self, row: int, base: int, no: int, attempts: dict[int, tuple[int, int]]) -> Exchange:
        """What a row opened, as the tracker holds it."""
        frames = self.frames
        exchange = Exchange(
            base + int(self._opened[row]),
            no,
            frames.names[frames.kind[row]],
            int(frames.source[row]),
            int(frames.destination[row]),
            int(frames.start[row]),
            int(frames.end[row]),
            self._timing.latency,
            self._octets_of(row),
            last=int(frames.end[row]),
        )
        if self._class[row] == _REQUEST:
            exchange.key = self._nets.key(int(self._key[row]))
            if row in attempts:
                exchange.attempt, exchange.of = attempts[row]
        elif self._attempt[row] > 1:
            exchange.attempt, exchange.of = int(self._attempt[row]), exchange.id - 1
        return exchange

    def _remember(
        self,
        past: PastExchanges,
        waiting: Exchange | None,
        begin: int,
        end: int,
        base: int,
        to_number: int,
        attempts: dict[int, tuple[int, int]],
        requests: tuple[int, int],
    ) -> None:
        """What is over and has a key, for who comes late or asks again."""
        first, beyond = requests
        if waiting is not None and waiting.key is not None and self._class[begin - 1] == _REQUEST:
            past[waiting.key] = self._over(waiting, begin, begin + to_number)
            past.move_to_end(waiting.key)
        if beyond > first and self._requests[beyond - 1] == end - 1:
            beyond -= 1  # still waits
        if beyond == first:
            return

        def newest(seen: set[Key], most: int) -> Iterator[tuple[Key, Entry]]:
            met: set[int] = {self._nets.code(key) for key in seen}
            for row in self._requests[first:beyond][::-1].tolist():
                if most <= 0:
                    return
                code = int(self._key[row])
                if code not in met:
                    met.add(code)
                    most -= 1
                    exchange = self._exchange(row, base, row + to_number, attempts)
                    assert exchange.key is not None
                    yield exchange.key, self._over(exchange, row + 1, row + 1 + to_number)

        rows = self._requests[first:beyond]
        failed = self._key[rows[~self._answered[rows + 1]]]
        past.add_run(newest, beyond - first, failed.tolist())

    def _over(self, exchange: Exchange, closing: int, no: int) -> Entry:
        """An exchange as the row `closing` left it."""
        if not self._answered[closing]:
            return exchange, Verdict.NO_RESPONSE, exchange.last
        frames = self.frames
        gap = max(0, int(frames.start[closing]) - exchange.end)
        slack = self._timing.latency
        exchange.response, exchange.last = no, int(frames.end[closing])
        exchange.latency = Interval(gap, max(0, gap - slack), gap + exchange.slack)
        verdict = Verdict.RETRY if exchange.attempt > 1 else Verdict.ANSWERED
        return exchange, Verdict.EXCEPTION if frames.error[closing] else verdict, exchange.last

    def _teach(self, turn: Turn, begin: int, end: int) -> None:
        """Who spoke to whom in the run; the last four rows say whose turn it is."""
        rows = slice(begin, end)
        if end - begin > _FEW:
            heard = np.zeros(256, bool)
            heard[self._source[rows]] = True
            following = np.full(256, NONE, np.int64)
            passed = begin + np.flatnonzero((self._class[rows] == _TOKEN) | (self._class[rows] == _POLL_REPLY))
            token = self._class[passed] == _TOKEN
            sender, receiver = self._source[passed], self._destination[passed]
            following[np.where(token, sender, receiver)] = np.where(token, receiver, sender)
            frame = self._frame(end - 1)
            for station in np.flatnonzero(heard).tolist():
                turn.see(frame, FrameType.DATA_NOT_EXPECTING_REPLY, station, BROADCAST)
            for station in np.flatnonzero(following != NONE).tolist():
                turn.see(frame, FrameType.TOKEN, station, int(following[station]))
            begin = end - _FEW
        for row in range(begin, end):
            turn.see(
                self._frame(row), int(self.frames.function[row]), int(self._source[row]), int(self._destination[row])
            )


def prepare(tracker: MstpTracker) -> Nets:
    """Make a tracker ready to be moved over runs; the numbers that its keys have."""
    standing = tracker.standing()
    past = _past_of(standing)
    tracker.resume(standing)
    return past.nets


def _past_of(standing: Standing) -> PastExchanges:
    if not isinstance(standing.past, PastExchanges):
        standing.past = PastExchanges(standing.past)
    return standing.past
