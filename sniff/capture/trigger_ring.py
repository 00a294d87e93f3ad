"""A ring in front of a recorder: only what surrounds a trigger is recorded, the rest is counted.

What a bus gives waits in memory for as long as it may still be wanted. When a trigger fires, what came within `before`
of it is recorded, and so is all until `after` it; stretches that overlap are one. Where something was left out an
OMITTED event says how much, so that nothing is paired across it.
"""

from __future__ import annotations

from collections import deque

from dissectors.frame import Chunk
from sniff.engine.session import Item, LineEvent, LineEventKind
from sniff.recording.writer import Recorder

LATE = 5_000_000_000
"""ns by which a trigger may be late: whoever watches looks at what came together, and waits for answers."""

MOST = 64 << 20
"""Octets that wait at most, whatever `before` says."""

_ITEM = 120
"""Octets of memory that an item takes besides its octets."""


class TriggerRing:
    """Takes what a recorder takes. `before`, `after`: ns. `omitted`: octets that were not kept, in all."""

    def __init__(self, recorder: Recorder, before: int, after: int) -> None:
        self.recorder = recorder
        self.omitted = 0
        self._before, self._after = before, after
        self._waiting: deque[Item] = deque()
        self._size = 0
        self._gap = 0  # octets left out since the last that was kept
        self._is_full = False  # some of them although a trigger might still have asked for them
        self._until: int | None = None  # all is kept up to then
        self._kept = 0  # time of the newest that was
        self._left = 0  # of the newest that was not

    def take(self, item: Item) -> None:
        """A read or an event, in order of time."""
        if self._until is not None and item.time <= self._until:
            self._keep(item)
            return
        self._waiting.append(item)
        self._size += _weight(item)
        while self._waiting and (self._waiting[0].time < item.time - self._before - LATE or self._size > MOST):
            self._is_full = self._is_full or self._waiting[0].time >= item.time - self._before - LATE
            self._let_go(self._waiting.popleft())

    def fire(self, time: int, text: str) -> None:
        """A trigger: `time` is when what it fired on happened, ns; `text` says what it was."""
        while self._waiting and self._waiting[0].time < time - self._before:
            self._let_go(self._waiting.popleft())
        until = time + self._after
        told = False
        while self._waiting and self._waiting[0].time <= until:
            item = self._waiting.popleft()
            self._size -= _weight(item)
            if not told and item.time > time:
                told = True
                self._tell(time, text)
            self._keep(item)
        if not told:
            self._tell(time, text)
        self._until = until if self._until is None else max(self._until, until)

    def keeps(self, time: int) -> bool:
        """Whether what happens at that time (ns) is recorded as things are."""
        return self._until is not None and time <= self._until

    def _tell(self, time: int, text: str) -> None:
        self._keep(LineEvent(max(time, self._kept), LineEventKind.TRIGGER, text))

    def finish(self) -> None:
        """What still waits was not wanted."""
        while self._waiting:
            self._let_go(self._waiting.popleft())
        self._say_gap(None)

    def _let_go(self, item: Item) -> None:
        self._size -= _weight(item)
        if isinstance(item, Chunk):
            self._gap += len(item.octets)
            self.omitted += len(item.octets)
            self._left = item.time
        else:  # there are few, and without them what follows is not understood
            self._keep(item)

    def _keep(self, item: Item) -> None:
        self._kept = max(self._kept, item.time)
        if isinstance(item, Chunk):
            self._say_gap(item.time)
            self.recorder.chunk(item)
        else:
            self.recorder.line(item)

    def _say_gap(self, time: int | None) -> None:
        if self._gap:
            why = "more came before a trigger than memory holds" if self._is_full else "no trigger fired"
            text = f"{self._gap} octets not kept: {why}"
            at = self._left if time is None else time
            self.recorder.line(LineEvent(at, LineEventKind.OMITTED, text, self._gap))
            self._gap, self._is_full = 0, False


def _weight(item: Item) -> int:
    return _ITEM + (len(item.octets) if isinstance(item, Chunk) else len(item.text))
