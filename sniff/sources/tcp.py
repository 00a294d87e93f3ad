"""A raw TCP gateway: octets come, nothing is ever sent."""

from __future__ import annotations

import socket

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.engine.session import Item
from sniff.sources import PortError
from sniff.sources.clock import Clock

READ_SIZE = 65536
CONNECT_PATIENCE = 5.0


class TcpStream:
    """A connection to a gateway. Raises OSError when it cannot be made."""

    reports: tuple[str, ...] | None = ()
    name = "TCP gateway"
    detail = "a raw gateway passes octets only: no line errors, and its packets hide the gaps"

    def __init__(self, spec: str, host: str, port: int, line: LineSettings) -> None:
        self.spec = spec
        self._socket = socket.create_connection((host, port), timeout=CONNECT_PATIENCE)
        self._socket.setblocking(False)
        # a gateway that loses power says nothing: without this the silence would look like a quiet bus for ever
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        for option, value in (("TCP_KEEPIDLE", 10), ("TCP_KEEPINTVL", 5), ("TCP_KEEPCNT", 3)):
            if hasattr(socket, option):
                self._socket.setsockopt(socket.IPPROTO_TCP, getattr(socket, option), value)

    def fileno(self) -> int:
        """The connection's descriptor."""
        return self._socket.fileno()

    def read(self, clock: Clock) -> list[Item]:
        """What is there. Raises OSError when the connection is gone."""
        try:
            octets = self._socket.recv(READ_SIZE)
        except BlockingIOError:
            return []
        now = clock.now()
        if not octets:
            raise ConnectionResetError("closed by the gateway")
        return [Chunk(now, octets)]

    def reconfigure(self, line: LineSettings) -> None:
        """A raw gateway sets its own line. Raises PortError."""
        raise PortError(
            f"{self.spec}: a raw gateway sets its own line ({line} was asked for); use rfc2217:// if it can"
        )

    def close(self) -> None:
        """Let go."""
        self._socket.close()
