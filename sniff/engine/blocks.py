"""Blocks: the reads of a capture as columns, many at a time, with what happened to the line between them.

A format that can give its octets without an object a read does so (`Capture.blocks`); `blocks_of` packs the items of
any other. A block is cut at a line event, which stands between two blocks at its place.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from dissectors.columns import Reads
from dissectors.frame import Chunk, Mark
from sniff.engine.capture import CaptureError
from sniff.engine.session import Item, LineEvent

BLOCK_OCTETS = 1 << 19
BLOCK_READS = 1 << 16
"""A block holds about so many octets or reads, whichever is first."""


@dataclass(frozen=True, slots=True)
class Block:
    """Reads that follow one another, at least one. `marks`: line errors by index of the read; `reads.before` is None,
    since whoever reads blocks in a row knows what came before.
    """

    reads: Reads
    marks: Mapping[int, tuple[Mark, ...]] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.reads)

    def chunks(self, first: int = 0, end: int | None = None) -> Iterator[Chunk]:
        """Reads [first, end) as chunks."""
        reads = self.reads
        end = len(reads) if end is None else end
        lengths = reads.lengths[first:end].tolist()
        at = int(reads.lengths[:first].sum())
        octets = reads.octets[at : at + sum(lengths)].tobytes()
        at = 0
        for index, time, length in zip(range(first, end), reads.times[first:end].tolist(), lengths, strict=True):
            yield Chunk(time, octets[at : at + length], self.marks.get(index, ()))
            at += length


def block_of(chunks: list[Chunk]) -> Block:
    """One block of chunks that hold octets, at least one."""
    marks = {index: chunk.marks for index, chunk in enumerate(chunks) if chunk.marks}
    marked = np.zeros(len(chunks), bool)
    marked[list(marks)] = True
    reads = Reads(
        np.frombuffer(b"".join([chunk.octets for chunk in chunks]), np.uint8),
        np.array([chunk.time for chunk in chunks], np.int64),
        np.array([len(chunk.octets) for chunk in chunks], np.int64),
        marked,
    )
    return Block(reads, marks)


def blocks_of(items: Iterable[Item]) -> Iterator[Block | LineEvent]:
    """Any items as blocks; empty chunks, which only say that time passed, are left out. Raises CaptureError as
    `items` does, when all before it was given."""
    held: list[Chunk] = []
    octets = 0
    try:
        for item in items:
            if isinstance(item, LineEvent):
                if held:
                    yield block_of(held)
                    held, octets = [], 0
                yield item
            elif item.octets:
                held.append(item)
                octets += len(item.octets)
                if octets >= BLOCK_OCTETS or len(held) >= BLOCK_READS:
                    yield block_of(held)
                    held, octets = [], 0
    except CaptureError:
        if held:
            yield block_of(held)
        raise
    if held:
        yield block_of(held)
