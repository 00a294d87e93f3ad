"""A recording that is octet for octet as it was written, by the check over all of it, and what its index says then.

Layout of the index: see the specification of MCAP (mcap.dev): footer, summary section, chunk and metadata indices.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from sniff.formats.files import open_capture
from sniff.recording import scan

_FOOTER = struct.Struct("<BQQQI")  # opcode, length, begin of the summary, of its offsets, check of both
_DATA_END = struct.Struct("<BQI")  # opcode, length, check of all before it
_CHUNK = struct.Struct("<QQQQI")  # first and last time, begin and length of the chunk, octets of the map behind it
_CHANNEL = struct.Struct("<HHI")  # id, schema, octets of the topic
_METADATA = struct.Struct("<QQI")  # begin, length, octets of the name
_IN_MAP = np.dtype([("channel", "<u2"), ("offset", "<u8")])
_CHUNK_INDEX, _METADATA_INDEX = 0x08, 0x0D
_BLOCK = 1 << 20


@dataclass(frozen=True, slots=True)
class WholeFile:
    """`record`: the metadata record that was asked for. `data_end`: octet at which the data end. `index`: the records
    of the summary."""

    record: Mapping[str, str]
    data_end: int
    index: bytes

    def places(self, *topics: str) -> tuple[int, ...]:
        """Where the chunks begin that hold any of some topics, ascending, and behind them where the data end."""
        wanted = [number for number, topic in _channels(self.index) if topic in topics]
        begins = {begin for begin, channels in _chunks(self.index) if np.isin(channels, wanted).any()}
        return (*sorted(begin for begin in begins if begin < self.data_end), self.data_end)


def whole_file(path: Path, record: str) -> WholeFile | None:
    """What a file says that holds a metadata record of this name; None where it holds none, or where anything of it has
    changed. Raises OSError."""
    with open_capture(path) as stream:
        size = stream.seek(0, 2)
        at = size - _FOOTER.size - len(scan.MAGIC)
        if at < len(scan.MAGIC) + _DATA_END.size:
            return None
        stream.seek(at)
        footer = stream.read(_FOOTER.size)
        opcode, _, begin, _, check = _FOOTER.unpack(footer)
        if opcode != scan.FOOTER or not _DATA_END.size < begin <= at or at - begin > scan.MOST_RECORD:
            return None
        stream.seek(begin)
        index = stream.read(at - begin)
        place, data_end = _place_of(record, index), begin - _DATA_END.size
        if place is None or sum(place) > data_end:
            return None  # most files: all of them need not be read to know it
        if zlib.crc32(footer[:-4], zlib.crc32(index)) != check or not _is_as_written(stream, data_end):
            return None
        told = _metadata(stream, *place)
    return None if told is None else WholeFile(told, data_end, index)


def _place_of(record: str, index: bytes) -> tuple[int, int] | None:
    """Where the last metadata record of a name is, and its length."""
    found = None
    for opcode, body in scan.inner_records(index):
        if opcode == _METADATA_INDEX and len(body) >= _METADATA.size:
            begin, length, _ = _METADATA.unpack_from(body)
            if body[_METADATA.size :] == record.encode():
                found = begin, length
    return found


def _metadata(stream: BinaryIO, begin: int, length: int) -> Mapping[str, str] | None:
    from mcap.records import Metadata

    stream.seek(begin)
    for opcode, body in scan.inner_records(stream.read(length)):
        found = scan.parse(Metadata, body) if opcode == scan.METADATA else None
        return None if found is None else found.metadata
    return None


def _is_as_written(stream: BinaryIO, data_end: int) -> bool:
    """Whether the check over all data is there, and agrees."""
    stream.seek(0)
    check, left = 0, data_end
    while left and (block := stream.read(min(left, _BLOCK))):
        check = zlib.crc32(block, check)
        left -= len(block)
    opcode, length, told = _DATA_END.unpack(stream.read(_DATA_END.size))
    return not left and (opcode, length) == (scan.DATA_END, 4) and told != 0 and told == check


def _channels(index: bytes) -> Iterator[tuple[int, str]]:
    for opcode, body in scan.inner_records(index):
        if opcode == scan.CHANNEL and len(body) >= _CHANNEL.size:
            number, _, length = _CHANNEL.unpack_from(body)
            yield number, body[_CHANNEL.size : _CHANNEL.size + length].decode("utf-8", "replace")


def _chunks(index: bytes) -> Iterator[tuple[int, np.ndarray]]:
    """Where each chunk begins, and which channels it holds."""
    for opcode, body in scan.inner_records(index):
        if opcode == _CHUNK_INDEX and len(body) >= _CHUNK.size:
            _, _, begin, _, length = _CHUNK.unpack_from(body)
            held = body[_CHUNK.size : _CHUNK.size + length]
            yield begin, np.frombuffer(held, _IN_MAP, len(held) // _IN_MAP.itemsize)["channel"]
