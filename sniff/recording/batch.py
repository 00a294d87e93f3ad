"""A /raw message: reads with their times and sizes, in the layout that `topics.RAW_LAYOUT` describes."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import TYPE_CHECKING

from dissectors.frame import Chunk

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

HEAD = struct.Struct("<Iq")
"""How many entries, and when the first one was read, ns."""

ENTRY = 6
"""Octets of an entry beside those that were read: when (u32), and how many (u16)."""

LONGEST = 65535
"""Octets of one entry."""

_STEP = 4096  # entries unpacked at a time: a batch of millions from a hostile file costs no more


def packed(count: int, start: int, steps: bytes, sizes: bytes, octets: Iterable[bytes]) -> bytes:
    """The message of `count` entries from `start` (ns) on, as `Batch` reads it."""
    return b"".join((HEAD.pack(count, start), steps, sizes, *octets))


@dataclass(frozen=True, slots=True)
class Batch:
    """A /raw message whose sizes add up: `count` entries read from `start` (ns) on."""

    count: int
    start: int
    data: bytes

    @classmethod
    def decode(cls, data: bytes) -> Batch | None:
        """None when the sizes contradict each other."""
        if len(data) < HEAD.size:
            return None
        count, start = HEAD.unpack_from(data)
        body = len(data) - HEAD.size - ENTRY * count
        if body < 0:
            return None
        batch = cls(count, start, data)
        return batch if batch._octets() == body else None

    @property
    def octets(self) -> bytes:
        """The octets of all entries."""
        return self.data[HEAD.size + ENTRY * self.count :]

    @property
    def steps(self) -> bytes:
        """ns after `start`, of each entry, u32."""
        return self.data[HEAD.size : HEAD.size + 4 * self.count]

    @property
    def sizes(self) -> bytes:
        """Octets of each entry, u16."""
        return self.data[HEAD.size + 4 * self.count : HEAD.size + ENTRY * self.count]

    def times(self) -> npt.NDArray[np.int64]:
        """ns since the epoch, of each entry."""
        import numpy as np

        return self.start + np.frombuffer(self.data, "<u4", self.count, HEAD.size).astype(np.int64)

    def lengths(self) -> npt.NDArray[np.uint16]:
        """Octets of each entry."""
        import numpy as np

        return np.frombuffer(self.data, "<u2", self.count, HEAD.size + 4 * self.count)

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
        at = HEAD.size + ENTRY * self.count
        for steps, lengths in self._columns():
            ends = list(accumulate(lengths, initial=at))
            yield [start + step for step in steps], [data[first:end] for first, end in pairwise(ends)]
            at = ends[-1]

    def _octets(self) -> int:
        """How many octets the entries claim."""
        lengths = HEAD.size + 4 * self.count
        if self.count <= _STEP:
            return sum(struct.unpack_from(f"<{self.count}H", self.data, lengths))
        return sum(sum(some) for _, some in self._columns())

    def _columns(self) -> Iterator[tuple[tuple[int, ...], tuple[int, ...]]]:
        steps = HEAD.size
        lengths = steps + 4 * self.count
        for first in range(0, self.count, _STEP):
            many = min(_STEP, self.count - first)
            yield (
                struct.unpack_from(f"<{many}I", self.data, steps + 4 * first),
                struct.unpack_from(f"<{many}H", self.data, lengths + 2 * first),
            )
