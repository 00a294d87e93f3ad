"""Silences far longer than any wait of the master: the bus, or this tap, was off, and their borders prove nothing.

The request before such a silence may have been answered in it, and an answer behind it that has the shape of a request
may have had its request in it. A master that waits so long for one station does so more than once, and as long each
time: those after the first are its timeouts.
"""

from __future__ import annotations

from collections import deque

from dissectors.line import NS_PER_S
from dissectors.modbus.learned_timing import LearnedTiming

SILENCE_LEAST = 3 * NS_PER_S
_TIMES_A_PAUSE = 30
_TIMES_A_WAIT = 2
_PAUSES_LEAST = 4
_KEPT = 8


class LongSilences:
    """Which requests stand directly before one, and how long those were. Times are ns."""

    def __init__(self, learnt: LearnedTiming) -> None:
        self._learnt = learnt
        self._before: deque[int] = deque(maxlen=_KEPT)  # rows of such requests
        self._waits: deque[int] = deque(maxlen=_KEPT)

    def is_one(self, gap: int) -> bool:
        """Whether a silence of SILENCE_LEAST or more, up to the row that comes now, is out of the usual."""
        pauses, learnt = self._learnt.pauses, self._learnt
        if len(pauses) < _PAUSES_LEAST or gap < _TIMES_A_PAUSE * max(pauses):
            return False
        return gap >= _TIMES_A_WAIT * max(learnt.slowest, learnt.timeout or 0)

    def note(self, no: int, gap: int) -> bool:
        """Such a silence follows the request of row `no`, to which nothing was heard before it; whether that proves
        nothing."""
        if not self.is_one(gap):
            return False
        is_timeout = any(10 * abs(gap - wait) <= wait for wait in self._waits)
        self._waits.append(gap)
        if not is_timeout:
            self._before.append(no)
        return not is_timeout

    def may_have_been_answered(self, no: int) -> bool:
        """Whether the request of that row stands before one that proves nothing."""
        return no in self._before
