"""How much of what is derived from a bus goes back into its recording, so that results never outgrow the octets. Pure.

Everything, as long as there is little: a budget that fills up while little is said. When it is half used up, each
channel gets its turn at intervals that keep all of them together within the budget. What is left out is not lost: it is
computed from the octets whenever somebody asks.
"""

from __future__ import annotations

from dissectors.line import NS_PER_S


class Budget:
    """`rate`: messages a second in the long run. `burst`: that may come at once after a quiet time."""

    def __init__(self, rate: float, burst: int) -> None:
        self._rate = rate
        self._burst = float(burst)
        self._left = float(burst)
        self._at: int | None = None
        self._last: dict[str, int] = {}

    def take(self, channel: str, now: int) -> bool:
        """Whether a message of a channel is to be written at `now` (ns)."""
        passed = 0 if self._at is None else max(0, now - self._at)
        self._at = now if self._at is None else max(self._at, now)
        self._left = min(self._burst, self._left + passed / NS_PER_S * self._rate)
        last = self._last.get(channel)
        if last is not None and self._left < self._burst / 2:
            turn = len(self._last) / self._rate * NS_PER_S
            if 0 <= now - last < turn:
                return False
        if self._left < 1:
            return False
        self._left -= 1
        self._last[channel] = now
        return True
