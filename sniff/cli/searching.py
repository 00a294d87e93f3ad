"""The search for settings and protocol as commands use it: what is searched for, what is said meanwhile and after."""

from __future__ import annotations

import sys
from dataclasses import dataclass

from dissectors import registry
from dissectors.line import LineSettings
from sniff.analysis.autodetect import Detecting, Ending, Outcome, candidates
from sniff.analysis.sanitizing import sanitized
from sniff.bus.autodetect import Search, SearchProgress
from sniff.bus.live import LiveBus
from sniff.capture.link import CaptureLink
from sniff.cli import INTERRUPTED, PORT_TROUBLE, Failure
from sniff.engine.session import UNKNOWABLE

TIMEOUT = 120.0
"""s after which a search gives up, unless told otherwise."""


@dataclass(frozen=True, slots=True)
class Unknowns:
    """What is given of a bus; None for what is searched for."""

    line: LineSettings | None = None
    protocol: str | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """What is searched for, as `Session.unknown` has it."""
        return tuple(name for name in UNKNOWABLE if getattr(self, name) is None)

    def detecting(self, latency: int = 0, reports: tuple[str, ...] | None = None) -> Detecting:
        """A search over everything that is not given; the protocol's own settings first."""
        protocols = (self.protocol,) if self.protocol else registry.names()
        own = [registry.get(name) for name in protocols]
        named = [LineSettings.parse(line) for one in own for line in (one.default_line, *one.other_lines)]
        first, last = (named, ()) if self.protocol else ((), named)
        lines = None if self.line is None else (self.line,)
        return Detecting(candidates(lines, first, last), protocols, latency, reports)


def search(link: CaptureLink, unknowns: Unknowns, timeout: float = TIMEOUT) -> Outcome:
    """Search on a running capture, with progress on standard error. Ends with exit code 4 when the capture ends."""
    from sniff.cli.interruption import until_interrupted

    session = link.session(0)
    detecting = unknowns.detecting(session.adapter.latency, session.adapter.reports)
    running = Search(link, detecting, unknowns.line is not None)
    meter = Meter()
    with until_interrupted() as caught:
        outcome = running.run(timeout, lambda: bool(caught), meter.show)
    meter.clear()
    if running.ended is not None and not running.ended.clean:
        raise Failure(f"{session.port}: {running.ended.reason}", PORT_TROUBLE)
    if caught and outcome.ending is not Ending.FOUND:
        raise Failure("interrupted", INTERRUPTED)
    return outcome


def sentence(outcome: Outcome, advice: str = "--timeout gives the search longer") -> str:
    """The outcome in words; `advice`: what to do where nothing made sense."""
    reading = outcome.reading
    if reading is not None:
        line = "no serial line" if reading.protocol in registry.RELATIVES else reading.line
        name = f"{registry.get(reading.protocol).title}, {line}"
        return name if outcome.ending is Ending.FOUND else f"probably {name}; not enough was heard to be sure"
    if outcome.ending is Ending.SILENT:
        return "silent: not one octet came; is the bus powered, A and B connected, the master polling?"
    return (
        f"{outcome.octets} octets came, but with none of {outcome.tried} settings tried do they make sense: A and B "
        f"swapped, a protocol or rate that is not known here, or noise; {advice}"
    )


class Meter:
    """What the search is at, on standard error: a line that changes on a terminal, else a line a candidate."""

    def __init__(self) -> None:
        self._last: LineSettings | None = None
        self._live = sys.stderr.isatty()

    def show(self, progress: SearchProgress) -> None:
        """Say it, where it is news."""
        if self._live:
            text = (
                f"{progress.seconds:.0f} s  searching: {progress.line}  "
                f"{progress.octets} octets  {progress.frames} frames"
            )
            print(f"\r\x1b[K{text}\r", end="", file=sys.stderr, flush=True)
        elif progress.line != self._last:
            self._last = progress.line
            print(f"sniff485: {progress.seconds:.1f} s: searching, listening with {progress.line}", file=sys.stderr)

    def follow(self, live: LiveBus) -> None:
        """Say what the search of a bus is at, or what it came to."""
        if live.searching is not None:
            self.show(live.searching)
        elif live.search is not None:
            self.clear()
            say_found(live.session.port, live.search.outcome())

    def clear(self) -> None:
        """Leave the terminal as it was."""
        if self._live:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)


def say_found(port: str, outcome: Outcome) -> None:
    """Say on standard error what a search came to, and what it cannot tell."""
    print(f"sniff485: {sanitized(port)}: {sentence(outcome)}", file=sys.stderr)
    for words in outcome.cannot_tell:
        print(f"sniff485: cannot tell {words}", file=sys.stderr)
