"""The search for line settings and protocol on a running capture: the port is opened once and never closed for it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from dissectors.frame import Chunk
from dissectors.line import NS_PER_S, LineSettings
from sniff.analysis.detecting import Detecting, Outcome
from sniff.capture.link import CaptureLink
from sniff.capture.wire import Ended, Received, Tick
from sniff.session import LineEvent, LineEventKind

ANSWER_PATIENCE = 3 * NS_PER_S
"""How long a change of settings may take to be confirmed, ns, before it is asked for again."""

POLL = 0.1
"""s between looks at whether to stop."""


@dataclass(frozen=True, slots=True)
class Progress:
    """What the search is at. `seconds`: since its start; `octets`: heard with the present settings."""

    line: LineSettings
    seconds: float
    octets: int
    frames: int


class Search:
    """Listens through a CaptureLink and changes its settings until the evidence suffices.

    `timeout`: s on the capture's clock. `ended`: how the capture ended, if it did.
    """

    def __init__(self, link: CaptureLink, detecting: Detecting, timeout: float, bus: int = 0) -> None:
        self.link = link
        self.detecting = detecting
        self.bus = bus
        self.ended: Ended | None = None
        self._in_force: LineSettings | None = link.session(bus).line
        self._asked: LineSettings | None = None
        self._asked_at = 0
        self._timeout = int(timeout * NS_PER_S)
        self._began: int | None = None
        self._now = 0

    def run(
        self, stopped: Callable[[], bool] = lambda: False, show: Callable[[Progress], None] = lambda _: None
    ) -> Outcome:
        """Search until found, until time is over, until `stopped` says so or the capture ends."""
        while self.detecting.found is None and self.ended is None and not stopped():
            for message in self.link.receive(POLL):
                if isinstance(message, Ended):
                    self.ended = message
                elif isinstance(message, Received) and message.bus == self.bus:
                    self._take(message.item)
                elif isinstance(message, Tick) and message.bus == self.bus:
                    self._tick(message.now)
            show(self.progress)
            if self._began is not None and self._now - self._began >= self._timeout:
                break
        return self.detecting.outcome()

    @property
    def progress(self) -> Progress:
        """Where it stands."""
        current = self.detecting.current
        seconds = 0.0 if self._began is None else (self._now - self._began) / NS_PER_S
        return Progress(current.line, seconds, current.octets, current.best().frames)

    def _take(self, item: Chunk | LineEvent) -> None:
        if isinstance(item, LineEvent):
            if item.kind is LineEventKind.SETTINGS and item.text.startswith("line="):
                self._in_force = LineSettings.parse(item.text.removeprefix("line="))
            elif (
                item.kind is LineEventKind.NOTE
                and str(self._asked) in item.text
                and self._asked == self.detecting.wanted
            ):
                self.detecting.refuse()
        elif self._in_force == self.detecting.wanted:  # anything else was heard with settings that nobody asks about
            self.detecting.feed(item)
        self._ask(item.time)

    def _tick(self, now: int) -> None:
        self._began = now if self._began is None else self._began
        self._now = now
        if self._in_force == self.detecting.wanted:
            self.detecting.advance(now)
        self._ask(now)

    def _ask(self, now: int) -> None:
        """Have the wanted settings put in force, once, and again where no confirmation comes."""
        wanted = self.detecting.wanted
        if wanted == self._in_force or self.detecting.found is not None:
            return
        if wanted != self._asked or now - self._asked_at > ANSWER_PATIENCE:
            self._asked, self._asked_at = wanted, now
            self.link.reconfigure(self.bus, wanted)
