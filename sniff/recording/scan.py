"""Reading the records of an MCAP file that may be cut off, damaged or made to do harm.

Nothing here trusts a size: a record's length is held against the file's, a chunk's claimed size against `MOST_CHUNK`
before it is unpacked, and every chunk against its check sum. What cannot be read is skipped and written down in a
`Report`; nothing but an error of the operating system is raised.

Layout of an MCAP file: magic · records · magic, a record being `u8 opcode, u64 length, content`, little-endian
(mcap.dev, specification). Chunks hold messages; the summary after DATA_END is not needed to read.
"""

from __future__ import annotations

import struct
import zlib
from array import array
from bisect import bisect_left
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from io import BytesIO
from typing import BinaryIO, TypeVar

T = TypeVar("T")

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK = 1, 2, 3, 4, 5, 6
ATTACHMENT, METADATA, DATA_END = 0x09, 0x0C, 0x0F
LAST_OPCODE = 0x0F
PRIVATE_OPCODES = 0x80

MOST_RECORD = 80 << 20  # octets of a record that is read whole
MOST_CHUNK = 64 << 20  # octets of a chunk unpacked; usual writers make 1 to 8 MiB
MOST_PROBLEMS = 5  # that are kept in words

_RECORD = struct.Struct("<BQ")
_CHUNK = struct.Struct("<QQQIi")  # first and last time, size and check sum unpacked, length of the compression's name
_CHUNK_START = _CHUNK.size + 32  # octets that hold all of a chunk's sizes, its compression having a short name
_ZSTD = b"\x04\x00\x00\x00zstd"
_ZSTD_AT = _RECORD.size + 28  # of that in a chunk record
_BLOCK = 1 << 20


class ChunkIndex:
    """Where the chunks of a file are, in its order, with the latest message time (ns) up to the end of each.

    `backward`: whether a chunk ends before the one before it.
    """

    def __init__(self) -> None:
        self.offsets = array("q")
        self.latest = array("Q")
        self.backward = False

    def add(self, offset: int, end: int) -> None:
        """Take the next chunk; `end`: the latest time in it."""
        self.offsets.append(offset)
        self.backward = self.backward or bool(self.latest and end < self.latest[-1])
        self.latest.append(max(end, self.latest[-1]) if self.latest else end)

    def find(self, since: int) -> int | None:
        """Offset of the first chunk that has something at or after a time, or of the last; None without a chunk."""
        at = bisect_left(self.latest, since)
        return self.offsets[min(at, len(self.offsets) - 1)] if self.offsets else None


@dataclass(slots=True)
class Report:
    """What was found wrong in a pass. `end`: where reading ended, `size`: of the file, octets."""

    size: int
    end: int = 0
    footer: bool = False
    problems: list[str] = field(default_factory=list)  # in words, the first of them
    places: int = 0  # how many there are
    skipped: int = 0  # octets before `end` that could not be read
    chunks: ChunkIndex = field(default_factory=lambda: ChunkIndex())

    def problem(self, text: str, octets: int = 0) -> None:
        """Write down something that could not be read, and how many octets were passed over."""
        self.skipped += octets
        self.places += 1
        if len(self.problems) < MOST_PROBLEMS:
            self.problems.append(text)


@dataclass(frozen=True, slots=True)
class Record:
    """A record at `offset`; `body` is None where it was not asked for."""

    opcode: int
    offset: int
    body: bytes | None


def records(stream: BinaryIO, report: Report, since: int | None = None, start: int | None = None) -> Iterator[Record]:
    """The records of a file, from its beginning or from a chunk at `start`.

    `since`: chunks whose messages all are earlier (ns) are passed over without being read; the check over the whole
    file is then not made.
    """
    position = len(MAGIC) if start is None else start
    stream.seek(position)
    check = zlib.crc32(MAGIC)
    whole = since is None and start is None
    anchor = position  # after the last chunk whose sizes agree: what lies beyond may have been misread
    while True:
        head = stream.read(_RECORD.size)
        if len(head) < _RECORD.size:
            report.end = position
            return
        opcode, length = _RECORD.unpack(head)
        left = report.size - position - _RECORD.size
        if not _plausible(opcode, length, left):
            found = _next_chunk(stream, anchor, report.size)
            if found is None:
                report.end = position
                if not (length > left and opcode <= LAST_OPCODE):
                    report.problem(f"damaged at octet {position}")
                return
            report.problem(f"damaged at octet {position}, reading goes on at octet {found}", found - anchor)
            whole = False
            position = anchor = found
            stream.seek(position)
            continue
        if opcode == DATA_END:
            report.end = position
            _end_of_data(stream, length, check if whole else None, report)
            return
        if length > MOST_RECORD:
            if opcode in (CHUNK, MESSAGE):
                too_long = f"record at octet {position}: {length} octets; more than {MOST_RECORD} are not read"
                report.problem(too_long, length)
            whole = False
            position = stream.seek(length, 1)
            report.end = position
            continue
        body, last_time = _body(stream, opcode, length, since)
        whole = whole and body is not None
        if whole and body is not None:
            check = zlib.crc32(body, zlib.crc32(head, check))
        yield Record(opcode, position, body)
        record_at, position = position, position + _RECORD.size + length
        report.end = position
        if last_time is not None:
            report.chunks.add(record_at, last_time)
            anchor = position


def records_at(stream: BinaryIO, report: Report, places: Sequence[int]) -> Iterator[Record]:
    """The chunks that begin at some places of a file that is known to be whole, ascending; the last place is where its
    data end. Ends at a place where there is none."""
    for place in places[:-1]:
        stream.seek(place)
        head = stream.read(_RECORD.size)
        opcode, length = _RECORD.unpack(head) if len(head) == _RECORD.size else (0, 0)
        if opcode != CHUNK or length > min(report.size - place - _RECORD.size, MOST_RECORD):
            report.problem(f"no chunk at octet {place}")
            return
        body, last_time = _body(stream, opcode, length, None)
        if last_time is not None:
            report.chunks.add(place, last_time)
        yield Record(opcode, place, body)
    stream.seek(places[-1])
    _, length = _RECORD.unpack(stream.read(_RECORD.size))
    report.end = places[-1]
    _end_of_data(stream, length, None, report)


def _body(stream: BinaryIO, opcode: int, length: int, since: int | None) -> tuple[bytes | None, int | None]:
    """A record's content, None where it is earlier than `since`; the last time in a sound chunk.

    A sound chunk is one whose sizes agree.
    """
    if opcode != CHUNK:
        return stream.read(length), None
    start = stream.read(min(length, _CHUNK_START))
    last_time = _last_time(start) if _sizes_agree(start, length) else None
    if last_time is not None and since is not None and last_time < since:
        stream.seek(length - len(start), 1)
        return None, last_time
    return start + stream.read(length - len(start)), last_time


def _end_of_data(stream: BinaryIO, length: int, check: int | None, report: Report) -> None:
    """After the data: their check (`check` as computed, None when not all were read), summary and footer."""
    told = stream.read(4)
    if length != 4:
        report.problem("the index at the end is damaged")
    elif check is not None and told not in (bytes(4), struct.pack("<I", check)):
        report.problem("the check over the whole file fails: some octet has changed")
    _summary(stream, report)


def _plausible(opcode: int, length: int, left: int) -> bool:
    return length <= left and (0 < opcode <= LAST_OPCODE or opcode >= PRIVATE_OPCODES)


def _sizes_agree(start: bytes, length: int) -> bool:
    """Whether the sizes at the start of a chunk record add up to its length."""
    at = _CHUNK.size + (_CHUNK.unpack_from(start)[4] if len(start) >= _CHUNK.size else 0)
    return _CHUNK.size <= at <= len(start) - 8 and struct.unpack_from("<Q", start, at)[0] == length - at - 8


def _last_time(start: bytes) -> int:
    return int(_CHUNK.unpack_from(start)[1])


def _next_chunk(stream: BinaryIO, position: int, size: int) -> int | None:
    """Where the next whole chunk record begins, at or after `position`; None when there is none."""
    stream.seek(position)
    window = b""
    base = position
    size_read = 4096  # small at first: a file with a million damaged places costs no gigabytes of reading
    while block := stream.read(size_read):
        size_read = min(2 * size_read, _BLOCK)
        window += block
        at = window.find(_ZSTD)
        while at >= 0:
            start = base + at - _ZSTD_AT
            if start >= position and _is_chunk(stream, start, size):
                return start
            at = window.find(_ZSTD, at + 1)
        kept = len(_ZSTD) - 1
        base += len(window) - len(window[-kept:])
        window = window[-kept:]
        stream.seek(base + len(window))
    return None


def _is_chunk(stream: BinaryIO, start: int, size: int) -> bool:
    stream.seek(start)
    head = stream.read(_ZSTD_AT + len(_ZSTD) + 8)
    if len(head) < _ZSTD_AT + len(_ZSTD) + 8:
        return False
    opcode, length = _RECORD.unpack_from(head)
    (packed,) = struct.unpack_from("<Q", head, len(head) - 8)
    return bool(opcode == CHUNK and length == len(head) - _RECORD.size + packed and start + 9 + length <= size)


def _summary(stream: BinaryIO, report: Report) -> None:
    """Look for the footer and the magic at the end; check the summary's sum."""
    start = stream.tell()
    footer = 9 + 20 + len(MAGIC)
    if report.size - start < footer:
        return
    stream.seek(report.size - footer)
    tail = stream.read(footer)
    if tail[0] != FOOTER or tail[-8:] != MAGIC:
        return
    report.footer = True
    report.end = report.size
    summary_start, _, check = struct.unpack_from("<QQI", tail, 9)
    if check and (summary_start == start or summary_start == 0):
        stream.seek(start)
        found, left = 0, report.size - start - 12
        while left > 0 and (block := stream.read(min(left, _BLOCK))):
            found = zlib.crc32(block, found)
            left -= len(block)
        if found != check:
            report.problem("the index at the end is damaged")
    elif summary_start != start:
        report.problem("the index at the end is damaged")


def parse(kind: type[T], body: bytes) -> T | None:
    """A record of one of the library's classes (Header, Metadata, Schema, Channel), None when it is damaged."""
    from mcap.data_stream import ReadDataStream
    from mcap.exceptions import McapError

    try:
        found: T = kind.read(ReadDataStream(BytesIO(body)))  # type: ignore[attr-defined]
    except (McapError, struct.error, UnicodeDecodeError):
        return None
    return found


# -- chunks ----------------------------------------------------------------------------------------------------


def unpack_chunk(body: bytes) -> bytes | str:
    """The records in a chunk record, or in words why they cannot be had."""
    if len(body) < _CHUNK.size:
        return "too short"
    _, _, size, check, name_length = _CHUNK.unpack_from(body)
    at = _CHUNK.size + name_length
    if name_length < 0 or len(body) < at + 8:
        return "too short"
    name = body[_CHUNK.size : at]
    if size > MOST_CHUNK:
        return f"claims {size} octets; more than {MOST_CHUNK} are not unpacked"
    (packed,) = struct.unpack_from("<Q", body, at)
    if packed != len(body) - at - 8:
        return "sizes contradict each other"
    octets = _decompress(name, body[at + 8 :], size)
    if isinstance(octets, str):
        return octets
    if len(octets) != size:
        return "not as long as it claims"
    if check and zlib.crc32(octets) != check:
        return "its check fails"
    return octets


def _decompress(name: bytes, octets: bytes, size: int) -> bytes | str:
    """At most `size` octets unpacked, or why not."""
    if name == b"":
        return octets
    if name == b"zstd":
        import zstandard

        try:
            # the size in the frame is what the library allocates
            if zstandard.frame_content_size(octets) not in (size, -1):
                return "sizes contradict each other"
            return zstandard.ZstdDecompressor().decompress(octets, max_output_size=size)
        except zstandard.ZstdError:
            return "cannot be unpacked"
    if name == b"lz4":
        import lz4.frame  # type: ignore[import-untyped]

        try:
            return bytes(lz4.frame.LZ4FrameDecompressor().decompress(octets, max_length=size))
        except (RuntimeError, EOFError, ValueError):
            return "cannot be unpacked"
    return "packed in a way that is not known here"


def inner_records(octets: bytes) -> Iterator[tuple[int, bytes]]:
    """Opcode and content of the records in an unpacked chunk, up to the first that does not fit."""
    at = 0
    while at + _RECORD.size <= len(octets):
        opcode, length = _RECORD.unpack_from(octets, at)
        at += _RECORD.size
        if length > len(octets) - at:
            return
        yield opcode, octets[at : at + length]
        at += length


MESSAGE_HEAD = struct.Struct("<HIQQ")
"""Channel, sequence, log time, publish time; the data follow."""
RECORD_HEAD = _RECORD
"""Opcode and length of the content, which follows."""
