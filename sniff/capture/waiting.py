"""Waiting for any of several descriptors, each with what is to be done then: as cheap as the system allows.

It is done for every read of a busy bus: what `selectors` makes of each wake costs as much as the read.
"""

from __future__ import annotations

import select
import selectors
from collections.abc import Callable

Call = Callable[[], object]


class Waiting:
    """Descriptors and calls. A descriptor that was closed meanwhile is unregistered without complaint."""

    def __init__(self) -> None:
        self._calls: dict[int, Call] = {}
        self._epoll = select.epoll() if hasattr(select, "epoll") else None
        self._selector = selectors.DefaultSelector() if self._epoll is None else None

    def register(self, fd: int, call: Call) -> None:
        """Call it whenever there is something to be read."""
        self._calls[fd] = call
        if self._epoll is not None:
            self._epoll.register(fd, select.EPOLLIN)
        elif self._selector is not None:
            self._selector.register(fd, selectors.EVENT_READ)

    def unregister(self, fd: int) -> None:
        """Forget it; one that is not known is none."""
        if self._calls.pop(fd, None) is None:
            return
        try:
            if self._epoll is not None:
                self._epoll.unregister(fd)
            elif self._selector is not None:
                self._selector.unregister(fd)
        except (KeyError, ValueError, OSError):  # it was closed
            return

    def wait(self, seconds: float) -> list[tuple[int, Call]]:
        """Descriptors with something to be read, or that are gone, and their calls; after at most so long."""
        if self._epoll is not None:
            ready = self._epoll.poll(seconds)
        else:
            assert self._selector is not None
            ready = [(key.fd, 0) for key, _ in self._selector.select(seconds)]
        calls = self._calls
        return [(fd, calls[fd]) for fd, _ in ready if fd in calls]
