"""A seat: one bus as the application follows it: its feed, how the user looks at it, what was said of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from sniff.bus.feed import Feed, FeedStatus
from sniff.engine.session import LineEvent, LineEventKind
from sniff.tui.health_meter import HealthMeter
from sniff.tui.view_state import Viewing

PATH = 8
"""Screens that `q` can walk back over."""


class BusState(Enum):
    """How a bus is, where that is worth a word; the value is what people read."""

    WELL = ""
    SEARCHING = "searching"
    DOWN = "DOWN"
    ENDED = "ENDED"
    FAILS = "REC FAILS"


@dataclass(frozen=True, slots=True)
class BusLine:
    """What the bar says of a bus. `health`: 0 … 100, None where nobody knows (yet). `load`: 0 … 1, of a file all of it.
    `lost`: octets or rows that were lost on the way here."""

    name: str
    state: BusState
    health: float | None
    load: float
    errors: int
    lost: int
    is_here: bool


@dataclass(slots=True)
class Seat:
    """`visited`: the screens that `q` walks back over. `told_…`: what was said once."""

    feed: Feed
    status: FeedStatus
    viewing: Viewing
    visited: list[str]
    told_end: bool = False
    told_dropped: bool = False
    told_trouble: str = ""
    told_down: bool = False
    health: HealthMeter = field(default_factory=HealthMeter)
    _events_seen: int = 0  # of the line
    _of_port: LineEvent | None = None  # the newest of those

    @classmethod
    def of(cls, feed: Feed, start_screen: str) -> Seat:
        """A bus that nobody has looked at yet."""
        status = feed.status()
        return cls(feed, status, Viewing(feed.store, follow=status.live), [start_screen])

    @property
    def name(self) -> str:
        """What the bus is called."""
        return self.feed.store.session.bus

    def visit(self, screen: str) -> None:
        """Show another screen; `q` comes back from it."""
        self.visited = with_step(self.visited, screen)

    @property
    def is_still_read(self) -> bool:
        """Whether a file is not read and judged to its end."""
        return self.status.reading or self.status.judged < 1

    @property
    def state(self) -> BusState:
        """How the bus is."""
        if self.status.live and self.status.ended:
            return BusState.ENDED
        if self.is_down:
            return BusState.DOWN
        if self.status.trouble:
            return BusState.FAILS
        return BusState.SEARCHING if self.status.searching else BusState.WELL

    @property
    def is_down(self) -> bool:
        """Whether its port is gone, and is looked for."""
        of_port = self.last_of_port() if self.status.live and not self.status.ended else None
        return of_port is not None and of_port.kind is LineEventKind.UNPLUGGED

    def last_of_port(self) -> LineEvent | None:
        """What befell its port last. A bus may have an event a second: each is looked at once."""
        events = self.feed.store.line_events
        for event in events[self._events_seen :]:
            if event.kind in _OF_PORT:
                self._of_port = event
        self._events_seen = len(events)
        return self._of_port

    def line(self, is_here: bool) -> BusLine:
        """What the bar says of it now."""
        store = self.feed.store
        if not self.is_still_read:
            self.health.look(store, final=not self.status.live)
        health = None if self.health.bus is None else self.health.bus.score
        load = store.load.share(now=self.status.now) if self.status.live else store.load.overall()
        return BusLine(self.name, self.state, health, load, store.error_total, self.status.dropped, is_here)


def with_step(path: list[str], name: str) -> list[str]:
    """The path of screens with one more; to and fro between two (A B A B) is kept once, and the oldest give way."""
    longer = [*path, name]
    if len(longer) >= 4 and longer[-2:] == longer[-4:-2]:
        longer = longer[:-2]
    return longer[-PATH:]


_OF_PORT = (LineEventKind.UNPLUGGED, LineEventKind.REPLUGGED)
