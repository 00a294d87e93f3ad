"""When a port was there: how often it went, for how long, and whether it ever was. Pure."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from dissectors.findings import Finding, Severity, Tally, times
from dissectors.line import NS_PER_S
from sniff.analysis.line_rules import LINE_RULES as RULES
from sniff.engine.session import LineEvent, LineEventKind

AT_BEGIN = NS_PER_S
"""Within so long after the begin of a capture a port that is not there never was."""


class PortPresence:
    """What the events of a port say, in a capture that began at `started`. `away_since`: ns; None while it is there."""

    def __init__(self, started: int) -> None:
        self._started = started
        self.away_since: int | None = None
        self._gone = Tally()
        self._away = 0
        self._was_missing = False  # when the capture began: nobody unplugged it

    def add(self, event: LineEvent, was_heard: bool) -> None:
        """Take an event. `was_heard`: whether anything was read before it."""
        if event.kind is LineEventKind.UNPLUGGED:
            is_begin = not self._gone.count and not was_heard and event.time - self._started < AT_BEGIN
            self._was_missing |= is_begin
            self._gone.add(event.time)
            self.away_since = event.time
        elif event.kind is LineEventKind.REPLUGGED and self.away_since is not None:
            self._away += max(0, event.time - self.away_since)
            self.away_since = None

    def findings(self) -> Iterator[Finding]:
        """That it went, or was never there."""
        if not self._gone.count:
            return
        is_away = self.away_since is not None
        unplugged = self._gone.count - self._was_missing
        said = ["not there when the capture began"] if self._was_missing else []
        said += [f"unplugged {times(unplugged)}"] if unplugged else []
        words = ", ".join(said)
        words += f", away for {self._away / NS_PER_S:.1f} s in all" if self._away else ""
        if is_away:
            words += "; it did not come back" if unplugged else "; it did not come"
        finding = self._gone.found(RULES["LN006"], "adapter", words, Severity.ERROR if is_away else None)
        yield replace(finding, lasts=is_away)
