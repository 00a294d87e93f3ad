"""The batches of /raw in an unpacked chunk, all at once: a look at their heads instead of objects for each."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sniff.recording import scan
from sniff.recording.batch import ENTRY, HEAD, Batch

if TYPE_CHECKING:
    from sniff.recording.messages import Channel

_HEADS = struct.Struct("<BQHIQQIq")  # of a record, of the message in it, of the batch in that
_MESSAGE_AT = scan.RECORD_HEAD.size
_BATCH_AT = _MESSAGE_AT + scan.MESSAGE_HEAD.size
_AROUND = scan.MESSAGE_HEAD.size + HEAD.size
"""Octets of a message's content that are no entries."""


@dataclass(frozen=True, slots=True)
class BatchRun:
    """Batches that follow one another without a gap in their numbers, as columns of bytes.

    `sequence`: number of the first entry; `last`: log time of the newest batch, ns. `starts`, `counts`: of each batch.
    `steps`, `sizes`, `octets`: of all entries (`Batch`).
    """

    sequence: int
    last: int
    starts: list[int]
    counts: list[int]
    steps: bytes
    sizes: bytes
    octets: bytes

    @classmethod
    def alone(cls, batch: Batch) -> BatchRun:
        """One batch; nobody asks for its number any more."""
        return cls(0, 0, [batch.start], [batch.count], batch.steps, batch.sizes, batch.octets)

    @property
    def entries(self) -> int:
        """How many there are."""
        return len(self.sizes) // 2

    @property
    def size(self) -> int:
        """Octets in all."""
        return len(self.steps) + len(self.sizes) + len(self.octets)


def run_of(chunk: bytes, channels: Mapping[int, Channel], topic: str, others: frozenset[str]) -> BatchRun | None:
    """All batches of a topic in a chunk; None where not all is plain: a definition, a message of one of the `others`,
    a batch that contradicts itself or holds nothing, a gap in the numbers, a record cut off, nothing at all."""
    wanted = {number for number, channel in channels.items() if channel.topic == topic}
    strange = {number for number, channel in channels.items() if channel.topic in others}
    starts: list[int] = []
    counts: list[int] = []
    bodies: list[int] = []
    steps: list[bytes] = []
    sizes: list[bytes] = []
    octets: list[bytes] = []
    at, first, following, last = 0, 0, None, 0
    unpack, end_of_chunk = _HEADS.unpack_from, len(chunk)
    while at < end_of_chunk:
        if at + _HEADS.size > end_of_chunk:
            return None
        opcode, length, channel, sequence, last_time, _, count, start = unpack(chunk, at)
        end = at + _MESSAGE_AT + length
        if opcode != scan.MESSAGE or length < _AROUND or end > end_of_chunk or channel in strange:
            return None
        if channel in wanted:
            of_octets = at + _BATCH_AT + HEAD.size + ENTRY * count
            if not count or of_octets > end or (following is not None and sequence != following):
                return None
            if following is None:
                first = sequence
            following, last = (sequence + count) & 0xFFFF_FFFF, last_time
            begin = at + _BATCH_AT + HEAD.size
            starts.append(start)
            counts.append(count)
            bodies.append(end - of_octets)
            steps.append(chunk[begin : begin + 4 * count])
            sizes.append(chunk[begin + 4 * count : of_octets])
            octets.append(chunk[of_octets:end])
        at = end
    if not counts:
        return None
    whole = BatchRun(first, last, starts, counts, b"".join(steps), b"".join(sizes), b"".join(octets))
    claimed = np.add.reduceat(np.frombuffer(whole.sizes, "<u2").astype(np.int64), np.cumsum([0, *counts[:-1]]))
    return whole if bool((claimed == bodies).all()) else None
