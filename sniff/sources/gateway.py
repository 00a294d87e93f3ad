"""Serial ports on the network as sources: raw TCP (`socket://host:port`) and RFC 2217 (`rfc2217://host:port`).

Their times are the network's: `latency` says how far they may be wrong, and only an assumption can be made.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol
from urllib.parse import urlsplit

from dissectors.line import MS, NS_PER_S, LineSettings
from sniff.engine.event_texts import gone
from sniff.engine.session import Adapter, Item, LineEvent, LineEventKind
from sniff.sources import PortError
from sniff.sources.clock import Clock
from sniff.sources.reconnecting import Reconnecting

LATENCY = 50 * MS
RETRY_EVERY = 2 * NS_PER_S

EXPECTED = "expected a serial port, socket://HOST:PORT, rfc2217://HOST:PORT or a capture file"


class Stream(Protocol):
    """A connection to a gateway."""

    name: str
    detail: str
    reports: tuple[str, ...] | None

    def fileno(self) -> int:
        """What to wait on."""
        ...

    def read(self, clock: Clock) -> list[Item]:
        """What is there. Raises OSError when the connection is gone."""
        ...

    def reconfigure(self, line: LineSettings) -> None:
        """Change the line. Raises PortError, OSError or ValueError."""
        ...

    def close(self) -> None:
        """Let go."""
        ...


def open_gateway(spec: str, line: LineSettings, clock: Clock) -> GatewaySource:
    """Connect to a gateway. Raises PortError."""
    scheme = spec.split("://", 1)[0].lower()
    if scheme not in ("socket", "rfc2217"):
        raise PortError(f"{spec}: unknown kind of port {scheme}://; {EXPECTED}")
    try:
        parts = urlsplit(spec)
        host, port = parts.hostname, parts.port
    except ValueError:
        host = port = None
    if not host or not port:
        raise PortError(f"{spec}: no host and port number; write {scheme}://HOST:PORT")

    def connect(line: LineSettings) -> Stream:
        if scheme == "socket":
            from sniff.sources.tcp import TcpStream

            return TcpStream(spec, host, port, line)
        from sniff.sources.rfc2217 import Rfc2217Stream

        return Rfc2217Stream(spec, line, clock)

    return GatewaySource(spec, line, clock, connect)


class GatewaySource:
    """Listens through a gateway. A connection that is lost gives UNPLUGGED and is made again in the background."""

    def __init__(self, spec: str, line: LineSettings, clock: Clock, connect: Callable[[LineSettings], Stream]) -> None:
        self.spec = spec
        self.line = line
        self._clock = clock
        self._pending: list[Item] = []
        self._ended = False
        self._connect = connect
        self._again: Reconnecting[_Connected] = Reconnecting(clock, self._make, (OSError, ValueError), RETRY_EVERY)
        try:
            self._stream: Stream | None = connect(line)
        except (OSError, ValueError) as error:
            raise PortError(
                f"{spec}: no connection: {_reason(error)}; is the gateway on, and is the port right?"
            ) from error
        stream = self._stream
        self._adapter = Adapter(
            stream.name, "network", LATENCY, "assumed 50 ms for a network", stream.reports, stream.detail
        )

    @property
    def session_adapter(self) -> Adapter:
        """The gateway, as far as it is known."""
        return self._adapter

    @property
    def ended(self) -> bool:
        """Whether it was closed here."""
        return self._ended

    def fileno(self) -> int | None:
        """The connection's descriptor, None while there is none."""
        return None if self._stream is None else self._stream.fileno()

    def deadline(self) -> int | None:
        """When to look for a new connection."""
        return None if self._ended or self._stream is not None else self._again.deadline()

    def now(self) -> int:
        """The time on the clock."""
        return self._clock.now()

    def read(self) -> list[Item]:
        """What came, or how it stands with the connection."""
        items, self._pending = self._pending, []
        if self._ended:
            return items
        if self._stream is None:
            return items + self._look()
        try:
            return items + self._stream.read(self._clock)
        except OSError as error:
            self._stream.close()
            self._stream = None
            return [
                *items,
                LineEvent(self._again.lost(), LineEventKind.UNPLUGGED, gone(self.spec, _reason(error))),
            ]

    def reconfigure(self, line: LineSettings) -> None:
        """Change the line through the gateway, if it can. Raises PortError."""
        if self._stream is not None:
            try:
                self._stream.reconfigure(line)
            except (OSError, ValueError) as error:
                with contextlib.suppress(OSError, ValueError, PortError):  # half of it may be in force
                    self._stream.reconfigure(self.line)
                raise PortError(f"{self.spec}: cannot be set to {line}: {_reason(error)}") from error
            with contextlib.suppress(OSError):  # what came during the dialogue; a loss shows at the next read
                self._pending += self._stream.read(self._clock)
        self.line = line
        self._pending.append(LineEvent(self._clock.now(), LineEventKind.SETTINGS, f"line={line}"))

    def close(self) -> None:
        """Let go."""
        self._ended = True
        stream, self._stream = self._stream, None
        if stream is not None:
            stream.close()

    def _make(self) -> _Connected:
        line = self.line
        return _Connected(self._connect(line), line)

    def _look(self) -> list[Item]:
        """Whether there is a connection again."""
        made = self._again.look()
        if made is None:
            return []
        self._stream = made.stream
        if made.line != self.line:  # changed while the connection was made
            with contextlib.suppress(PortError):
                self.reconfigure(self.line)
        return [LineEvent(self._clock.now(), LineEventKind.REPLUGGED, f"{self.spec} is back")]


@dataclass(frozen=True, slots=True)
class _Connected:
    """A connection that was made again, and with which settings."""

    stream: Stream
    line: LineSettings


def _reason(error: Exception) -> str:
    return " ".join(str(getattr(error, "strerror", None) or error).split()) or type(error).__name__
