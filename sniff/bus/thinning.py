"""Thinning: how much of what is derived goes back into a recording, so that results never outgrow the octets. Pure.

Everything, as long as there is little: a budget that fills up while little is said. When it is half used up, each
channel gets its turn at intervals that keep all of them together within the budget. What is left out is not lost: it is
computed from the octets whenever somebody asks.
"""

from __future__ import annotations

from collections.abc import Iterable

from dissectors.line import NS_PER_S

A_SECOND = 800.0
"""Octets of a recording, a second, up to which values fill what the bus leaves: with the rest some 75 MB a day."""

_ALWAYS, _A_READ, _AN_OCTET, _A_VALUE = 240.0, 5.0, 0.6, 36.0
"""What a recording takes for a second, a read, an octet of the bus and a value: measured (`tests/bench`)."""


class Room:
    """How many values a second a recording has room for beside the octets of its bus, by what the bus says now."""

    LEAST, MOST = 1.0, 20.0

    def __init__(self) -> None:
        self._reads = self._octets = 0
        self._begin: int | None = None
        self._size = A_SECOND

    def add(self, octets: int, reads: int = 1) -> None:
        """Reads came, with so many octets."""
        self._reads += reads
        self._octets += octets

    def rate(self, now: int) -> float:
        """Values a second from now on (ns)."""
        seconds = 0.0 if self._begin is None else (now - self._begin) / NS_PER_S
        if self._begin is None or seconds >= 1:
            if seconds >= 1:
                size = _ALWAYS + (_A_READ * self._reads + _AN_OCTET * self._octets) / seconds
                self._size += (size - self._size) / 10
            self._begin, self._reads, self._octets = now, 0, 0
        return min(max((A_SECOND - self._size) / _A_VALUE, self.LEAST), self.MOST)


class Budget:
    """`rate`: messages a second in the long run. `burst`: that may come at once after a quiet time."""

    def __init__(self, rate: float, burst: int) -> None:
        self.rate = rate
        self._burst = float(burst)
        self._left = float(burst)
        self._at: int | None = None
        self._last: dict[str, int] = {}

    def take(self, channel: str, now: int) -> bool:
        """Whether a message of a channel is to be written at `now` (ns); a refusal changes nothing."""
        left = self._left_at(now)
        if not self._has_turn(channel, now, left):
            return False
        self._left, self._at = left - 1, now if self._at is None else max(self._at, now)
        self._last[channel] = now
        return True

    def settle(self, now: int, rate: float) -> None:
        """From `now` on (ns) there is room for `rate` messages a second."""
        if rate != self.rate:
            self._left, self._at = self._left_at(now), now if self._at is None else max(self._at, now)
            self.rate = rate

    def would_take(self, channels: Iterable[str], now: int) -> bool:
        """Whether a message of any of these channels may be written at `now` (ns). False is sure whatever is written
        until then, for that leaves less; so it may be asked ahead of time, and changes nothing."""
        left = self._left_at(now)
        return left >= 1 and any(self._has_turn(channel, now, left) for channel in channels)

    def is_spent(self, now: int) -> bool:
        """Whether nothing at all may be written at `now` (ns); as sure as `would_take`."""
        return self._left_at(now) < 1

    def _left_at(self, now: int) -> float:
        """Messages left at `now`, if none is written until then."""
        passed = 0 if self._at is None else max(0, now - self._at)
        return min(self._burst, self._left + passed / NS_PER_S * self.rate)

    def _has_turn(self, channel: str, now: int, left: float) -> bool:
        last = self._last.get(channel)
        if last is not None and left < self._burst / 2:
            turn = len(self._last) / self.rate * NS_PER_S
            if 0 <= now - last < turn:
                return False
        return left >= 1
