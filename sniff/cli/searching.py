"""The search for settings and protocol as commands use it: what is searched for, what is said meanwhile and after."""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace

from dissectors import registry
from dissectors.line import LineSettings
from sniff.analysis.detecting import Detecting, Ending, Outcome, candidates
from sniff.capture.link import CaptureLink
from sniff.cli import INTERRUPTED, PORT_TROUBLE, Failure
from sniff.detection import Progress, Search

TIMEOUT = 120.0
"""s after which a search gives up, unless told otherwise."""

LINELESS = frozenset(("pty", "TCP gateway"))
"""Drivers and adapters that set no line."""


@dataclass(frozen=True, slots=True)
class Unknowns:
    """What is given of a bus; None for what is searched for."""

    line: LineSettings | None = None
    protocol: str | None = None

    def detecting(self, latency: int = 0, reports: tuple[str, ...] | None = None) -> Detecting:
        """A search over everything that is not given; the protocol's own settings first."""
        protocols = (self.protocol,) if self.protocol else registry.names()
        first = (LineSettings.parse(registry.get(self.protocol).default_line),) if self.protocol else ()
        return Detecting(candidates(None if self.line is None else (self.line,), first), protocols, latency, reports)


def search(link: CaptureLink, unknowns: Unknowns, timeout: float = TIMEOUT) -> Outcome:
    """Search on a running capture, with progress on standard error. Ends with exit code 4 when the capture ends."""
    from sniff.cli.listening import until_interrupted

    session = link.session(0)
    running = Search(link, unknowns.detecting(session.adapter.latency, session.adapter.reports), timeout)
    meter = Meter()
    with until_interrupted() as caught:
        outcome = running.run(lambda: bool(caught), meter.show)
    meter.clear()
    if running.ended is not None and not running.ended.clean:
        raise Failure(f"{session.port}: {running.ended.reason}", PORT_TROUBLE)
    if caught and outcome.ending is not Ending.FOUND:
        raise Failure("interrupted", INTERRUPTED)
    if session.adapter.driver in LINELESS or session.adapter.name in LINELESS:
        return without_line(outcome, unknowns)
    return outcome


def without_line(outcome: Outcome, unknowns: Unknowns) -> Outcome:
    """The outcome where octets come through no line of this machine, so that all settings hear the same."""
    reading = outcome.reading
    if reading is None or unknowns.line is not None:
        return outcome
    line = LineSettings.parse(registry.get(reading.protocol).default_line)
    words = f"the line settings: octets come through no line here; {line} is only what such a bus usually runs"
    return replace(outcome, reading=replace(reading, line=line), cannot_tell=(words,))


def sentence(outcome: Outcome) -> str:
    """The outcome in words."""
    reading = outcome.reading
    if reading is not None:
        name = f"{registry.get(reading.protocol).title}, {reading.line}"
        return name if outcome.ending is Ending.FOUND else f"probably {name}; not enough was heard to be sure"
    if outcome.ending is Ending.SILENT:
        return "silent: not one octet came; is the bus powered, A and B connected, the master polling?"
    return (
        f"{outcome.octets} octets came, but with none of {outcome.tried} settings tried do they make sense: A and B "
        "swapped, a protocol or rate that is not known here, or noise; --timeout gives the search longer"
    )


class Meter:
    """What the search is at, on standard error: a line that changes on a terminal, else a line a candidate."""

    def __init__(self) -> None:
        self._last: LineSettings | None = None
        self._live = sys.stderr.isatty()

    def show(self, progress: Progress) -> None:
        """Say it, where it is news."""
        if self._live:
            text = f"{progress.seconds:.0f} s  {progress.line}  {progress.octets} octets  {progress.frames} frames"
            print(f"\r\x1b[K{text}\r", end="", file=sys.stderr, flush=True)
        elif progress.line != self._last:
            self._last = progress.line
            print(f"sniff485: {progress.seconds:.1f} s: listening with {progress.line}", file=sys.stderr)

    def clear(self) -> None:
        """Leave the terminal as it was."""
        if self._live:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)
