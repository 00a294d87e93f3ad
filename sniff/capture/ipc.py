"""The messages between the capture process and the main process: compact, bounded, never executed.

      u32 length of what follows    u8 kind    u8 bus    body          little-endian

Both ends are the same version of this program, yet the body of a chunk comes from a line: whatever is malformed raises
IpcError, and nothing longer than LIMIT is ever held.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Any, NamedTuple

from dissectors.frame import Chunk, LineError, Mark
from sniff.engine.session import Item, LineEvent, LineEventKind
from sniff.recording.derived_message import DerivedMessage

if TYPE_CHECKING:
    from sniff.engine.blocks import Block

LIMIT = 16 * 1024 * 1024
"""Longest message, octets."""


class IpcError(ValueError):
    """Octets that are no message of this protocol."""


class IpcKind(IntEnum):
    """What a message is. The first group goes to the main process, the second comes from it."""

    HELLO = 1  # JSON: sessions, pid, priority
    FAILED = 2  # JSON: kind "port" or "capture", text
    CHUNK = 3
    LINE = 4
    TICK = 5
    STATUS = 6  # JSON
    ENDED = 7  # 1 when nothing is left to read, else 0; text
    READS = 8  # of one bus, in which no line error was reported

    CONFIG = 32  # JSON
    DERIVED = 33
    RECONFIGURE = 34  # text: line settings
    STOP = 35
    FOUND = 36  # text: the settings that a search came to, as in `SettingsChange`
    TRIGGER = 37  # i64: when, ns; text: on what
    MARK = 38  # i64: which moment, ns; text
    UNMARK = 39  # the same, without text


class ReceivedMessage(NamedTuple):
    """Something that came from a bus (its index as given at the start), in order of time."""

    bus: int
    item: Item


class HeardOctets(NamedTuple):
    """Reads of a bus, one or more, which follow one another."""

    bus: int
    block: Block


class Tick(NamedTuple):
    """Everything that this bus gave up to `now` (ns, as in its chunks) has been sent before."""

    bus: int
    now: int


@dataclass(frozen=True, slots=True)
class Status:
    """How the capture of one bus is doing, once a second.

    `path`: the file being written, "" for none; `size`: its octets. `octets`: all that came from the line. `dropped`:
    octets that were recorded but not sent here, because this side did not keep up. `lost`: octets that are missing
    from the file, because the disk did not keep up; `taken_away`: those of them that were in a file that somebody
    removed or cut. `priority`: what the system granted. `error`: why nothing is written any more, "" while all is well.
    `behind`: seconds by which the disk is late, 0 while it keeps up. `unwritten`: octets that are not in the file yet.
    `closing`: whether nothing is heard any more, and the rest is being written. `omitted`: octets that no trigger asked
    for, which were not kept.
    """

    bus: int
    path: str = ""
    size: int = 0
    octets: int = 0
    dropped: int = 0
    lost: int = 0
    priority: str = ""
    error: str = ""
    behind: float = 0.0
    unwritten: int = 0
    closing: bool = False
    omitted: int = 0
    taken_away: int = 0


LOSSY = 3
"""Exit code of a capture process that could not record everything."""


@dataclass(frozen=True, slots=True)
class Ended:
    """The capture is over and its files are closed, unless `clean` is False. `reason`: why, in words.

    `at_end`: whether it ended by itself, because its ports are gone for good or its file is at its end. `lossy`: it
    recorded less than it heard; without this its last `Status` says whether it did. `unheard`: this side was too slow
    for its last words, and nobody knows how many octets went with them (they are recorded).
    """

    reason: str
    clean: bool = True
    lossy: bool = False
    unheard: bool = False
    at_end: bool = False


Message = ReceivedMessage | Tick | Status | Ended
Batch = HeardOctets | Message
"""What comes of many reads at a time."""


_FRAME = struct.Struct("<IBB")
_CHUNK = struct.Struct("<qH")
_COUNT = struct.Struct("<I")
A_READ = 12
"""Octets that a read takes beside what it holds."""
_MARK = struct.Struct("<IB")
_TICK = struct.Struct("<q")
_LINE = struct.Struct("<qqB")
_DERIVED = struct.Struct("<qqHHI")
_I64 = 1 << 63
_LINE_KINDS = tuple(LineEventKind)
_LINE_CODES = {kind: code for code, kind in enumerate(_LINE_KINDS)}


def encode(kind: IpcKind, bus: int = 0, body: bytes = b"") -> bytes:
    """One message."""
    return _FRAME.pack(len(body) + 2, kind, bus) + body


def encode_item(bus: int, item: Item) -> bytes:
    """A chunk or line event."""
    if isinstance(item, Chunk):
        if not item.marks:
            octets = item.octets
            return _FRAME.pack(len(octets) + 12, IpcKind.CHUNK, bus) + _CHUNK.pack(_in_64_bits(item.time), 0) + octets
        marks = item.marks[:0xFFFF]
        body = _CHUNK.pack(_in_64_bits(item.time), len(marks))
        body += b"".join(_MARK.pack(mark.offset, mark.error.value) for mark in marks)
        return encode(IpcKind.CHUNK, bus, body + item.octets)
    text = item.text.encode("utf-8", "replace")
    head = _LINE.pack(_in_64_bits(item.time), _in_64_bits(item.count), _LINE_CODES[item.kind])
    return encode(IpcKind.LINE, bus, head + text)


def encode_reads(bus: int, chunks: Sequence[Chunk]) -> bytes:
    """Reads that hold octets and no marks, at least one: u32 n, i64 time[n], u32 length[n], the octets."""
    count = len(chunks)
    times = struct.pack(f"<{count}q", *[_in_64_bits(chunk.time) for chunk in chunks])
    lengths = struct.pack(f"<{count}I", *[len(chunk.octets) for chunk in chunks])
    return encode(
        IpcKind.READS, bus, b"".join((_COUNT.pack(count), times, lengths, *[chunk.octets for chunk in chunks]))
    )


def gap_event(time: int, octets: int) -> LineEvent:
    """What stands where the main process misses octets that it was too slow for."""
    return LineEvent(
        time, LineEventKind.DROPPED, "not shown: this side did not keep up; the recording has them", octets
    )


def octets_in(kind: int, body: bytes) -> tuple[int, int]:
    """Time (ns, of the first read) and number of the octets in the body of a CHUNK or of READS. Raises IpcError."""
    try:
        if kind == IpcKind.READS:
            return _TICK.unpack_from(body, _COUNT.size)[0], max(0, len(body) - _octets_at(_COUNT.unpack_from(body)[0]))
        time, marks = _CHUNK.unpack_from(body)
    except struct.error as error:
        raise IpcError(f"message {kind}: {error}") from error
    return time, max(0, len(body) - _CHUNK.size - marks * _MARK.size)


def encode_tick(bus: int, now: int) -> bytes:
    """A Tick."""
    return encode(IpcKind.TICK, bus, _TICK.pack(_in_64_bits(now)))


def _in_64_bits(number: int) -> int:
    """A number as near as 64 bits come: a file that is played may hold any."""
    return number if -_I64 <= number < _I64 else min(max(number, -_I64), _I64 - 1)


def encode_json(kind: IpcKind, value: Any, bus: int = 0) -> bytes:
    """A message whose body is JSON."""
    return encode(kind, bus, json.dumps(value).encode())


def encode_status(status: Status) -> bytes:
    """A Status."""
    return encode_json(IpcKind.STATUS, asdict(status), status.bus)


def encode_derived(bus: int, derived: DerivedMessage) -> bytes:
    """A result on its way into the file."""
    topic, schema = derived.topic.encode(), derived.schema.encode()
    metadata = json.dumps(dict(derived.metadata)).encode() if derived.metadata else b""
    head = _DERIVED.pack(derived.log_time, derived.publish_time, len(topic), len(schema), len(metadata))
    return encode(IpcKind.DERIVED, bus, head + topic + schema + metadata + derived.data)


def encode_trigger(bus: int, time: int, text: str, kind: IpcKind = IpcKind.TRIGGER) -> bytes:
    """A trigger that fired at some time, ns; a mark of a moment is alike."""
    return encode(kind, bus, _TICK.pack(time) + text.encode("utf-8", "replace"))


def decode_trigger(body: bytes) -> tuple[int, str]:
    """Its time and text. Raises IpcError."""
    if len(body) < _TICK.size:
        raise IpcError("a trigger without a time")
    return _TICK.unpack_from(body)[0], body[_TICK.size :].decode("utf-8", "replace")


def encode_ended(reason: str, at_end: bool) -> bytes:
    """The end of a capture: see `Ended`."""
    return encode(IpcKind.ENDED, 0, bytes((at_end,)) + reason.encode())


def decode_message(kind: int, bus: int, body: bytes) -> Batch | None:
    """A message to the main process; None for kinds that are not for it. Raises IpcError."""
    try:
        if kind == IpcKind.READS:
            return HeardOctets(bus, _decode_reads(body))
        if kind == IpcKind.CHUNK:
            return ReceivedMessage(bus, _decode_chunk(body))
        if kind == IpcKind.TICK:
            return Tick(bus, _TICK.unpack(body)[0])
        if kind == IpcKind.LINE:
            time, count, code = _LINE.unpack_from(body)
            text = body[_LINE.size :].decode("utf-8", "replace")
            return ReceivedMessage(bus, LineEvent(time, _LINE_KINDS[code], text, count))
        if kind == IpcKind.STATUS:
            return Status(**decode_json(body))
        if kind == IpcKind.ENDED:
            return Ended(body[1:].decode("utf-8", "replace"), at_end=body[0] == 1)
    except (struct.error, IndexError, TypeError, ValueError) as error:
        raise IpcError(f"message {kind}: {error}") from error
    return None


def one_by_one(messages: Iterable[Batch]) -> Iterator[Message]:
    """The same with every read by itself."""
    for message in messages:
        if isinstance(message, HeardOctets):
            for chunk in message.block.chunks():
                yield ReceivedMessage(message.bus, chunk)
        else:
            yield message


def _octets_at(count: int) -> int:
    """Where the octets of so many reads begin in the body of READS."""
    return _COUNT.size + A_READ * count


def _decode_reads(body: bytes) -> Block:
    import numpy as np  # which the capture process does without

    from sniff.engine.blocks import Block, plain_reads

    (count,) = _COUNT.unpack_from(body)
    begin = _octets_at(count)
    if not count or begin > len(body):
        raise IpcError(f"{count} reads in {len(body)} octets")
    times = np.frombuffer(body, "<i8", count, _COUNT.size).astype(np.int64)
    lengths = np.frombuffer(body, "<u4", count, _COUNT.size + 8 * count).astype(np.int64)
    octets = np.frombuffer(body, np.uint8, offset=begin)
    if int(lengths.min()) < 1 or int(lengths.sum()) != len(octets):
        raise IpcError(f"reads of {int(lengths.sum())} octets, of which {len(octets)} came")
    return Block(plain_reads(octets, times, lengths))


def _decode_chunk(body: bytes) -> Chunk:
    time, count = _CHUNK.unpack_from(body)
    if not count:
        return Chunk(time, body[_CHUNK.size :])
    end = _CHUNK.size + count * _MARK.size
    marks = tuple(Mark(offset, LineError(error)) for offset, error in _MARK.iter_unpack(body[_CHUNK.size : end]))
    return Chunk(time, body[end:], marks)


def decode_derived(body: bytes) -> DerivedMessage:
    """A result on its way into the file. Raises IpcError."""
    try:
        log_time, publish_time, *lengths = _DERIVED.unpack_from(body)
        parts = []
        begin = _DERIVED.size
        for length in lengths:
            parts.append(body[begin : begin + length])
            begin += length
        topic, schema = parts[0].decode(), parts[1].decode()
        metadata = {str(key): str(value) for key, value in decode_json(parts[2]).items()} if parts[2] else {}
    except (struct.error, ValueError) as error:
        raise IpcError(f"result: {error}") from error
    return DerivedMessage(topic, schema, log_time, publish_time, body[begin:], metadata)


def decode_json(body: bytes) -> dict[str, Any]:
    """A JSON object. Raises IpcError."""
    try:
        value = json.loads(body)
    except ValueError as error:
        raise IpcError(str(error)) from error
    if not isinstance(value, dict):
        raise IpcError("not an object")
    return value


class MessageSplitter:
    """Cuts a stream of octets into messages; holds at most one incomplete message."""

    def __init__(self) -> None:
        self._held = bytearray()

    def feed(self, data: bytes) -> list[tuple[int, int, bytes]]:
        """Complete messages as (kind, bus, body). Raises IpcError on an impossible length."""
        self._held += data
        messages = []
        begin = 0
        held = self._held
        while len(held) - begin >= _FRAME.size:
            length, kind, bus = _FRAME.unpack_from(held, begin)
            if not 2 <= length <= LIMIT:
                raise IpcError(f"a message of {length} octets")
            end = begin + 4 + length
            if end > len(held):
                break
            messages.append((kind, bus, bytes(held[begin + _FRAME.size : end])))
            begin = end
        del held[:begin]
        return messages
