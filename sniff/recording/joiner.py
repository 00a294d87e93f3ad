"""Puts /raw and /line messages together again: chunks with their marks, and events in their places (`batcher.py`)."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator

from dissectors.frame import Chunk, Mark
from sniff.engine.session import Item, LineEvent, LineEventKind
from sniff.recording.batch import Batch
from sniff.recording.line_messages import LineMessage

_MOST_PENDING = 100_000  # /line messages kept for entries still to come


class Joiner:
    """Puts /raw and /line messages together again, in the order of the file.

    `next`: number of the entry that comes next, None while unknown. `missing`: entries that the numbering shows to be
    lost. `backward`: batches numbered below the one before them. `strange`: /line messages that belong to no octet.
    """

    def __init__(self, first: int | None = None) -> None:
        self.next = first
        self.missing = 0
        self.backward = 0
        self.strange = 0
        self._marks: dict[int, list[Mark]] = {}
        self._continued: set[int] = set()
        self._told: dict[int, int] = {}  # entry → how many before it the recorder itself says are missing
        self._events: deque[tuple[int, LineEvent]] = deque()
        self._order: deque[int] = deque()  # numbers of entries that marks and continuations wait for

    def line(self, log_time: int, data: bytes) -> None:
        """Take a /line message; total."""
        message = LineMessage.decode(data)
        if message is None or len(self._order) + len(self._events) >= _MOST_PENDING:
            self.strange += 1
            return
        number = message.number
        if (event := message.event(log_time)) is not None:
            if message.reads > 0 and len(self._told) < _MOST_PENDING:
                self._told[number] = message.reads
            self._events.append((number, event))
        elif message.is_continued:
            self._continued.add(number)
            self._order.append(number)
        elif (mark := message.mark()) is not None:
            self._order.append(number)
            self._marks.setdefault(number, []).append(mark)
        else:
            self.strange += 1

    def raw(self, sequence: int, batch: Batch) -> Iterator[Item]:
        """Give the items of a /raw message; a hole in the numbering is a DROPPED event."""
        number = self._number(sequence)
        many = self._hole(sequence, batch)
        if many:
            yield from self._before(number - many)
        many -= min(many, self._told.pop(number, 0))
        if many:
            text = f"{many} read{'s' if many != 1 else ''} missing from the recording"
            yield LineEvent(batch.start, LineEventKind.DROPPED, text, -1)
        if self._order or self._events:
            yield from self._joined(number, batch)
        else:
            yield from batch.chunks()

    def follows(self, sequence: int, count: int) -> bool:
        """Take `count` entries of /raw messages that follow one another, chunks as they are, with nothing before or
        between them; False, and they are not taken, for any others."""
        if self._order or self._events or self._told or (self.next is not None and self._number(sequence) != self.next):
            return False
        self.next = self._number(sequence) + count
        return True

    def skip(self, sequence: int, batch: Batch) -> None:
        """Take a /raw message for its numbering only."""
        if self._order or self._events:
            for _ in self.raw(sequence, batch):
                pass
        else:
            self._hole(sequence, batch)

    def close(self) -> Iterator[Item]:
        """End of the file: the events that no chunk followed."""
        while self._events:
            yield self._events.popleft()[1]

    def _hole(self, sequence: int, batch: Batch) -> int:
        """How many entries are missing before a batch."""
        number = self._number(sequence)
        expected = number if self.next is None else self.next
        self.next = number + batch.count
        self.backward += number < expected
        many = max(0, number - expected)
        self.missing += many
        return many

    def _number(self, sequence: int) -> int:
        """The full number of a sequence of 32 bits: the nearest to what is expected."""
        if self.next is None:
            return sequence
        ahead = (sequence - self.next) % (1 << 32)
        return (
            self.next + ahead if ahead < (1 << 31) or self.next + ahead < (1 << 32) else self.next + ahead - (1 << 32)
        )

    def _joined(self, number: int, batch: Batch) -> Iterator[Item]:
        """Entries of a batch with their marks, continuations joined, each after the events before it."""
        pieces: list[bytes] = []
        marks: list[Mark] = []
        time = held = 0
        for entry_time, octets in batch.entries():
            if not (number in self._continued and pieces):
                yield from self._whole(time, pieces, marks)
                yield from self._before(number)
                pieces, marks, time, held = [], [], entry_time, 0
            marks.extend(Mark(mark.offset + held, mark.error) for mark in self._marks.pop(number, ()))
            pieces.append(octets)
            held += len(octets)
            number += 1
        yield from self._whole(time, pieces, marks)
        self._forget(number)

    def _whole(self, time: int, pieces: list[bytes], marks: list[Mark]) -> Iterator[Chunk]:
        octets = b"".join(pieces)
        good = tuple(mark for mark in marks if 0 <= mark.offset < len(octets))
        self.strange += len(marks) - len(good)
        if octets:
            yield Chunk(time, octets, good)

    def _before(self, number: int) -> Iterator[LineEvent]:
        while self._events and self._events[0][0] <= number:
            yield self._events.popleft()[1]

    def _forget(self, number: int) -> None:
        """Drop what belongs to entries that have passed, in the order in which it came."""
        self._told.clear()
        while self._order and self._order[0] < number:
            late = self._order.popleft()
            self._continued.discard(late)
            self.strange += len(self._marks.pop(late, ()))
