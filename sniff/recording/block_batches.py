"""Reads in blocks to /raw messages: what `batcher.Batcher` makes of them one by one, without an object a read."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from dissectors.frame import Chunk
from sniff.recording.batch import LONGEST, packed
from sniff.recording.batcher import MOST_CHUNKS, MOST_OCTETS, MOST_TIME, Batcher
from sniff.recording.topic_message import Message

if TYPE_CHECKING:
    from sniff.engine.blocks import Block


def add_block(batcher: Batcher, block: Block) -> Iterator[list[Message]]:
    """Give a batcher the reads of a block; the messages of each batch that they close."""
    import numpy as np

    reads = block.reads
    special = reads.marked | (reads.lengths > LONGEST) | (reads.lengths < 1)
    for at in block.marks:
        special[at] = True
    begin = 0
    for place in [*np.flatnonzero(special).tolist(), len(reads)]:
        if place > begin:
            yield from _add_plain(batcher, block, begin, place)
        for chunk in block.chunks(place, min(place + 1, len(reads))):
            yield batcher.add(chunk)
        begin = place + 1


def _add_plain(batcher: Batcher, block: Block, begin: int, end: int) -> Iterator[list[Message]]:
    """Reads [begin, end), none of which has a mark or is too long for an entry."""
    import numpy as np

    reads, (held_times, held_octets) = block.reads, batcher.take()
    times = np.concatenate([np.array(held_times, np.int64), reads.times[begin:end]])
    lengths = np.concatenate([np.array([len(one) for one in held_octets], np.int64), reads.lengths[begin:end]])
    first = int(reads.lengths[:begin].sum())
    held = b"".join(held_octets)
    octets = held + reads.octets[first : first + int(reads.lengths[begin:end].sum())].tobytes()
    places = np.zeros(len(times) + 1, np.int64)
    np.cumsum(lengths, out=places[1:])
    backwards = np.append(np.flatnonzero(times[1:] < times[:-1]) + 1, len(times))
    at = 0
    while True:
        start = int(times[at])
        stop = min(at + MOST_CHUNKS, int(backwards[np.searchsorted(backwards, at, side="right")]))
        late = min(start + MOST_TIME, (1 << 63) - 1)
        stop = at + int(np.searchsorted(times[at:stop], late, side="right"))
        stop = min(stop, int(np.searchsorted(places, places[at] + MOST_OCTETS)))
        if stop >= len(times):
            break
        steps = (times[at:stop] - start).astype("<u4").tobytes()
        sizes = lengths[at:stop].astype("<u2").tobytes()
        data = packed(stop - at, start, steps, sizes, [octets[int(places[at]) : int(places[stop])]])
        yield batcher.closed(data, stop - at, start, int(times[stop - 1]))
        at = stop
    for place in range(at, len(times)):  # the last batch stays open
        batcher.add(Chunk(int(times[place]), octets[int(places[place]) : int(places[place + 1])]))
