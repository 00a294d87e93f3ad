"""A large recording in pieces of bounded size, so that many workers share it; their results put together again.

Cut is in the longest silence near the place. A piece is read from some time before it to some time after it, and only
the rows that began in it are counted, with what they closed: by then the framer is in step and the tracker knows the
bus, so rows, verdicts and counts are those of the whole. Rules judge each piece by itself (`sniff.analysis.judgement`
says what that means); frame numbers, their evidence, are counted from the begin of a piece.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from sniff.engine.blocks import Block
from sniff.engine.capture import Capture, CaptureError
from sniff.engine.session import Completeness, Item, LineEvent, Session
from sniff.fleet.archive import NS_PER_S, Task, Window, opened
from sniff.fleet.bus_day import BusDay, Key
from sniff.recording.reader import McapCapture
from sniff.recording.rotated import RotatedCapture

MOST = 64 << 20
"""Octets of files that are read in one go: some 20 s of a core."""

BEFORE = 120 * NS_PER_S
"""What is read before a piece, so that it is read as in the whole."""

AFTER = 20 * NS_PER_S
"""What is read after it, so that whatever began in it is complete."""


def cut(task: Task, most: int = MOST) -> list[Task]:
    """The task in pieces of about `most` octets; itself where it is small, or where a cut would change what is read:
    while settings are searched for, where times run backwards, in formats that have no index."""
    if task.size <= most:
        return [task]
    try:
        parts = _parts(task)
    except (CaptureError, OSError, StopIteration):
        return [task]  # whoever reads it will say why
    edges = _edges(parts, most)
    return [replace(task, window=Window(*ends)) for ends in pairwise((None, *edges, None))] if edges else [task]


def _parts(task: Task) -> Sequence[McapCapture]:
    captures = opened(task)
    if len(captures) != 1:
        return ()
    capture = captures[0]
    parts = capture.parts if isinstance(capture, RotatedCapture) else (capture,)
    recordings = [part for part in parts if isinstance(part, McapCapture) and not part.session.unknown]
    return recordings if len(recordings) == len(parts) else ()


def _edges(parts: Sequence[McapCapture], most: int) -> list[int]:
    """Times at which to cut, ascending; none where times run backwards."""
    edges: list[int] = []
    room, latest = most, 0
    for part in parts:
        index = part.chunk_index()
        if index.backward or (index.latest and index.latest[0] < latest):
            return []
        at = 0
        for offset, end in zip(index.offsets, index.latest, strict=True):
            room -= offset - at
            at = offset
            if room <= 0:
                edge = _silence(part, end)
                if edge is not None and (not edges or edge > edges[-1]):
                    edges.append(edge)
                room = most
        latest = index.latest[-1] if index.latest else latest
        room -= max(0, part.path.stat().st_size - at)
    return edges


def _silence(part: McapCapture, time: int) -> int | None:
    """The middle of the longest silence in the reads from a time on."""
    batch = next((one for one in part.batches(time) if one.count > 1), None)
    if batch is None:
        return None
    steps = np.frombuffer(batch.steps, "<u4").astype(np.int64)
    longest = int(np.argmax(np.diff(steps)))
    return batch.start + int(steps[longest] + steps[longest + 1]) // 2


@dataclass(slots=True)
class Stretch:
    """A capture from some time before a window until some time after it. A `Capture`."""

    session: Session
    parts: tuple[McapCapture, ...]
    window: Window

    def items(self) -> Iterator[Item]:
        """Chunks and line events. Raises CaptureError."""
        for item in self.parts[0].items(self._since, self.parts[1:]):
            if self._is_past(item.time):
                return
            yield item

    def blocks(self) -> Iterator[Block | LineEvent]:
        """The same as columns. Raises CaptureError."""
        for item in self.parts[0].blocks(self._since, self.parts[1:]):
            time = item.time if isinstance(item, LineEvent) else int(item.reads.times[0])
            if self._is_past(time):
                return
            yield item

    def completeness(self) -> Completeness:
        """Of the whole, told by the last piece only."""
        if self.window.end is not None:
            return Completeness(True, "")
        return RotatedCapture(self.parts).completeness() if len(self.parts) > 1 else self.parts[0].completeness()

    @property
    def _since(self) -> int | None:
        return None if self.window.begin is None else self.window.begin - BEFORE

    def _is_past(self, time: int) -> bool:
        return self.window.end is not None and time >= self.window.end + AFTER


def stretches(task: Task) -> list[Capture]:
    """What a task reads: its captures whole, or its piece of the only one. Raises CaptureError."""
    if task.window is None:
        return opened(task)
    (capture,) = opened(task)
    parts = capture.parts if isinstance(capture, RotatedCapture) else (capture,)
    return [Stretch(capture.session, tuple(part for part in parts if isinstance(part, McapCapture)), task.window)]


def together(days: Iterable[BusDay]) -> list[BusDay]:
    """What the pieces of one task gave, as if it had been read in one go."""
    made: dict[Key, BusDay] = {}
    for day in sorted(days, key=lambda one: one.first or 0):
        known = made.get(day.key)
        made[day.key] = day if known is None else known.merge(day)
    return [replace(day, listened=(day.last or 0) - (day.first or 0)) for day in made.values()]
