"""The record of one bus since the box was started, whatever captures came and went meanwhile. Pure.

Times that come in are on the clock of the capture that runs; `shift` puts them on the wall clock.
"""

from __future__ import annotations

from dissectors.line import NS_PER_S
from sniff.box.status import State
from sniff.capture.ipc import Ended, Status
from sniff.engine.event_texts import gone_why
from sniff.engine.session import LineEvent, LineEventKind

QUIET = 60 * NS_PER_S
"""A bus from which nothing came for so long (ns) is silent."""


class BusWatch:
    """`octets`, `lost`, `unseen`: of all captures so far. `downs`, `away`: how often the port was gone, and for how
    long, ns. `heard_at`: when something came last, None for never."""

    def __init__(self, now: int) -> None:
        self.downs = self.away = 0
        self.heard_at: int | None = None
        self._before = [0, 0, 0]  # octets, lost, unseen of captures that are over
        self._here = [0, 0, 0]
        self._begun = now  # of what lasts since then, when nothing came yet
        self._down: tuple[int, str] | None = None
        self._over: tuple[int, str] | None = (now, "not begun yet")

    @property
    def octets(self) -> int:
        """Octets heard."""
        return self._before[0] + self._here[0]

    @property
    def lost(self) -> int:
        """Octets that were heard and are in no file."""
        return self._before[1] + self._here[1]

    @property
    def unseen(self) -> int:
        """Octets that were recorded and not looked at."""
        return self._before[2] + self._here[2]

    def begin(self, now: int) -> None:
        """A capture was begun."""
        self._over = None
        self._begun = now

    def end(self, now: int, ended: Ended, status: Status) -> None:
        """The capture is over."""
        if not ended.clean:
            self._here[1] += status.unwritten
        self._before = [sum(pair) for pair in zip(self._before, self._here, strict=True)]
        self._here = [0, 0, 0]
        self._back(now)
        self.over(now, ended.reason)

    def over(self, now: int, why: str) -> None:
        """Nobody listens, and why; the first reason stands until a capture is begun."""
        if self._over is None or self._over[1] == "not begun yet":
            self._over = now, why

    def event(self, event: LineEvent) -> None:
        """Something happened to the line."""
        if event.kind is LineEventKind.UNPLUGGED and self._down is None:
            self.downs += 1
            self._down = event.time, gone_why(event)
        elif event.kind is LineEventKind.REPLUGGED:
            self._back(event.time)
            self._begun = event.time

    def see(self, status: Status, unseen: int, now: int) -> None:
        """Take the capture's report, once a second."""
        if status.octets > self._here[0]:
            self.heard_at = now
        self._here = [status.octets, status.lost, unseen]

    def _back(self, now: int) -> None:
        if self._down is not None:
            self.away += max(0, now - self._down[0])
            self._down = None

    def state(self, now: int) -> tuple[State, int, str]:
        """How the bus is, since when, and why."""
        if self._over is not None:
            return State.OVER, *self._over
        if self._down is not None:
            return State.DOWN, *self._down
        heard = self.heard_at if self.heard_at is not None and self.heard_at >= self._begun else None
        if heard is None:
            return State.SILENT, self._begun, "nothing came yet"
        if now - heard > QUIET:
            return State.SILENT, heard, "nothing comes any more"
        return State.HEARD, self._begun, ""

    def time_away(self, now: int) -> int:
        """ns that the port was gone, with those of now."""
        return self.away + (max(0, now - self._down[0]) if self._down is not None else 0)
