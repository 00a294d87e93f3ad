"""The memory of a Modbus tracker: what it holds between two frames, what they teach, and what goes by without it.

Regular exchanges are paired by columns (`block_pairing.py`); the tracker is put behind them as if it had seen them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from dissectors.frame import Role
from dissectors.line import Timing
from dissectors.modbus.echoes import MOST_VOTES, Echoes
from dissectors.modbus.exchange import Exchange, Seen
from dissectors.modbus.exchanges import Exchanges
from dissectors.modbus.functions import BROADCAST
from dissectors.modbus.learned_timing import WRITE, LearnedTiming
from dissectors.modbus.odd_answers import OddAnswers
from dissectors.modbus.pairing import is_listen_only, is_restart
from dissectors.modbus.promptness import Promptness

if TYPE_CHECKING:
    from dissectors.modbus.exchange_memory import Known, Passed


@dataclass(frozen=True, slots=True)
class PassedBy:
    """Exchanges that went by the tracker. `first`: the request of the first. `newest`: the last that were answered, and
    the last of all; `given_up`: the last that were not. `heard`: of each unit that answered, the last transaction that
    it did. `count`: of all. `end`: ns, of the last frame. `units`: that were asked.
    """

    first: Seen
    newest: list[Exchange]
    given_up: list[Exchange]
    heard: dict[int, int]
    count: int
    end: int
    units: set[int]


QUICK = 4_000_000
"""ns. Stations that count the octets of a request do not wait for 3.5 characters of silence, which are long at low
rates: many answer after a time that is always the same. What gives octets back is one character behind at most."""


class TrackerMemory:
    """What a tracker knows.

    `silence`: ns, the shortest time after which a station may begin an answer; 3.5 characters where not given (RTU).
    `learnt`: what the traffic so far told of response times, timeout and pauses.
    """

    def __init__(self, timing: Timing, silence: int | None = None) -> None:
        self.learnt = LearnedTiming(timing)
        self._timing = timing
        self._silence = 7 * timing.char // 2 if silence is None else silence
        self._soonest = min(self._silence, max(timing.char, QUICK))
        self._times = Promptness(self.learnt, self._silence, timing.latency, self._soonest)
        self._echoes = Echoes(timing, self._soonest, self.learnt)
        self._held = Exchanges(self.learnt, self._echoes)
        self._odd = OddAnswers(self._times, self._held)
        self._last_end: int | None = None  # of the newest frame
        self._last_was_answer = False
        self._units: set[int] = set()  # named in good frames
        self._mute: set[int] = set()  # units in listen-only mode

    @property
    def timeout(self) -> int | None:
        """How long the master waits for an answer, ns; None while unlearnt."""
        return self.learnt.timeout

    def _learn_from_next(self, seen: Seen, sure: bool) -> None:
        """A request after all that came before it: how long the master waited, paused, and whether a copy answered."""
        before, last = self._held.open, self._held.last
        if before is not None:
            undisturbed = not (before.disturbed or before.fault or before.garble or before.silent)
            if sure and before.sure and undisturbed:
                self.learnt.unanswered(before.gap(seen.frame.start), before.octets == seen.octets)
        elif last is not None:
            if last.copied is not None and last.octets != seen.octets:
                self.learnt.answered(last.unit, last.pace, last.copied)
            last.copied = None
            asks = sure or seen.unit != last.unit
            if asks and last.answered and self._last_was_answer and self._last_end is not None:
                cycle = seen.frame.start - last.request.frame.start
                self.learnt.paused(max(0, seen.frame.start - self._last_end), cycle)

    def _learn_from_answer(self, request: Exchange, seen: Seen, why: str | None) -> None:
        gap = request.gap(seen.frame.start)
        if request.octets == seen.octets:
            request.copied = gap
        elif request.sure and seen.header.role is Role.RESPONSE and not (why or request.fault):
            self.learnt.answered(request.unit, request.pace, gap)
            self._echoes.learn(request.unit, request.echoed)

    def _note_mode(self, request: Exchange) -> None:
        """Listen-only mode begins with its command and ends with a restart, or when the unit speaks again."""
        if is_restart(request.octets):
            if request.unit == BROADCAST:
                self._mute.clear()
            self._mute.discard(request.unit)
        elif is_listen_only(request.octets):
            self._mute.add(request.unit)
        elif request.unit in self._mute:
            request.remark = f"unit {request.unit} was put into listen-only mode"

    # ---- exchanges that go by without it

    def known(self, start: int) -> Known | None:
        """What it has learnt that a regular exchange depends on whose request begins at `start`; None: it waits."""
        from dissectors.modbus.exchange_memory import Known

        held = self._held
        if not held.is_at_rest:
            return None
        writes, slowest, last = self.learnt.write_times(), self.learnt.slowest, held.last
        if last is not None and last.copied is not None and last.pace == WRITE:  # it teaches with the next request
            writes[last.unit] = (*writes.get(last.unit, ()), last.copied)
            slowest = max(slowest, last.copied)
        pauses = self.learnt.pauses if self._last_end is None else (*self.learnt.pauses, start - self._last_end)
        return Known(self.timeout, self._echoes.usual, writes, self.learnt.waits, slowest, max(pauses, default=0))

    @property
    def next_tx(self) -> int:
        """The number that the next transaction will have."""
        return self._held.next_tx

    def pass_by(self, went: Passed, by: PassedBy) -> None:
        """Go on as if it had tracked exchanges that went by."""
        first = by.first
        self._learn_from_next(first, first.header.ok and first.header.role is not Role.EITHER)
        for (unit, pace), times in went.times.items():
            self.learnt.answered_often(unit, pace, times)
        self.learnt.paused_often(went.pauses)
        self.learnt.waited(went.unanswered)
        for unit, count in went.sure.items():
            for _ in range(min(count, MOST_VOTES)):
                self._echoes.learn(unit, False)
        self._held.pass_by(by.newest, by.given_up, by.heard, by.count)
        self._last_end, self._last_was_answer = by.end, by.newest[-1].answered
        self._mute -= went.units
        self._units |= by.units
