"""The timing of a bus, learnt while it is heard: response times, the master's timeout, the master's pauses.

Only traffic whose direction the octets decide teaches. Each quantity keeps its last samples, so memory is bounded and
a bus that changes is learnt anew. All times are int ns, as they were measured (nominal).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from itertools import pairwise

from dissectors.line import Timing

_SAMPLES = 16
READ, WRITE = 0, 1
"""Paces of a station: what it only reads, and what it has to store. Others are the functions that nobody knows."""

_PACES_KEPT = 1024
_ANSWER_CHARS = 32  # of an answer as long as most
_USUAL_PAUSES = 3
_MARGIN = 2_000_000  # of a host clock: no limit is finer than 2 ms
UNLEARNT_LIMIT = 100_000_000
"""A copy of a request within 100 ms is its answer while nothing is learnt: hardly a master gives up so soon. Later
than that it may be the answer of a slow station as well as the request again."""


class LearnedTiming:
    """Response times by unit, the master's timeout, its pauses between an answer and the next request."""

    __slots__ = (
        "_answer",
        "_cycles",
        "_latency",
        "_margin",
        "_pauses",
        "_timeout",
        "_times",
        "_tolerance",
        "_unanswered",
    )

    def __init__(self, timing: Timing) -> None:
        self._latency = timing.latency
        self._margin = _MARGIN + timing.latency
        self._answer = _ANSWER_CHARS * timing.char
        self._tolerance = _MARGIN + timing.latency + 4 * timing.char
        self._times: dict[tuple[int, int], deque[int]] = {}  # by unit and pace
        self._unanswered: deque[int] = deque(maxlen=_SAMPLES)
        self._pauses: deque[int] = deque(maxlen=2 * _SAMPLES)
        self._cycles: deque[int] = deque(maxlen=2 * _SAMPLES)
        self._timeout: int | None = None

    def answered(self, unit: int, pace: int, latency: int) -> None:
        """A sure request was answered after `latency`. `pace`: READ, WRITE, or what else takes its own time."""
        key = unit, pace
        if key in self._times or len(self._times) < _PACES_KEPT:
            self._times.setdefault(key, deque(maxlen=_SAMPLES)).append(latency)
        if self._timeout is not None and latency > self._timeout:  # the master was still waiting
            self._unanswered = deque((gap for gap in self._unanswered if gap > latency), maxlen=_SAMPLES)
            self._timeout = self._agreed()

    def answered_often(self, unit: int, pace: int, latencies: Sequence[int]) -> None:
        """The same for one answer after the other."""
        if self._timeout is not None and max(latencies, default=0) > self._timeout:
            for latency in latencies:
                self.answered(unit, pace, latency)
        elif latencies and ((unit, pace) in self._times or len(self._times) < _PACES_KEPT):
            self._times.setdefault((unit, pace), deque(maxlen=_SAMPLES)).extend(latencies)

    def unanswered(self, elapsed: int, repeated: bool = False) -> None:
        """A sure request got nothing for `elapsed`; then a master sent another, or the same one again (`repeated`).

        Not a timeout when answers have been waited for longer: then a second master broke in, or the answer was missed.
        Nor when it is no longer than an answer and the pause after it may take: then the answer was missed, too. What
        is shorter than octets may be held back, or has no times at all, is no wait that was measured.
        """
        if elapsed < self._latency:
            return
        if repeated or not self._pauses:
            enough: int | None = self._slowest()
        else:
            pause = self._pause_within(elapsed, self._pauses)
            enough = None if pause is None else self._slowest() + self._answer + pause * 11 // 10
        if enough is None or elapsed <= enough:
            return
        self._unanswered.append(elapsed)
        self._timeout = self._agreed()

    def paused(self, gap: int, cycle: int) -> None:
        """The master sent a sure request `gap` after the answer before it, `cycle` after the request before it."""
        self._pauses.append(gap)
        self._cycles.append(cycle)

    def paused_often(self, pauses: Sequence[tuple[int, int]]) -> None:
        """The same for one pause after the other, each with its cycle."""
        self._pauses.extend([pause for pause, _ in pauses])
        self._cycles.extend([cycle for _, cycle in pauses])

    def pauses_after_answers(self, gap: int, pause: int, cycle: int) -> bool:
        """Whether a master leaves `pause` after an answer, and would leave more if it had waited `gap` in vain.

        False while too little is known, and of a master that sends by the clock (`cycle` from request to request).
        """
        if self._sends_by_the_clock(cycle):
            return False
        return self._is_pause(pause) and pause + self._margin < gap + min(self._pauses) * 9 // 10

    def pauses_after_timeouts(self, gap: int, pause: int, cycle: int) -> bool:
        """Whether `pause` is what a master leaves that waited `gap` in vain once more, and no pause after an answer."""
        if len(self._pauses) < 4 or self._sends_by_the_clock(cycle) or self._is_pause(pause):
            return False
        if 2 * max(self._pauses) > 3 * min(self._pauses) + 2 * self._margin:
            return False  # it pauses as it likes
        return abs(pause - gap) <= self._margin or (pause >= gap and self._is_pause(pause - gap))

    def turn(self, unit: int, answer: int, gap: int) -> tuple[int, int] | None:
        """From the end of a request to the next, where an answer of `answer` ns comes: at least, and at most as a rule.

        None while unlearnt. A unit that takes longer than most is held to what most take: a wait for it may be in vain.
        `gap`: what is compared with it; where the master pauses long between rounds and shortly within them, it is held
        to those pauses that it may contain.
        """
        if len(self._pauses) < _USUAL_PAUSES or not self._times:
            return None
        usual = {key: sorted(times)[len(times) // 2] for key, times in self._times.items()}
        everybody = sorted(usual.values())[(len(usual) - 1) // 2]
        response = min(usual.get((unit, READ), everybody), everybody)
        usual_pauses = sorted(self._pauses)[: 3 * len(self._pauses) // 4 + 1]
        pause = self._pause_within(gap, usual_pauses) or usual_pauses[0]
        return response // 2 + answer, (response + pause) * 5 // 4 + answer + self._margin

    def _pause_within(self, gap: int, pauses: Iterable[int]) -> int | None:
        """The longest of some pauses that fits into a gap; None where all are longer."""
        return max((pause for pause in pauses if pause - pause // 10 <= gap + self._margin), default=None)

    def _sends_by_the_clock(self, cycle: int) -> bool:
        return len(self._pauses) < 2 or any(self.is_same(cycle, one) for one in self._cycles)

    def _is_pause(self, pause: int) -> bool:
        least, most = min(self._pauses), max(self._pauses)
        return least - least // 10 <= pause + self._margin and pause <= most + most // 10 + self._margin

    @property
    def timeout(self) -> int | None:
        """How long the master waits for an answer; None until two unanswered requests agree on it within 10 %.

        One gap alone may be an answer that this tap missed. A master that pauses before it goes on makes it longer,
        never shorter.
        """
        return self._timeout

    @property
    def tolerance(self) -> int:
        """ns by which two readings of one and the same time may differ."""
        return self._tolerance

    @property
    def margin(self) -> int:
        """ns that adapter and computer may add to a time, or take off."""
        return self._margin

    def knows(self, unit: int) -> bool:
        """Whether the unit has answered anything whose direction is sure."""
        return any(one == unit for one, _ in self._times)

    def may_hide_a_wait(self, gap: int) -> bool:
        """Whether the master may have waited in vain within a gap: before a pause between rounds, nothing tells."""
        return self._timeout is not None and gap >= self._timeout

    def is_timeout(self, gap: int) -> bool:
        """Whether that long is how long the master waits before it repeats."""
        timeout = self._timeout
        return timeout is not None and self.is_same(gap, timeout)

    def is_same(self, one: int, other: int) -> bool:
        """Whether two durations are one and the same of the master's, as far as can be told: within 10 %."""
        return abs(one - other) <= max(one, other) // 10 + self._tolerance

    def fastest(self, unit: int) -> int | None:
        """Shortest response time of a unit, of any unit where it has none; None while unlearnt."""
        samples = self._times.get((unit, READ)) or self._times.get((unit, WRITE))
        if samples:
            return min(samples)
        return min((min(each) for (_, pace), each in self._times.items() if pace == READ), default=None)

    def response_times(self) -> dict[int, tuple[int, int]]:
        """Shortest and longest of the last response times, by unit."""
        both: dict[int, list[int]] = {}
        for (unit, _), samples in sorted(self._times.items()):
            both.setdefault(unit, []).extend(samples)
        return {unit: (min(samples), max(samples)) for unit, samples in both.items()}

    def response_limit(self, unit: int, pace: int) -> int | None:
        """Until when a frame may be the unit's answer rather than the master's next word; None while unlearnt.

        Each pace has a limit of its own: storing a parameter takes longer than reading one.
        """
        samples = self._times.get((unit, pace), ())
        if len(samples) < 2:
            return None
        ordered = sorted(samples)
        slowest = ordered[-2] if len(ordered) > 3 else ordered[-1]  # one outlier does not widen the window
        limit = slowest + slowest // 2 + self._tolerance
        return limit if self._timeout is None else min(limit, self._patience(unit))

    def in_time(self, unit: int, pace: int, gap: int) -> bool:
        """Whether a frame `gap` after a request may be its answer; where nothing is learnt, a fixed limit decides."""
        limit = self.response_limit(unit, pace)
        if limit is None and self._timeout is not None:
            limit = self._patience(unit)
        if limit is None:  # a write takes no less than a read
            limit = max(UNLEARNT_LIMIT, self.response_limit(unit, READ) or 0)
        return gap <= limit

    def too_soon(self, silence: int) -> int:
        """The gap below which a frame after an answer is not the master's next request; `silence` while unlearnt."""
        return max(silence, min(self._pauses) // 2) if len(self._pauses) >= 4 else silence

    # ---- for who lets exchanges go by the tracker (exchange_memory.py)

    @property
    def waits(self) -> tuple[int, ...]:
        """How long the master waited for the last unanswered requests, ns."""
        return tuple(self._unanswered)

    @property
    def pauses(self) -> tuple[int, ...]:
        """The master's newest pauses, ns."""
        return tuple(self._pauses)

    @property
    def slowest(self) -> int:
        """The longest of all response times kept, ns."""
        return self._slowest()

    def write_times(self) -> dict[int, tuple[int, ...]]:
        """The newest response times of what stations have to store, ns, by unit."""
        return {unit: tuple(times) for (unit, pace), times in self._times.items() if pace == WRITE}

    def waited(self, waits: Sequence[int]) -> None:
        """Unanswered requests of which it is certain already that the master waited its time."""
        if waits:
            self._unanswered.extend(waits)
            self._timeout = self._agreed()

    def _slowest(self) -> int:
        return max((max(each) for each in self._times.values()), default=0)

    def _patience(self, unit: int) -> int:
        """Until when something is an answer rather than the repeat after the timeout: 4/5 of that, or half way between
        it and the slowest answer of a unit that takes longer."""
        timeout = self._timeout or 0
        slowest = max((max(each) for (one, _), each in self._times.items() if one == unit), default=0)
        return max(timeout * 4 // 5, min(timeout, (slowest + timeout) // 2))

    def _agreed(self) -> int | None:
        ordered = sorted(self._unanswered)
        return next((a for a, b in pairwise(ordered) if b <= a + a // 10 + _MARGIN), None)
