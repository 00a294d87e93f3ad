"""The way to the main process: never waited for, bounded, and honest about what it dropped."""

from __future__ import annotations

import contextlib
import socket
import time
from collections import deque

from dissectors.frame import Chunk
from sniff.capture.ipc import A_READ, encode_item, encode_reads, gap_event
from sniff.engine.session import Item

BACKLOG = 2 * 1024 * 1024
"""Octets of messages held for a reader that is behind (9 s of ten buses at 115200 Bd); more are dropped."""

AT_ONCE = 256 * 1024
"""Octets given to the connection in one call, and asked for as its buffer."""


TOGETHER = 64 * 1024
"""Octets of reads of one bus that become one message."""


class IpcSender:
    """Sends messages over a connection; reads of a bus that follow one another go together. `dropped[bus]`: octets of
    the line that were not sent; `gathered`: octets of messages since the last `flush`."""

    def __init__(self, connection: socket.socket, buses: int, backlog: int = BACKLOG) -> None:
        self._connection: socket.socket | None = connection.dup()  # closed here; others may still wait on theirs
        self._backlog = backlog
        self._parts: deque[bytes] = deque()
        self._size = 0
        self.gathered = 0
        self._reads: list[list[Chunk]] = [[] for _ in range(buses)]  # that are no message yet
        self._unsealed = [0] * buses  # octets that they will take
        self._gap: list[int | None] = [None] * buses  # octets dropped since the last that were sent; None: nothing was
        self.dropped = [0] * buses
        connection.setblocking(False)
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, AT_ONCE)

    @property
    def open(self) -> bool:
        """Whether anybody may still read."""
        return self._connection is not None

    @property
    def size(self) -> int:
        """Octets held."""
        return self._size

    def item(self, bus: int, item: Item) -> None:
        """Send a chunk or line event, unless the reader is too far behind."""
        if self._connection is None:
            return
        octets = item.octets if isinstance(item, Chunk) else b""
        gap = self._gap[bus]
        if self._size > self._backlog or (gap is not None and self._size > self._backlog // 2):
            self._gap[bus] = (gap or 0) + len(octets)
            self.dropped[bus] += len(octets)
            return
        if gap is not None:
            self.post(encode_item(bus, gap_event(item.time, gap)))
            self._gap[bus] = None
        if isinstance(item, Chunk) and octets and not item.marks:
            taken = len(octets) + A_READ
            self._reads[bus].append(item)
            self._unsealed[bus] += taken
            self._size += taken
            self.gathered += taken
            if self._unsealed[bus] > TOGETHER:
                self._seal(bus)
            return
        self.post(encode_item(bus, item))

    def droppable(self, message: bytes) -> None:
        """Send a message that the next one of its kind replaces."""
        if self._size <= self._backlog:
            self.post(message)

    def post(self, message: bytes) -> None:
        """Send a message that must arrive; `flush` does it."""
        self._seal_all()
        self._add(message)

    def _add(self, message: bytes) -> None:
        if self._connection is not None:
            self._parts.append(message)
            self._size += len(message)
            self.gathered += len(message)

    def _seal_all(self) -> None:
        for bus, reads in enumerate(self._reads):
            if reads:
                self._seal(bus)

    def _seal(self, bus: int) -> None:
        """Make a message of the reads of a bus."""
        reads, self._reads[bus] = self._reads[bus], []
        self._size -= self._unsealed[bus]
        self._unsealed[bus] = 0
        self._add(encode_reads(bus, reads))

    def flush(self) -> None:
        """Give the connection what it takes now."""
        self._seal_all()
        self.gathered = 0
        while self._parts and self._connection is not None:
            data = self._next_parts()
            try:
                taken = self._connection.send(data)
            except BlockingIOError:
                taken = 0
            except OSError:
                return self.close()
            self._size -= taken
            if taken < len(data):
                self._parts.appendleft(data[taken:])
                return None
        return None

    def _next_parts(self) -> bytes:
        """Take the oldest messages, about AT_ONCE octets of them: of a long backlog nothing else is copied."""
        taken, size = [], 0
        while self._parts and size < AT_ONCE:
            taken.append(self._parts.popleft())
            size += len(taken[-1])
        return taken[0] if len(taken) == 1 else b"".join(taken)

    def finish(self, message: bytes, patience: float) -> None:
        """Send a last message and close; a reader that does not read is waited for `patience` seconds."""
        self.post(message)
        until = time.monotonic() + patience
        self.flush()
        while self._size and time.monotonic() < until:
            time.sleep(0.02)
            self.flush()
        self.close()

    def close(self) -> None:
        """Nobody reads any more: forget what was held."""
        connection, self._connection = self._connection, None
        self._parts.clear()
        self._reads = [[] for _ in self._reads]
        self._unsealed = [0] * len(self._unsealed)
        self._size = 0
        if connection is not None:
            with contextlib.suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)
            connection.close()
