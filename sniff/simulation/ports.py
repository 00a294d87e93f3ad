"""Places on the virtual bus where a program outside can sit: a pseudo-terminal, a TCP gateway, memory.

They live in the bus's process. None of them ever waits for its reader: what it has no room for is counted.
"""

from __future__ import annotations

import contextlib
import os
import socket
import sys
from collections import deque
from dataclasses import dataclass, field

from dissectors.frame import Chunk

HAS_PTY = os.name == "posix" and sys.platform not in ("emscripten", "wasi")
UNREAD = 1 << 20  # octets that a memory port keeps for a reader that does not come


@dataclass(slots=True)
class Port:
    """A party or a tap. `echo`: it hears itself; `answers`: the faults of answers may strike it.

    `written`, `delivered`, `unread`: octets that it sent, that it got, that it lost because nobody read it.
    """

    name: str
    tap: bool
    echo: bool = False
    answers: bool = False
    written: int = 0
    delivered: int = 0
    unread: int = 0

    @property
    def address(self) -> str:
        """What a program opens: a path or a URL; empty for memory."""
        return ""

    def descriptors(self) -> list[int]:
        """What to wait on for reading."""
        return []

    def put(self, chunk: Chunk) -> None:
        """Give octets to the listener."""
        done = self._pass_on(chunk)
        self.delivered += done
        self.unread += len(chunk.octets) - done

    def take(self, descriptor: int) -> bytes:
        """Octets that the party sent, empty for none."""
        return b""

    def close(self) -> None:
        """Give back what it holds; whoever has it open sees it hang up."""

    def _pass_on(self, chunk: Chunk) -> int:
        """Octets taken."""
        raise NotImplementedError


@dataclass(slots=True)
class MemoryPort(Port):
    """Chunks with their line errors, fetched by the other side of the control connection."""

    waiting: deque[Chunk] = field(default_factory=deque)
    held: int = 0

    def fetch(self) -> list[Chunk]:
        """What waits."""
        chunks = list(self.waiting)
        self.waiting.clear()
        self.held = 0
        return chunks

    def _pass_on(self, chunk: Chunk) -> int:
        if self.held >= UNREAD:
            return 0
        self.waiting.append(chunk)
        self.held += len(chunk.octets)
        return len(chunk.octets)


@dataclass(slots=True)
class PtyPort(Port):
    """A pseudo-terminal that passes octets as they are. Its slave stays open here, so that its settings survive and
    the master never reads end of file.
    """

    link: str = ""
    master: int = -1
    slave: int = -1

    def open(self) -> PtyPort:
        """Make it, and the symbolic link `link` to it if that is not empty. Raises OSError."""
        import pty
        import tty

        self.master, self.slave = pty.openpty()
        tty.setraw(self.slave)
        os.set_blocking(self.master, False)
        if self.link:
            try:
                os.symlink(os.ttyname(self.slave), self.link)
            except OSError:
                self.link = ""
                self.close()
                raise
        return self

    @property
    def address(self) -> str:
        return self.link or os.ttyname(self.slave)

    def descriptors(self) -> list[int]:
        return [self.master]

    def take(self, descriptor: int) -> bytes:
        with contextlib.suppress(OSError):
            return os.read(self.master, 65536)
        return b""

    def close(self) -> None:
        if self.link:
            with contextlib.suppress(OSError):
                os.unlink(self.link)
        for descriptor in (self.master, self.slave):
            if descriptor >= 0:
                os.close(descriptor)
        self.master = self.slave = -1

    def _pass_on(self, chunk: Chunk) -> int:
        try:
            return os.write(self.master, chunk.octets)
        except BlockingIOError:
            return 0


@dataclass(slots=True)
class GatewayPort(Port):
    """A serial device server on this machine: raw TCP, one connection at a time, the newest wins."""

    server: socket.socket | None = None
    client: socket.socket | None = None

    def open(self) -> GatewayPort:
        """Listen on a free port of the loopback interface. Raises OSError."""
        self.server = socket.create_server(("127.0.0.1", 0))
        self.server.setblocking(False)
        return self

    @property
    def address(self) -> str:
        assert self.server is not None
        return f"socket://127.0.0.1:{self.server.getsockname()[1]}"

    def descriptors(self) -> list[int]:
        return [one.fileno() for one in (self.server, self.client) if one is not None]

    def take(self, descriptor: int) -> bytes:
        if self.server is not None and descriptor == self.server.fileno():
            self._greet()
            return b""
        if self.client is None:
            return b""
        try:
            octets = self.client.recv(65536)
        except BlockingIOError:
            return b""
        except OSError:
            octets = b""
        if not octets:
            self._hang_up()
        return octets

    def close(self) -> None:
        self._hang_up()
        if self.server is not None:
            self.server.close()
            self.server = None

    def put(self, chunk: Chunk) -> None:
        if self.client is not None:  # else nobody gets anything, and nobody loses anything
            Port.put(self, chunk)

    def _pass_on(self, chunk: Chunk) -> int:
        if self.client is None:
            return 0
        try:
            return self.client.send(chunk.octets)
        except BlockingIOError:
            return 0
        except OSError:
            self._hang_up()
            return 0

    def _greet(self) -> None:
        assert self.server is not None
        with contextlib.suppress(OSError):
            client, _ = self.server.accept()
            client.setblocking(False)
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._hang_up()
            self.client = client

    def _hang_up(self) -> None:
        if self.client is not None:
            self.client.close()
            self.client = None
