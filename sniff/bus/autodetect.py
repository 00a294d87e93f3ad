"""The search for line settings and protocol on a running capture: the port is opened once and never closed for it.

The capture process reads, records and changes the settings when it is told to; what is heard is judged here. Each
change, and the end, is a SETTINGS event in the recording (`sniff.engine.event_texts.SettingsChange`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from dissectors import registry
from dissectors.frame import Chunk
from dissectors.line import NS_PER_S, LineSettings
from sniff.analysis.autodetect import Detecting, Outcome
from sniff.capture.ipc import Ended, Message, ReceivedMessage, Tick
from sniff.capture.link import CaptureLink
from sniff.engine.event_texts import refused_line, settings_change
from sniff.engine.session import LineEvent, LineEventKind

ANSWER_PATIENCE = 3 * NS_PER_S
"""How long a change of settings may take to be confirmed, ns, before it is asked for again."""

POLL = 0.1
"""s between looks at whether to stop."""


@dataclass(frozen=True, slots=True)
class SearchProgress:
    """What the search is at. `seconds`: since its start; `octets`: heard with the present settings."""

    line: LineSettings
    seconds: float
    octets: int
    frames: int


class Search:
    """Fed what a CaptureLink receives, it changes the settings until the evidence suffices.

    `ended`: how the capture ended, if it did. `line_known`: whether only the protocol is searched for.
    """

    def __init__(self, link: CaptureLink, detecting: Detecting, line_known: bool = False, bus: int = 0) -> None:
        self.link = link
        self.detecting = detecting
        self.bus = bus
        self.ended: Ended | None = None
        session = link.session(bus)
        self._lineless = session.adapter.lineless
        self._line_known = line_known
        self._in_force: LineSettings | None = session.line
        self._asked: LineSettings | None = None
        self._asked_at = 0
        self._began: int | None = None
        self._now = 0
        self._told = False

    def run(
        self,
        timeout: float,
        stopped: Callable[[], bool] = lambda: False,
        show: Callable[[SearchProgress], None] = lambda _: None,
    ) -> Outcome:
        """Search until found, for `timeout` s of the capture's clock, until `stopped` says so or the capture ends."""
        while self.detecting.found is None and self.ended is None and not stopped():
            for message in self.link.receive(POLL):
                self.take(message)
            show(self.progress)
            if self.progress.seconds >= timeout:
                break
        return self.outcome()

    def take(self, message: Message) -> None:
        """Take what the capture sent; once settings are found, says so to the capture."""
        if isinstance(message, Ended):
            self.ended = message
        elif isinstance(message, ReceivedMessage) and message.bus == self.bus:
            self._take(message.item)
        elif isinstance(message, Tick) and message.bus == self.bus:
            self._tick(message.now)
        if self.detecting.found is not None and not self._told:
            self._told = True
            reading = self.outcome().reading
            assert reading is not None
            self.link.found(self.bus, reading.line, reading.protocol)

    def outcome(self) -> Outcome:
        """What can be said when it ends here."""
        outcome = self.detecting.outcome()
        return without_line(outcome) if self._lineless and not self._line_known else outcome

    @property
    def progress(self) -> SearchProgress:
        """Where it stands."""
        current = self.detecting.current
        seconds = 0.0 if self._began is None else (self._now - self._began) / NS_PER_S
        return SearchProgress(current.line, seconds, current.octets, current.best().frames)

    def _take(self, item: Chunk | LineEvent) -> None:
        change = settings_change(item)
        if change is not None:
            self._in_force = change.line or self._in_force
        elif isinstance(item, LineEvent):
            refused = refused_line(item)
            if item.kind is LineEventKind.REPLUGGED:
                self.detecting.forgive()
            if refused is not None and refused == self.detecting.wanted:
                self.detecting.refuse()
        elif self._hears_what_is_wanted:  # anything else was heard with settings that nobody asks about
            self.detecting.feed(item)
        self._ask(item.time)

    def _tick(self, now: int) -> None:
        self._began = now if self._began is None else self._began
        self._now = now
        if self._hears_what_is_wanted:
            self.detecting.advance(now)
        self._ask(now)

    @property
    def _hears_what_is_wanted(self) -> bool:
        return self._lineless or self._in_force == self.detecting.wanted

    def _ask(self, now: int) -> None:
        """Have the wanted settings put in force, once, and again where no confirmation comes."""
        wanted = self.detecting.wanted
        if self._hears_what_is_wanted or self.detecting.found is not None:
            return
        is_new = wanted != self._asked and not self.detecting.is_refused  # who refuses all is asked now and then
        if is_new or now - self._asked_at > ANSWER_PATIENCE:
            self._asked, self._asked_at = wanted, now
            self.link.reconfigure(self.bus, wanted)


def without_line(outcome: Outcome) -> Outcome:
    """The outcome where octets come through no line of this machine, so that all settings hear the same."""
    reading = outcome.reading
    if reading is None:
        return outcome
    line = LineSettings.parse(registry.get(reading.protocol).default_line)
    words = f"the line settings: octets come through no line here; {line} is only what such a bus usually runs"
    return replace(outcome, reading=replace(reading, line=line), cannot_tell=(words,))
