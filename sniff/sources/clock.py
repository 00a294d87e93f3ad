"""The capture's clock: monotonic progress, through a sleep of the machine too, from one anchor to wall time."""

from __future__ import annotations

import time
from dataclasses import dataclass

from dissectors.line import MS

STEP = 1 * MS
"""Wall and capture clock further apart than this (ns) is worth a CLOCK event."""

_TRIES = 50
_CLOSE = 20_000
"""Two readings of the monotonic clock so far apart (ns) have nothing between them but the reading of the other."""

_BOOT: int | None = getattr(time, "CLOCK_BOOTTIME", None)
"""Linux's clock that goes on while the machine sleeps. Its plain monotonic clock stands still meanwhile: what came
after an hour of sleep would stand right behind what came before, with an hour too little on all that follows."""


def _monotonic() -> int:
    return time.monotonic_ns() if _BOOT is None else time.clock_gettime_ns(_BOOT)


def _together() -> tuple[int, int]:
    """Wall and monotonic time of one instant, ns: the first pair read close together, else the closest of some."""
    best = (0, 0)
    narrowest: int | None = None
    for _ in range(_TRIES):
        before = _monotonic()
        wall = time.time_ns()
        after = _monotonic()
        if narrowest is None or after - before < narrowest:
            narrowest = after - before
            best = (wall, before + (after - before) // 2)
        if narrowest <= _CLOSE:
            break
    return best


@dataclass(frozen=True, slots=True)
class Clock:
    """Nanoseconds since the Unix epoch at the anchor, carried on by the monotonic clock: it never steps.

    `wall`, `monotonic`: ns, the two clocks at the anchor. The monotonic clock is the machine's, so that processes
    that share an anchor share the clock.
    """

    wall: int
    monotonic: int

    @classmethod
    def start(cls) -> Clock:
        """Anchor the clock now."""
        return cls(*_together())

    def now(self) -> int:
        """The time, ns."""
        return self.wall - self.monotonic + _monotonic()

    def at(self, monotonic: int) -> int:
        """The time of a reading of the monotonic clock, ns."""
        return self.wall - self.monotonic + monotonic

    def drift(self) -> int:
        """By how much the wall clock is ahead of this clock now, ns."""
        wall, monotonic = _together()
        return wall - self.at(monotonic)
