"""Chunks and events to /raw and /line messages.

Marks, events and continuations of a batch are written just before it, so that a reader joins them in one pass
(`joiner.py`):

* a mark is a /line message with the number of its entry and the offset in it;
* an event carries the number of the entry that comes next, which keeps its place among chunks of the same time;
* a chunk over 65535 octets is several entries of one time, the later ones marked `continued`.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

from dissectors.frame import Chunk, Mark
from sniff.engine.session import LineEvent
from sniff.recording.batch import LONGEST, packed
from sniff.recording.line_messages import continued_record, event_record, line_message, mark_record
from sniff.recording.topic_message import Message, stamp
from sniff.recording.topics import RAW

MOST_CHUNKS = 256
MOST_TIME = 900_000_000  # ns
MOST_OCTETS = 1 << 20
MOST_CHUNK = 16 << 20  # octets

_I64 = 1 << 63


class Batcher:
    """Collects chunks and events into messages. `first`: number of the next entry."""

    def __init__(self, first: int = 0) -> None:
        self.next = first
        self._line_number = 0
        self._clear()

    @property
    def first(self) -> int:
        """Number of the first entry not yet given out."""
        return self.next - len(self._times)

    def add(self, chunk: Chunk) -> list[Message]:
        """Take a chunk; give the messages of a batch that it closed. An empty chunk says nothing.

        A chunk over `MOST_CHUNK` (no read returns that much) becomes several of the same time.
        """
        octets = chunk.octets
        if len(octets) > MOST_CHUNK:
            return [message for part in _cut(chunk) for message in self.add(part)]
        if not octets:
            return []
        time = chunk.time if -_I64 <= chunk.time < _I64 else min(max(chunk.time, -_I64), _I64 - 1)
        given = self.close() if self._times and not self._fits(time) else []
        self._entry(time, octets[:LONGEST])
        for start in range(LONGEST, len(octets), LONGEST):
            self._line(time, continued_record(self.next))
            self._entry(time, octets[start : start + LONGEST])
        for mark in chunk.marks:
            self._mark(time, mark, len(octets))
        return given

    def add_event(self, event: LineEvent) -> None:
        """Take an event of the line; it goes out with the batch."""
        self._line(event.time, event_record(event, self.next))

    def close(self) -> list[Message]:
        """The messages of what was collected, marks and events first."""
        messages = self._lines
        if self._times:
            first = self._times[0]
            count = len(self._times)
            steps = struct.pack(f"<{count}I", *(time - first for time in self._times))
            sizes = struct.pack(f"<{count}H", *map(len, self._octets))
            data = packed(count, first, steps, sizes, self._octets)
            sequence = (self.next - count) % (1 << 32)
            messages.append(Message(RAW, stamp(self._times[-1]), stamp(first), sequence, data))
        self._clear()
        return messages

    def _clear(self) -> None:
        self._times: list[int] = []
        self._octets: list[bytes] = []
        self._held = 0
        self._lines: list[Message] = []

    def take(self) -> tuple[list[int], list[bytes]]:
        """Times and octets of the entries of the batch that is open, which no entry is in any more. Its marks and
        events stay, for the message that these entries are in after all."""
        entries = self._times, self._octets
        self._times, self._octets, self._held = [], [], 0
        self.next -= len(entries[0])
        return entries

    def closed(self, data: bytes, count: int, first: int, last: int) -> list[Message]:
        """The messages of a batch whose `count` entries, read from `first` to `last` (ns), are packed already: those
        that follow."""
        messages, self._lines = self._lines, []
        messages.append(Message(RAW, stamp(last), stamp(first), self.next % (1 << 32), data))
        self.next += count
        return messages

    def _fits(self, time: int) -> bool:
        """Whether a chunk of that time may join the batch: none is earlier than the one before it."""
        return (
            len(self._times) < MOST_CHUNKS
            and self._held < MOST_OCTETS
            and self._times[-1] <= time <= self._times[0] + MOST_TIME
        )

    def _entry(self, time: int, octets: bytes) -> None:
        self._times.append(time)
        self._octets.append(octets)
        self._held += len(octets)
        self.next += 1

    def _mark(self, time: int, mark: Mark, length: int) -> None:
        pieces = (length + LONGEST - 1) // LONGEST
        piece = min(max(mark.offset, 0) // LONGEST, pieces - 1)
        self._line(time, mark_record(mark.error, self.next - pieces + piece, mark.offset - piece * LONGEST))

    def _line(self, time: int, record: dict[str, object]) -> None:
        self._lines.append(line_message(time, record, self._line_number % (1 << 32)))
        self._line_number += 1


def _cut(chunk: Chunk) -> Iterator[Chunk]:
    for start in range(0, len(chunk.octets), MOST_CHUNK):
        end = start + MOST_CHUNK
        marks = tuple(Mark(mark.offset - start, mark.error) for mark in chunk.marks if start <= mark.offset < end)
        yield Chunk(chunk.time, chunk.octets[start:end], marks)
