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

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dissectors.bacnet.data_exchanges import LATE_WITHIN
from dissectors.bacnet.exchange import Exchange
from dissectors.bacnet.frame_types import HEADER
from dissectors.bacnet.open_exchanges import POSTPONED_FOR, REMEMBERED, SEGMENTS_FOR
from dissectors.bacnet.past_exchanges import Entry, Nets, PastExchanges
from dissectors.bacnet.placed_rows import CODE, POLL_REPLY, REQUEST, TOKEN, WAITS, PlacedRows
from dissectors.bacnet.tracker import MstpTracker
from dissectors.bacnet.turn_columns import TaughtTurns
from dissectors.columns import NONE, ROLES, FrameColumns, PlacementColumns, TransactionColumns
from dissectors.frame import Frame, Role
from dissectors.tracker import Interval, Verdict

if TYPE_CHECKING:
    from collections.abc import Sized

    from dissectors.bacnet.tracker import Standing
    from dissectors.columns import Octets, Times
    from dissectors.line import Timing

_RESPONSE = np.uint8(ROLES.index(Role.RESPONSE))


class Run(NamedTuple):
    """What was decided: rows [begin, end), where they belong, and the transactions that they closed, in order."""

    begin: int
    end: int
    placements: PlacementColumns
    transactions: TransactionColumns


@dataclass(slots=True)
class _Stretch:
    """Rows [begin, end) that are being decided.

    `base`: what turns places among the opened into ids. `to_number`: what turns rows into numbers. `first`, `beyond`:
    places of their requests. `waiting`: what the row before left open. `attempts`: row → attempt and the transaction
    that it repeats, of requests that were made before in the stretch.
    """

    begin: int
    end: int
    base: int
    to_number: int
    first: int
    beyond: int
    waiting: Exchange | None
    attempts: dict[int, tuple[int, int]]


class Pairing:
    """Frames of a block, paired by columns wherever a tracker need not see them.

    `octets`: where `frames.offset` counts. `nets`: of the tracker that will be moved (`prepare`). `slack`: ns, of each
    frame, where reads came late; the adapter's latency where it is left out.
    """

    def __init__(
        self, frames: FrameColumns, octets: Octets, timing: Timing, nets: Nets, slack: Times | None = None
    ) -> None:
        if slack is None:
            slack = np.full(len(frames), timing.latency, np.int64)
        self.frames, self.octets, self._slack, self._nets = frames, octets, slack, nets
        self.rows = PlacedRows(frames, octets, timing, nets, slack)
        kinds, parties = self.rows.kinds, (self.rows.source, self.rows.destination)
        self._turns = TaughtTurns(kinds == TOKEN, kinds == POLL_REPLY, *parties, frames.function)

    def run(self, tracker: MstpTracker, begin: int, no: int) -> Run | None:
        """Decide rows from `begin` on, which has the number `no`, and move the tracker behind them.

        The tracker has just taken the row before, which had the number before. None where `begin` is doubtful: then it
        must take that row too.
        """
        rows = self.rows
        if not rows.sure[begin]:
            return None
        standing = tracker.standing()
        if not self._is_local(standing.waiting, begin, no):
            return None
        past = _past_of(standing)
        end = int(rows.doubtful_rows[rows.doubtful_rows.searchsorted(begin)])
        end = self._before_postponed(standing, begin, end)
        first, beyond = rows.requests.searchsorted((begin, end)).tolist()
        end = self._before_repeats(past, begin, end, first, beyond)
        if end == begin:
            return None
        base = standing.next - 1 - int(rows.opened[begin - 1])
        beyond = int(rows.requests.searchsorted(end))
        attempts = self._attempts(first, beyond, base)
        stretch = _Stretch(begin, end, base, no - begin, first, beyond, standing.waiting, attempts)
        run = Run(begin, end, self._placements(stretch), self._transactions(stretch))
        self._move(standing, past, stretch)
        tracker.resume(standing)
        return run

    # How far it is certain

    def _is_local(self, waiting: Exchange | None, begin: int, no: int) -> bool:
        """Whether the tracker waits for just what the row before says."""
        kind = int(self.rows.kinds[begin - 1])
        if not WAITS[kind]:
            return waiting is None
        if waiting is None or waiting.no != no - 1:
            return False
        return kind == REQUEST or waiting.attempt == int(self.rows.attempt[begin - 1])

    def _before_postponed(self, standing: Standing, begin: int, end: int) -> int:
        """Where postponed exchanges are asked for again, or over by time."""
        if not standing.postponed:
            return end
        over = min(
            exchange.last + (SEGMENTS_FOR if exchange.segmented else POSTPONED_FOR)
            for exchange in standing.postponed.values()
        )
        codes = [self._nets.code(key) for key in standing.postponed]
        stops = np.isin(self.rows.keys[begin:end], codes) & (self.rows.kinds[begin:end] == REQUEST)
        stops |= self.frames.start[begin:end] >= over
        found = np.flatnonzero(stops)
        return begin + int(found[0]) if len(found) else end

    def _before_repeats(self, past: PastExchanges, begin: int, end: int, first: int, beyond: int) -> int:
        """Where a request may repeat one from before the stretch that had no answer."""
        rows = self.rows
        if rows.kinds[begin - 1] == REQUEST and not rows.answered[begin]:
            again = np.flatnonzero(rows.earlier[first:beyond] == first - 1)
            if len(again):
                end = int(rows.requests[first + again[0]])
        asked = rows.requests[first + np.flatnonzero(rows.earlier[first:beyond] < first)]
        codes = rows.keys[asked].tolist()
        for place in past.known(codes):
            row = asked[place]
            if row >= end:
                break
            failed_at = past.failed_at(codes[place])
            if failed_at is not None and int(self.frames.start[row]) - failed_at < LATE_WITHIN:
                return int(row)
        return end

    def _attempts(self, first: int, beyond: int, base: int) -> dict[int, tuple[int, int]]:
        """Requests that repeat one of the same stretch."""
        attempts: dict[int, tuple[int, int]] = {}
        rows = self.rows
        begin, end = rows.repeating.searchsorted((first, beyond)).tolist()
        for place in rows.repeating[begin:end].tolist():
            earlier = int(rows.earlier[place])
            row, before = int(rows.requests[place]), int(rows.requests[earlier])
            if earlier >= first and self._octets_of(row)[HEADER:] == self._octets_of(before)[HEADER:]:
                attempts[row] = attempts.get(before, (1, 0))[0] + 1, base + int(rows.opened[before])
        return attempts

    # What was decided

    def _placements(self, stretch: _Stretch) -> PlacementColumns:
        rows = slice(stretch.begin, stretch.end)
        role = np.where(self.rows.answered[rows], _RESPONSE, self.frames.role[rows])
        tx = self.rows.opened[rows] + stretch.base
        return PlacementColumns(tx, role, self.frames.source[rows], self.frames.destination[rows])

    def _transactions(self, stretch: _Stretch) -> TransactionColumns:
        first, beyond = self.rows.closing.searchsorted((stretch.begin, stretch.end)).tolist()
        closed, told = slice(first, beyond), self.rows.transactions
        response, of = told.response[closed], told.of[closed]
        transactions = TransactionColumns(
            id=told.id[closed] + stretch.base,
            station=told.station[closed],
            kind=told.kind[closed],
            request=told.request[closed] + stretch.to_number,
            response=np.where(response == NONE, NONE, response + stretch.to_number),
            verdict=told.verdict[closed].copy(),
            start=told.start[closed],
            end=told.end[closed],
            latency=told.latency[closed],
            least=told.least[closed],
            most=told.most[closed],
            attempt=told.attempt[closed].copy(),
            of=np.where(of == NONE, NONE, of + stretch.base),
            error=told.error[closed],
            names=told.names,
        )
        self._say_attempts(transactions, self.rows.owner[closed], stretch)
        return transactions

    def _say_attempts(self, transactions: TransactionColumns, owners: Times, stretch: _Stretch) -> None:
        attempts, waiting = stretch.attempts, stretch.waiting
        if waiting is not None:
            attempts = {**attempts, stretch.begin - 1: (waiting.attempt, NONE if waiting.of is None else waiting.of)}
        for row, (attempt, of) in attempts.items():
            place = int(owners.searchsorted(row))
            if place == len(owners) or owners[place] != row:
                continue  # still waits
            transactions.attempt[place], transactions.of[place] = attempt, of
            answered = transactions.verdict[place] == CODE[Verdict.ANSWERED]
            if answered and attempt > 1 and self.rows.kinds[row] == REQUEST:
                transactions.verdict[place] = CODE[Verdict.RETRY]

    # Where the tracker stands behind it

    def _move(self, standing: Standing, past: PastExchanges, stretch: _Stretch) -> None:
        rows, last = self.rows, stretch.end - 1
        self._remember(past, stretch)
        for key in standing.reassembler.open_keys:  # what a request or an Abort ends
            of_key = np.flatnonzero(rows.keys[stretch.begin : stretch.end] == self._nets.code(key))
            for row in (stretch.begin + of_key).tolist():
                standing.reassembler.add(row + stretch.to_number, self._frame(row))
        frame = self._frame(last)
        self._turns.teach(standing.turn, stretch.begin, stretch.end, frame)
        standing.waiting = self.exchange(last, stretch) if WAITS[rows.kinds[last]] else None
        tx = stretch.base + int(rows.opened[last])
        standing.previous, standing.next = (frame, tx), tx + 1

    def _remember(self, past: PastExchanges, stretch: _Stretch) -> None:
        """What is over and has a key, for who comes late or asks again."""
        rows, waiting = self.rows, stretch.waiting
        if waiting is not None and waiting.key is not None:
            past[waiting.key] = self.over(waiting, stretch.begin, stretch)
            past.move_to_end(waiting.key)
        requests = rows.requests[stretch.first : stretch.beyond]
        if len(requests) and requests[-1] == stretch.end - 1:
            requests = requests[:-1]  # still waits
        if len(requests) > 4 * REMEMBERED:
            _, newest = np.unique(rows.keys[requests][::-1], return_index=True)
            requests = requests[::-1][np.sort(newest)[:REMEMBERED]][::-1]
        past.add(_PairedRows(self, stretch), rows.keys[requests].tolist(), requests.tolist(), REMEMBERED)

    # Rows as the values they stand for

    def _octets_of(self, row: int) -> bytes:
        begin = int(self.frames.offset[row])
        return self.octets[begin : begin + int(self.frames.length[row])].tobytes()

    def _frame(self, row: int) -> Frame:
        return self.frames.frame(row, self.octets, "mstp", int(self._slack[row]))

    def exchange(self, row: int, stretch: _Stretch) -> Exchange:
        """What a row of a stretch opened, as the tracker holds it."""
        frames, rows = self.frames, self.rows
        end = int(frames.end[row])
        exchange = Exchange(
            stretch.base + int(rows.opened[row]),
            row + stretch.to_number,
            frames.names[frames.kind[row]],
            int(frames.source[row]),
            int(frames.destination[row]),
            int(frames.start[row]),
            end,
            int(self._slack[row]),
            self._octets_of(row),
            last=end,
        )
        if rows.kinds[row] == REQUEST:
            exchange.key = self._nets.key(int(rows.keys[row]))
            if row in stretch.attempts:
                exchange.attempt, exchange.of = stretch.attempts[row]
        elif rows.attempt[row] > 1:
            exchange.attempt, exchange.of = int(rows.attempt[row]), exchange.id - 1
        return exchange

    def over(self, exchange: Exchange, closing: int, stretch: _Stretch) -> Entry:
        """An exchange as the row `closing` left it."""
        if not self.rows.answered[closing]:
            return exchange, Verdict.NO_RESPONSE, exchange.last
        frames = self.frames
        gap = max(0, int(frames.start[closing]) - exchange.end)
        slack = int(self._slack[closing])
        exchange.response, exchange.last = closing + stretch.to_number, int(frames.end[closing])
        exchange.latency = Interval(gap, max(0, gap - slack), gap + exchange.slack)
        verdict = Verdict.RETRY if exchange.attempt > 1 else Verdict.ANSWERED
        return exchange, Verdict.EXCEPTION if frames.error[closing] else verdict, exchange.last

    def had_no_answer(self, row: int) -> bool:
        """Whether the row behind a request, of the same stretch, does not answer it."""
        return not self.rows.answered[row + 1]


class _PairedRows:
    """Exchanges of a stretch that are over, made when somebody asks; keeps the columns of its block alive."""

    __slots__ = ("_pairing", "_stretch", "block")

    def __init__(self, pairing: Pairing, stretch: _Stretch) -> None:
        self._pairing, self._stretch = pairing, stretch
        self.block: Sized = pairing.frames

    def entry(self, row: int) -> Entry:
        """The exchange that a row opened, how it ended and when."""
        return self._pairing.over(self._pairing.exchange(row, self._stretch), row + 1, self._stretch)

    def failed_at(self, row: int) -> int | None:
        """When the exchange that a row opened was over without an answer; None where it had one."""
        return int(self._pairing.frames.end[row]) if self._pairing.had_no_answer(row) else None


def prepare(tracker: MstpTracker) -> Nets:
    """Make a tracker ready to be moved over the runs of a block; the numbers that its keys have."""
    standing = tracker.standing()
    past = _past_of(standing)
    past.settle()
    tracker.resume(standing)
    return past.nets


def _past_of(standing: Standing) -> PastExchanges:
    if not isinstance(standing.past, PastExchanges):
        standing.past = PastExchanges(standing.past)
    return standing.past
