"""Chunks to /raw and /line messages and back: the layout that `topics.RAW_LAYOUT` describes.

Marks, events and continuations of a batch are written just before it, so that a reader joins them in one pass:

* a mark is a /line message with the number of its entry and the offset in it;
* an event carries the number of the entry that comes next, which keeps its place among chunks of the same time;
* a chunk over 65535 octets is several entries of one time, the later ones marked `continued`.
"""

from __future__ import annotations

import json
import struct
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import TYPE_CHECKING

from dissectors.frame import Chunk, LineError, Mark
from sniff.engine.session import Item, LineEvent, LineEventKind
from sniff.recording.topics import LINE, RAW

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

MOST_CHUNKS = 256
MOST_TIME = 900_000_000  # ns
MOST_OCTETS = 1 << 20
MOST_CHUNK = 16 << 20  # octets
LONGEST = 65535  # octets of one entry
CONTINUED = "continued"
READS = "reads"

_HEAD = struct.Struct("<Iq")
_STEP = 4096  # entries unpacked at a time: a batch of millions from a hostile file costs no more
_LONGEST_LINE = 1 << 16  # octets of a /line message worth reading
_MOST_PENDING = 100_000  # /line messages kept for entries still to come
_I64 = 1 << 63
_U64 = 1 << 64


@dataclass(frozen=True, slots=True)
class Message:
    """One MCAP message before it has a channel number; times in ns, 0 … 2⁶⁴-1."""

    topic: str
    log_time: int
    publish_time: int
    sequence: int
    data: bytes


def stamp(time: int) -> int:
    """A time as MCAP can hold it."""
    return min(max(time, 0), _U64 - 1)


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
            self._line(time, {"kind": CONTINUED, "chunk": self.next})
            self._entry(time, octets[start : start + LONGEST])
        for mark in chunk.marks:
            self._mark(time, mark, len(octets))
        return given

    def add_event(self, event: LineEvent) -> None:
        """Take an event of the line; it goes out with the batch."""
        self._line(event.time, _event_record(event, self.next))

    def close(self) -> list[Message]:
        """The messages of what was collected, marks and events first."""
        messages = self._lines
        if self._times:
            first = self._times[0]
            count = len(self._times)
            data = b"".join(
                (
                    _HEAD.pack(count, first),
                    struct.pack(f"<{count}I", *(time - first for time in self._times)),
                    struct.pack(f"<{count}H", *map(len, self._octets)),
                    *self._octets,
                )
            )
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
        record = {
            "kind": mark_name(mark.error),
            "chunk": self.next - pieces + piece,
            "offset": mark.offset - piece * LONGEST,
        }
        self._line(time, record)

    def _line(self, time: int, record: dict[str, object]) -> None:
        data = json.dumps(record, separators=(",", ":")).encode()
        self._lines.append(Message(LINE, stamp(time), stamp(time), self._line_number % (1 << 32), data))
        self._line_number += 1


def _cut(chunk: Chunk) -> Iterator[Chunk]:
    for start in range(0, len(chunk.octets), MOST_CHUNK):
        end = start + MOST_CHUNK
        marks = tuple(Mark(mark.offset - start, mark.error) for mark in chunk.marks if start <= mark.offset < end)
        yield Chunk(chunk.time, chunk.octets[start:end], marks)


def mark_name(error: LineError) -> str:
    """ "parity", "parity+framing" …"""
    return "+".join(flag.name.lower() for flag in error if flag.name) or "none"


_MARK_FLAGS = {flag.name.lower(): flag for flag in LineError if flag.name}
_EVENT_KINDS = {kind.value: kind for kind in LineEventKind}


def mark_error(name: str) -> LineError | None:
    """What `mark_name` wrote; None for what is no mark."""
    error = LineError(0)
    for word in name.split("+"):
        if word not in _MARK_FLAGS:
            return LineError(0) if name == "none" else None
        error |= _MARK_FLAGS[word]
    return error


# -- back ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Batch:
    """A /raw message whose sizes add up: `count` entries read from `start` (ns) on."""

    count: int
    start: int
    data: bytes

    @classmethod
    def decode(cls, data: bytes) -> Batch | None:
        """None when the sizes contradict each other."""
        if len(data) < _HEAD.size:
            return None
        count, start = _HEAD.unpack_from(data)
        body = len(data) - _HEAD.size - 6 * count
        if body < 0:
            return None
        batch = cls(count, start, data)
        return batch if batch._octets() == body else None

    @property
    def octets(self) -> bytes:
        """The octets of all entries."""
        return self.data[_HEAD.size + 6 * self.count :]

    @property
    def steps(self) -> bytes:
        """ns after `start`, of each entry, u32."""
        return self.data[_HEAD.size : _HEAD.size + 4 * self.count]

    @property
    def sizes(self) -> bytes:
        """Octets of each entry, u16."""
        return self.data[_HEAD.size + 4 * self.count : _HEAD.size + 6 * self.count]

    def times(self) -> npt.NDArray[np.int64]:
        """ns since the epoch, of each entry."""
        import numpy as np

        return self.start + np.frombuffer(self.data, "<u4", self.count, _HEAD.size).astype(np.int64)

    def lengths(self) -> npt.NDArray[np.uint16]:
        """Octets of each entry."""
        import numpy as np

        return np.frombuffer(self.data, "<u2", self.count, _HEAD.size + 4 * self.count)

    def entries(self) -> Iterator[tuple[int, bytes]]:
        """Time (ns) and octets of each entry."""
        for times, octets in self._entries():
            yield from zip(times, octets, strict=True)

    def chunks(self) -> Iterator[Chunk]:
        """The entries as chunks without marks; empty ones (a foreign file's) left out."""
        for times, octets in self._entries():
            if all(octets):
                yield from map(Chunk, times, octets)
            else:
                yield from (Chunk(time, some) for time, some in zip(times, octets, strict=True) if some)

    def _entries(self) -> Iterator[tuple[list[int], list[bytes]]]:
        data, start = self.data, self.start
        at = _HEAD.size + 6 * self.count
        for steps, lengths in self._columns():
            ends = list(accumulate(lengths, initial=at))
            yield [start + step for step in steps], [data[first:end] for first, end in pairwise(ends)]
            at = ends[-1]

    def _octets(self) -> int:
        """How many octets the entries claim."""
        lengths = _HEAD.size + 4 * self.count
        if self.count <= _STEP:
            return sum(struct.unpack_from(f"<{self.count}H", self.data, lengths))
        return sum(sum(some) for _, some in self._columns())

    def _columns(self) -> Iterator[tuple[tuple[int, ...], tuple[int, ...]]]:
        steps = _HEAD.size
        lengths = steps + 4 * self.count
        for first in range(0, self.count, _STEP):
            many = min(_STEP, self.count - first)
            yield (
                struct.unpack_from(f"<{many}I", self.data, steps + 4 * first),
                struct.unpack_from(f"<{many}H", self.data, lengths + 2 * first),
            )


def loss_message(event: LineEvent, number: int, reads: int) -> Message:
    """An event by itself, before the entry with that number: so many entries before it were never written."""
    data = json.dumps(_event_record(event, number) | {READS: reads}, separators=(",", ":")).encode()
    return Message(LINE, stamp(event.time), stamp(event.time), 0, data)


def _event_record(event: LineEvent, number: int) -> dict[str, object]:
    record: dict[str, object] = {"kind": event.kind.value, "chunk": number}
    if event.text:
        record["text"] = event.text
    if event.count:
        record["count"] = event.count
    if stamp(event.time) != event.time:
        record["time_ns"] = event.time
    return record


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
        parsed = _parse(data)
        if parsed is None or len(self._order) + len(self._events) >= _MOST_PENDING:
            self.strange += 1
            return
        kind, number, record = parsed
        if kind in _EVENT_KINDS:
            if (reads := _integer(record.get(READS), 0)) > 0 and len(self._told) < _MOST_PENDING:
                self._told[number] = reads
            self._events.append((number, _event(kind, record, log_time)))
        elif kind == CONTINUED:
            self._continued.add(number)
            self._order.append(number)
        else:
            error = mark_error(kind)
            if error is None:
                self.strange += 1  # a later version may know more kinds
            else:
                self._order.append(number)
                self._marks.setdefault(number, []).append(Mark(_integer(record.get("offset"), 0), error))

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


def line_event(data: bytes, log_time: int) -> LineEvent | None:
    """The event that a /line message is; None for marks, and for what is nothing."""
    parsed = _parse(data)
    if parsed is None or parsed[0] not in _EVENT_KINDS:
        return None
    return _event(parsed[0], parsed[2], log_time)


def _event(kind: str, record: dict[str, object], log_time: int) -> LineEvent:
    text = record.get("text")
    return LineEvent(
        _integer(record.get("time_ns"), log_time),
        _EVENT_KINDS[kind],
        text if isinstance(text, str) else "",
        _integer(record.get("count"), 0),
    )


def _parse(data: bytes) -> tuple[str, int, dict[str, object]] | None:
    """Kind, number of the entry and the whole of a /line message; None when it is none."""
    if len(data) > _LONGEST_LINE:
        return None
    try:
        record = json.loads(data)
    except (ValueError, RecursionError):
        return None
    if not isinstance(record, dict):
        return None
    kind, number = record.get("kind"), _integer(record.get("chunk"), -1)
    return (kind, number, record) if isinstance(kind, str) and number >= 0 else None


def _integer(value: object, default: int) -> int:
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) < _U64:
        return value
    return default
