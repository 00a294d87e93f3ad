"""Counts the frames of a capture beside it, where a number of them is its limit: whatever becomes of the main process.

It has a thread of its own, since the reader waits for nobody, and takes what it is given in order; when it cannot keep
up it counts fewer frames than there are.
"""

from __future__ import annotations

import threading
from queue import SimpleQueue

from dissectors.frame import Frame
from sniff.engine.engine import Output
from sniff.engine.follow_settings import SessionEngine
from sniff.engine.session import Item, Session

MOST_WAITING = 4 << 20
"""Octets of the bus that wait to be looked at."""


class FrameCounter:
    """Counts the frames of one bus. `frames`: so far."""

    def __init__(self, session: Session) -> None:
        self.frames = 0
        self._engine = SessionEngine(session, pairing=False)
        self._queue: SimpleQueue[Item | int] = SimpleQueue()
        self._given = self._taken = 0
        threading.Thread(target=self._run, name="counter", daemon=True).start()

    def item(self, item: Item) -> None:
        """Take a read or what happened to the line."""
        octets = len(getattr(item, "octets", b""))
        if self._given - self._taken <= MOST_WAITING:
            self._given += octets
            self._queue.put(item)

    def advance(self, now: int) -> None:
        """Everything up to then (ns) was given."""
        if self._queue.empty():
            self._queue.put(now)

    def _run(self) -> None:
        while True:
            item = self._queue.get()
            if isinstance(item, int):
                self._count(self._engine.advance(item))
            else:
                self._count(self._engine.take(item))
                self._taken += len(getattr(item, "octets", b""))

    def _count(self, output: Output) -> None:
        self.frames += sum(isinstance(row.event, Frame) for row in output.rows)
