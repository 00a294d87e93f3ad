"""A port that may not be there yet: it is tried until it is, and listened to from then on.

Nobody knows its adapter before; what is assumed allows for the slowest there is, so that no time looks exact that
is not.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from dissectors.line import NS_PER_S, LineSettings
from sniff.engine.event_texts import gone
from sniff.engine.session import Adapter, Item, LineEvent, LineEventKind
from sniff.sources import PortError, Source
from sniff.sources.clock import Clock
from sniff.sources.drivers import UNKNOWN
from sniff.sources.gateway import LATENCY as NETWORK_LATENCY
from sniff.sources.reconnecting import Reconnecting

RETRY_EVERY = 2 * NS_PER_S

ABSENT = Adapter(
    latency=UNKNOWN.hold,
    latency_from="assumed: the port was not there when the recording began",
    detail="the port was not there when the recording began: nobody knows what errors its adapter reports",
)
ABSENT_GATEWAY = replace(ABSENT, latency=NETWORK_LATENCY)

Open = Callable[[str, LineSettings, Clock], Source]


class AwaitedSource:
    """A source that never fails to open. UNPLUGGED comes first where the port is not there, and says why; REPLUGGED
    once it is. A port that is gone for good by itself (a pseudo-terminal) is tried again, too; a capture file at its
    end is not."""

    def __init__(self, spec: str, line: LineSettings, clock: Clock, open_source: Open) -> None:
        self.spec = spec
        self.line = line
        self._clock = clock
        self._open = open_source
        self._closed = False
        self._pending: list[Item] = []
        self._source: Source | None = None
        self._again: Reconnecting[Source] = Reconnecting(
            clock, self._try, (PortError, OSError, ValueError), RETRY_EVERY
        )
        try:
            self._source = open_source(spec, line, clock)
        except (PortError, OSError, ValueError) as error:
            self._pending.append(self._gone(_reason(spec, error)))
        absent = ABSENT_GATEWAY if "://" in spec else ABSENT
        self._adapter = absent if self._source is None else self._source.session_adapter
        self._is_new = self._source is None  # nobody has seen its adapter

    @property
    def session_adapter(self) -> Adapter:
        """The adapter as found at the start; what must be assumed where there was none."""
        return self._adapter

    @property
    def ended(self) -> bool:
        """Whether it was closed here, or was a capture file and is at its end."""
        return self._closed or (self._source is not None and self._source.ended)

    def fileno(self) -> int | None:
        """What to wait on; None while the port is not there."""
        return None if self._source is None else self._source.fileno()

    def deadline(self) -> int | None:
        """When to look at the port, or for it."""
        if self._pending:
            return self._clock.now()
        if self._closed:
            return None
        return self._again.deadline() if self._source is None else self._source.deadline()

    def now(self) -> int:
        """The time up to which everything was given."""
        return self._clock.now() if self._source is None else self._source.now()

    def read(self) -> list[Item]:
        """What came, or how it stands with the port."""
        items, self._pending = self._pending, []
        if self._closed:
            return items
        if self._source is None:
            return items + self._look()
        given = self._source.read()
        if self._source.ended and any(_is_loss(item) for item in given):
            self._source.close()
            self._source = None
            self._again.lost()
        return items + given

    def reconfigure(self, line: LineSettings) -> None:
        """Change the settings; those of a port that is not there hold once it is. Raises PortError."""
        if self._source is not None:
            self._source.reconfigure(line)
        else:
            self._pending.append(LineEvent(self._clock.now(), LineEventKind.SETTINGS, f"line={line}"))
        self.line = line

    def close(self) -> None:
        """Let go of it."""
        self._closed = True
        source, self._source = self._source, None
        if source is not None:
            source.close()

    def _gone(self, why: str) -> LineEvent:
        return LineEvent(self._again.lost(), LineEventKind.UNPLUGGED, gone(self.spec, why))

    def _try(self) -> Source:
        line = self.line
        source = self._open(self.spec, line, self._clock)
        if line != self.line:  # changed while it was opened
            source.reconfigure(self.line)
        return source

    def _look(self) -> list[Item]:
        source = self._again.look()
        if source is None:
            return []
        if self._closed:
            source.close()
            return []
        self._source = source
        name = source.session_adapter.name
        text = f"{self.spec} is back" + (f": {name}" if self._is_new else "")
        if self._is_new:
            self._adapter, self._is_new = replace(self._adapter, name=name), False
        return [LineEvent(self._clock.now(), LineEventKind.REPLUGGED, text)]


def _is_loss(item: Item) -> bool:
    return isinstance(item, LineEvent) and item.kind is LineEventKind.UNPLUGGED


def _reason(spec: str, error: Exception) -> str:
    """Why it cannot be had, without its name."""
    text = " ".join(str(error).split()) or type(error).__name__
    return text.removeprefix(f"{spec}: ").partition(";")[0]
