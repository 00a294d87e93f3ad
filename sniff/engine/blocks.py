"""Blocks: the reads of a capture as columns, many at a time, with what happened to the line between them.

A format that can give its octets without an object a read does so (`Capture.blocks`); `blocks_of` packs the items of
any other. A block is cut at a line event, which stands between two blocks at its place.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from dissectors.columns import Reads
from dissectors.frame import Chunk, Mark
from sniff.engine.capture_error import CaptureError
from sniff.engine.session import Item, LineEvent

if TYPE_CHECKING:
    from dissectors.columns import Masks, Octets, Times

BLOCK_OCTETS = 1 << 20
BLOCK_READS = 1 << 17
"""A block holds about so many octets or reads, whichever is first; never twice as many, but for a longer read."""
_I64 = 1 << 63


@dataclass(frozen=True, slots=True)
class Block:
    """Reads that follow one another, at least one. `marks`: line errors by index of the read; `reads.before` is None,
    since whoever reads blocks in a row knows what came before.
    """

    reads: Reads
    marks: Mapping[int, tuple[Mark, ...]] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.reads)

    @property
    def latest(self) -> int:
        """When the last read came, ns."""
        return int(self.reads.times[-1])

    def take(self, which: Masks) -> Block | None:
        """Some of the reads; None for none of them."""
        if which.all():
            return self
        if not which.any():
            return None
        reads = self.reads
        octets = reads.octets[np.repeat(which, reads.lengths)]
        kept = Reads(octets, reads.times[which], reads.lengths[which], reads.marked[which])
        places = np.cumsum(which) - 1
        return Block(kept, {int(places[at]): marks for at, marks in self.marks.items() if which[at]})

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

    def cut(self, first: int, end: int) -> Block:
        """Reads [first, end), at least one."""
        reads = self.reads
        at = int(reads.lengths[:first].sum())
        lengths = reads.lengths[first:end]
        octets = reads.octets[at : at + int(lengths.sum())]
        some = Reads(octets, reads.times[first:end], lengths, reads.marked[first:end], reads.before)
        return Block(some, {read - first: marks for read, marks in self.marks.items() if first <= read < end})


def in_pieces(items: Iterable[Block | LineEvent], least: int, most: int) -> Iterator[Block | LineEvent]:
    """The same in blocks of at most `least` reads first, so that something is there at once, later of at most `most`.
    Raises what `items` raises."""
    for item in items:
        if isinstance(item, LineEvent):
            yield item
            continue
        first = 0
        while first < len(item):
            yield item.cut(first, min(len(item), first + least))
            first, least = first + least, min(2 * least, most)


def reads_of(chunks: Sequence[Chunk]) -> Reads:
    """Chunks that hold octets, at least one, as columns."""
    marked = np.array([bool(chunk.marks) for chunk in chunks], bool)
    return Reads(
        np.frombuffer(b"".join([chunk.octets for chunk in chunks]), np.uint8),
        _times([chunk.time for chunk in chunks]),
        np.array([len(chunk.octets) for chunk in chunks], np.int64),
        marked,
    )


def plain_reads(octets: Octets, times: Times, lengths: Times) -> Reads:
    """Reads in which no line error was reported."""
    return Reads(octets, times, lengths, np.zeros(len(times), bool))


def blocks_of(items: Iterable[Item | Reads]) -> Iterator[Block | LineEvent]:
    """Any items as blocks, and any columns without marks, none of which exceeds a block, between them. Empty chunks,
    which only say that time passed, are left out. Raises CaptureError as `items` does, when all before it was given.
    """
    held = Gathering()
    try:
        for item in items:
            if isinstance(item, LineEvent):
                if held.count:
                    yield held.take()
                yield item
                continue
            held.add(item)
            if held.octets >= BLOCK_OCTETS or held.count >= BLOCK_READS:
                yield held.take()
    except CaptureError:
        if held.count:
            yield held.take()
        raise
    if held.count:
        yield held.take()


class Gathering:
    """Reads for one block: `count` of them with so many `octets`."""

    def __init__(self) -> None:
        self.count = self.octets = 0
        self._pieces: list[Reads] = []
        self._chunks: list[Chunk] = []  # after the pieces
        self._marks: dict[int, tuple[Mark, ...]] = {}

    def add(self, item: Chunk | Reads | Block) -> None:
        """Take the next."""
        if isinstance(item, Block):
            self._marks.update({self.count + index: marks for index, marks in item.marks.items()})
            item = item.reads
        if isinstance(item, Chunk):
            if not item.octets:
                return
            if item.marks:
                self._marks[self.count] = item.marks
            self._chunks.append(item)
            self.count += 1
            self.octets += len(item.octets)
        elif len(item):
            self._close_chunks()
            self._pieces.append(item)
            self.count += len(item)
            self.octets += len(item.octets)

    def take(self) -> Block:
        """All of them, at least one; none are held any more."""
        self._close_chunks()
        block = Block(_joined(self._pieces), self._marks)
        self.count = self.octets = 0
        self._pieces, self._marks = [], {}
        return block

    def _close_chunks(self) -> None:
        if self._chunks:
            self._pieces.append(reads_of(self._chunks))
            self._chunks = []


def _joined(pieces: list[Reads]) -> Reads:
    if len(pieces) == 1:
        return pieces[0]
    return Reads(
        np.concatenate([piece.octets for piece in pieces]),
        np.concatenate([piece.times for piece in pieces]),
        np.concatenate([piece.lengths for piece in pieces]),
        np.concatenate([piece.marked for piece in pieces]),
    )


def _times(times: list[int]) -> Times:
    """Times, those of a file made to do harm as near as 64 bits come."""
    try:
        return np.array(times, np.int64)
    except OverflowError:
        return np.array([min(max(time, -_I64), _I64 - 1) for time in times], np.int64)
