"""The way to the main process: never waited for, bounded, and honest about what it dropped."""

from __future__ import annotations

import contextlib
import os
from collections import deque

from sniff.capture.wire import encode_item
from sniff.session import Item, LineEvent, LineEventKind

BACKLOG = 4 * 1024 * 1024
"""Octets of messages held for a reader that is behind; more are dropped."""

PIPE_SIZE = 1024 * 1024
_F_SETPIPE_SZ = 1031


class Outlet:
    """Sends messages over a pipe. `dropped[bus]`: octets of the line that were not sent."""

    def __init__(self, fd: int, buses: int, backlog: int = BACKLOG) -> None:
        self._fd: int | None = fd
        self._backlog = backlog
        self._parts: deque[bytes] = deque()
        self._size = 0
        self._gap = [0] * buses  # octets dropped since the last that were sent
        self.dropped = [0] * buses
        os.set_blocking(fd, False)
        _widen(fd)

    @property
    def open(self) -> bool:
        """Whether anybody may still read."""
        return self._fd is not None

    @property
    def size(self) -> int:
        """Octets held."""
        return self._size

    def item(self, bus: int, item: Item) -> None:
        """Send a chunk or line event, unless the reader is too far behind."""
        if self._fd is None:
            return
        octets = getattr(item, "octets", b"")
        if self._size > self._backlog or (self._gap[bus] and self._size > self._backlog // 2):
            self._gap[bus] += max(1, len(octets))
            self.dropped[bus] += len(octets)
            return
        if self._gap[bus]:
            text = "not shown: this side did not keep up; the recording has them"
            self.send(encode_item(bus, LineEvent(item.time, LineEventKind.DROPPED, text, self._gap[bus])))
            self._gap[bus] = 0
        self.send(encode_item(bus, item))

    def droppable(self, message: bytes) -> None:
        """Send a message that the next one of its kind replaces."""
        if self._size <= self._backlog:
            self.send(message)

    def send(self, message: bytes) -> None:
        """Send a message that must arrive; `flush` does it."""
        if self._fd is not None:
            self._parts.append(message)
            self._size += len(message)

    def flush(self) -> None:
        """Give the pipe what it takes now."""
        while self._parts and self._fd is not None:
            data = b"".join(self._parts) if len(self._parts) > 1 else self._parts[0]
            data, rest = data[:PIPE_SIZE], data[PIPE_SIZE:]
            try:
                taken = os.write(self._fd, data)
            except BlockingIOError:
                taken = 0
            except OSError:
                return self.close()
            self._parts.clear()
            left = data[taken:] + rest
            if left:
                self._parts.append(left)
            self._size = len(left)
            if taken < len(data):
                return None
        return None

    def close(self) -> None:
        """Nobody reads any more: forget what was held."""
        fd, self._fd = self._fd, None
        self._parts.clear()
        self._size = 0
        if fd is not None:
            with contextlib.suppress(OSError):
                os.close(fd)


def _widen(fd: int) -> None:
    """A larger pipe, where the system has such a thing."""
    with contextlib.suppress(ImportError, OSError):
        import fcntl

        fcntl.fcntl(fd, _F_SETPIPE_SZ, PIPE_SIZE)
