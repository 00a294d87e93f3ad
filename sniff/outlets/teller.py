"""From running buses to outlets: values at the pace that each wants, numbers, what is new about findings.

A value that comes before its time waits, and only the newest of a point does: so the last one is always told. Nothing
here waits for anybody.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from dissectors.findings import Severity
from dissectors.line import NS_PER_S
from sniff.analysis.point_reader import Sample
from sniff.analysis.points import MOST_POINTS
from sniff.analysis.sanitizing import sanitized
from sniff.bus.derived_topics import NODE
from sniff.bus.live import LiveBus
from sniff.engine.session import LineEvent, LineEventKind
from sniff.outlets.news import NewsDesk
from sniff.outlets.told import FindingTold, LogTold, NumbersTold, StateTold, Told, ToldBus, ValueTold
from sniff.recording.derived_message import DerivedMessage

LOOK_EVERY = NS_PER_S
"""ns between two looks at the findings of a bus."""

SAME_FINDING = 60 * NS_PER_S
"""ns between two words about the same finding."""


class Hearer(Protocol):
    """Whoever is told: an `Outlet`, or somebody who writes things down at once. `every`: ns between two values of one
    point, 0 for each of them."""

    every: int

    def tell(self, things: Sequence[Told]) -> None:
        """Hand things on."""


@dataclass(slots=True)
class Pace:
    """Those that want values equally often, and what waits for its time: the newest of each point."""

    every: int
    outlets: list[Hearer]
    waiting: dict[int, dict[tuple[str, str], Sample]] = field(default_factory=dict)  # by bus
    next: dict[int, int] = field(default_factory=dict)

    def add(self, bus: int, samples: Iterable[Sample]) -> None:
        """Keep the newest of each point."""
        waiting = self.waiting.setdefault(bus, {})
        for sample in samples:
            key = sample.station, sample.name
            if key in waiting or len(waiting) < MOST_POINTS:
                waiting[key] = sample

    def due(self, bus: int, now: int) -> list[Sample]:
        """What has its turn at `now` (ns)."""
        next_time = self.next.get(bus, now)
        if now < next_time <= now + self.every:  # else the clock was set back
            return []
        self.next[bus] = now + self.every
        return self.all_of(bus)

    def all_of(self, bus: int) -> list[Sample]:
        """Everything that waits."""
        waiting = self.waiting.get(bus, {})
        samples = list(waiting.values())
        waiting.clear()
        return samples


@dataclass(slots=True)
class _Bus:
    about: ToldBus
    desk: NewsDesk
    look_at: int = 0
    listening: bool = True


class Teller:
    """A `BusListener` for all buses of a process. `outlets`: started and closed by their owner. `every_second`: called
    once a second. `lives`: the buses that are listened to."""

    def __init__(self, outlets: Sequence[Hearer], every_second: Callable[[], None] | None = None) -> None:
        self.outlets = tuple(outlets)
        self.lives: dict[int, LiveBus] = {}
        self._every_second = every_second
        self._second = 0
        paces = sorted({outlet.every for outlet in outlets})
        self._paces = [Pace(every, [one for one in outlets if one.every == every]) for every in paces]
        self._buses: dict[int, _Bus] = {}

    def attach(self, live: LiveBus) -> None:
        """Listen to a bus; another capture of the same takes the place of the first."""
        live.tell(self)
        known = self._buses.get(live.bus)
        desk = known.desk if known is not None else NewsDesk(Severity.INFO, SAME_FINDING)
        self._buses[live.bus] = _Bus(_about(live), desk)
        self.lives[live.bus] = live
        self._state(live, live.link.clock.now(), True, "")

    def on_samples(self, live: LiveBus, samples: Sequence[Sample]) -> None:
        """Tell values, or have them wait."""
        about = self._buses[live.bus].about
        for pace in self._paces:
            if pace.every:
                pace.add(live.bus, samples)
            else:
                _tell(pace.outlets, [ValueTold(about, sample) for sample in samples])

    def on_derived(self, live: LiveBus, messages: list[DerivedMessage]) -> None:
        """Tell what was counted."""
        about = self._buses[live.bus].about
        _tell(self.outlets, [_of_message(about, message) for message in messages])

    def on_event(self, live: LiveBus, event: LineEvent) -> None:
        """A port went, or came back; settings were found."""
        bus = self._buses[live.bus]
        if event.kind in (LineEventKind.UNPLUGGED, LineEventKind.REPLUGGED):
            self._state(live, event.time, event.kind is LineEventKind.REPLUGGED, sanitized(event.text))
        elif bus.about.protocol != live.session.protocol:
            bus.about = _about(live)

    def on_time(self, live: LiveBus, now: int) -> None:
        """Values that waited for their turn; every second what is new about the findings."""
        bus = self._buses[live.bus]
        for pace in self._paces:
            if pace.every:
                _tell(pace.outlets, [ValueTold(bus.about, sample) for sample in pace.due(live.bus, now)])
        if not bus.look_at - LOOK_EVERY <= now < bus.look_at:
            bus.look_at = now + LOOK_EVERY
            self._look(live, bus, now)
        if self._every_second is not None and not self._second - NS_PER_S <= now < self._second:
            self._second = now + NS_PER_S
            self._every_second()

    def on_end(self, live: LiveBus) -> None:
        """The last values and findings; nobody listens any more."""
        bus, now = self._buses[live.bus], live.link.clock.now()
        for pace in self._paces:
            _tell(pace.outlets, [ValueTold(bus.about, sample) for sample in pace.all_of(live.bus)])
        self._look(live, bus, now)
        self._state(live, now, False, "ended")

    def _look(self, live: LiveBus, bus: _Bus, now: int) -> None:
        news = bus.desk.look(live.findings(), now)
        _tell(self.outlets, [FindingTold(bus.about, now, one) for one in news])

    def _state(self, live: LiveBus, now: int, listening: bool, text: str) -> None:
        bus = self._buses[live.bus]
        bus.listening = listening
        _tell(self.outlets, [StateTold(bus.about, now, listening, text)])


def _about(live: LiveBus) -> ToldBus:
    session = live.session
    return ToldBus(session.bus, session.port, session.protocol, live.devices)


def _tell(outlets: Iterable[Hearer], things: Sequence[Told]) -> None:
    if things:
        for outlet in outlets:
            outlet.tell(things)


def _of_message(about: ToldBus, message: DerivedMessage) -> Told:
    if message.topic == "/findings":
        return LogTold(about, message)
    station = message.topic.rpartition("/")[2] if message.schema == NODE else None
    return NumbersTold(about, station, message)
