"""The watchdog's question: does a capture really go on? Pure.

It does as long as it says something at all, and what it hears gets into the file, or it says why it does not. A full
disk is said: starting anew would make no room. A disk or a thread that hangs is not: then starting anew is all that is
left, once it costs octets anyway.
"""

from __future__ import annotations

from dissectors.line import NS_PER_S
from sniff.capture.ipc import Status

SILENCE = 10 * NS_PER_S
"""A capture speaks once a second; one that has said nothing for so long (ns) hangs."""

STUCK = 60 * NS_PER_S
"""ns for octets to get into the file, where nothing is said to hinder them."""


class _Bus:
    """What is known of the writing of one bus."""

    def __init__(self, now: int) -> None:
        self.written = self.lost = 0
        self.wrote_at = now  # when something got into the file, or nothing waited
        self.lost_at: int | None = None


class Progress:
    """Times are ns of a clock that does not step. Begin anew with every capture."""

    def __init__(self, now: int) -> None:
        self._heard_at = now
        self._buses: dict[int, _Bus] = {}

    def hear(self, now: int) -> None:
        """The capture has said anything at all."""
        self._heard_at = now

    def see(self, status: Status, now: int) -> None:
        """Take its report of one bus."""
        self.hear(now)
        bus = self._buses.setdefault(status.bus, _Bus(now))
        written = status.octets - status.unwritten - status.lost - status.omitted
        if written != bus.written or not status.unwritten or status.error:
            bus.wrote_at = now
        if status.lost > bus.lost and not status.error:
            bus.lost_at = now
        bus.written, bus.lost = written, status.lost

    def trouble(self, now: int) -> str | None:
        """Why it does not go on, in words; None while it does."""
        if now - self._heard_at > SILENCE:
            return f"the capture process has said nothing for {(now - self._heard_at) // NS_PER_S} s"
        for bus in self._buses.values():
            if bus.lost_at is not None and now - bus.lost_at < STUCK and now - bus.wrote_at > SILENCE:
                return "the disk takes nothing, and octets are lost"
            if now - bus.wrote_at > STUCK:
                return f"nothing was written for {(now - bus.wrote_at) // NS_PER_S} s"
        return None
