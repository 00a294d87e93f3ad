"""The index of a file's chunks while it is written: packed, since a day has a hundred thousand of them."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mcap.records import ChunkIndex

_HEAD = struct.Struct("<QQQQQQQHH")
_OFFSET = struct.Struct("<HQ")


class ChunkIndices:
    """What the MCAP writer keeps as a list of objects, in a tenth of the memory. It is appended to and iterated."""

    def __init__(self) -> None:
        self._packed = bytearray()

    def append(self, index: ChunkIndex) -> None:
        """Keep one."""
        compression = index.compression.encode()
        self._packed += _HEAD.pack(
            index.message_start_time,
            index.message_end_time,
            index.chunk_start_offset,
            index.chunk_length,
            index.message_index_length,
            index.compressed_size,
            index.uncompressed_size,
            len(compression),
            len(index.message_index_offsets),
        )
        self._packed += compression
        self._packed += b"".join(_OFFSET.pack(*pair) for pair in index.message_index_offsets.items())

    def __iter__(self) -> Iterator[ChunkIndex]:
        from mcap.records import ChunkIndex

        packed, at = self._packed, 0
        while at < len(packed):
            start, end, offset, length, index_length, size, unpacked, letters, count = _HEAD.unpack_from(packed, at)
            at += _HEAD.size
            compression = packed[at : at + letters].decode()
            at += letters
            offsets = dict(_OFFSET.unpack_from(packed, at + number * _OFFSET.size) for number in range(count))
            at += count * _OFFSET.size
            yield ChunkIndex(
                chunk_length=length,
                chunk_start_offset=offset,
                compression=compression,
                compressed_size=size,
                message_end_time=end,
                message_index_length=index_length,
                message_index_offsets=offsets,
                message_start_time=start,
                uncompressed_size=unpacked,
            )
