"""Serial ports on the network as sources: raw TCP (`socket://host:port`) and RFC 2217 (`rfc2217://host:port`).

Their times are the network's: `latency` says how far they may be wrong, and only an assumption can be made.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Protocol
from urllib.parse import urlsplit

from dissectors.line import NS_PER_S, LineSettings
from sniff.session import Adapter, Item, LineEvent, LineEventKind
from sniff.sources import PortError
from sniff.sources.attempt import Attempt
from sniff.sources.clock import NS_PER_MS, Clock

LATENCY = 50 * NS_PER_MS
RETRY_EVERY = 2 * NS_PER_S
LOOK_EVERY = 50 * NS_PER_MS
"""Between looks at a connection that is being made."""

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
        self._connect = connect
        self._pending: list[Item] = []
        self._ended = False
        self._retry_at = 0
        self._attempt: Attempt[Stream] | None = None
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
        if self._ended or self._stream is not None:
            return None
        return self._retry_at if self._attempt is None else self._clock.now() + LOOK_EVERY

    def now(self) -> int:
        """The time on the clock."""
        return self._clock.now()

    def read(self) -> list[Item]:
        """What came, or how it stands with the connection."""
        items, self._pending = self._pending, []
        if self._ended:
            return items
        if self._stream is None:
            return items + self._again()
        try:
            return items + self._stream.read(self._clock)
        except OSError as error:
            self._stream.close()
            self._stream = None
            now = self._clock.now()
            self._retry_at = now + RETRY_EVERY
            return [*items, LineEvent(now, LineEventKind.UNPLUGGED, f"{self.spec} is gone ({_reason(error)})")]

    def reconfigure(self, line: LineSettings) -> None:
        """Change the line through the gateway, if it can. Raises PortError."""
        if self._stream is not None:
            try:
                self._stream.reconfigure(line)
            except (OSError, ValueError) as error:
                raise PortError(f"{self.spec}: cannot be set to {line}: {_reason(error)}") from error
        self.line = line
        self._pending.append(LineEvent(self._clock.now(), LineEventKind.SETTINGS, f"line={line}"))

    def close(self) -> None:
        """Let go."""
        self._ended = True
        stream, self._stream = self._stream, None
        if stream is not None:
            stream.close()

    def _again(self) -> list[Item]:
        now = self._clock.now()
        if self._attempt is None:
            if now >= self._retry_at:
                self._attempt = Attempt(partial(self._connect, self.line), (OSError, ValueError))
            return []
        if not self._attempt.done:
            return []
        stream, self._attempt = self._attempt.result, None
        self._retry_at = now + RETRY_EVERY
        if stream is None:
            return []
        self._stream = stream
        return [LineEvent(now, LineEventKind.REPLUGGED, f"{self.spec} is back")]


def _reason(error: Exception) -> str:
    return " ".join(str(getattr(error, "strerror", None) or error).split()) or type(error).__name__
