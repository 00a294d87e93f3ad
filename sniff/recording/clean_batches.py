"""Batches of /raw that nothing happened to, joined into columns many at a time."""

from __future__ import annotations

import numpy as np

from dissectors.columns import Reads
from sniff.engine.blocks import BLOCK_OCTETS, BLOCK_READS, plain_reads
from sniff.recording.batch import Batch

_LATEST = (1 << 63) - (1 << 32)
"""ns; a batch that starts before it has no time over 64 bits."""


class CleanBatches:
    """Collects batches that follow one another."""

    def __init__(self) -> None:
        self._batches: list[Batch] = []
        self._count = self._octets = 0

    def __bool__(self) -> bool:
        return bool(self._batches)

    @staticmethod
    def takes(batch: Batch) -> bool:
        """Whether a batch is no larger than a block may be (a foreign one can be)."""
        return batch.count <= BLOCK_READS and len(batch.data) <= BLOCK_OCTETS and batch.start < _LATEST

    def fits(self, batch: Batch) -> bool:
        """Whether what is collected stays within a block with one more batch."""
        return self._count + batch.count <= BLOCK_READS and self._octets + len(batch.data) <= BLOCK_OCTETS

    def add(self, batch: Batch) -> None:
        """Take the next."""
        self._batches.append(batch)
        self._count += batch.count
        self._octets += len(batch.data)

    def take(self) -> Reads:
        """All entries but empty ones (a foreign file's); nothing is collected any more."""
        batches = self._batches
        self._batches = []
        self._count = self._octets = 0
        starts = np.array([batch.start for batch in batches], np.int64)
        counts = np.array([batch.count for batch in batches], np.int64)
        steps = np.frombuffer(b"".join([batch.steps for batch in batches]), "<u4")
        lengths = np.frombuffer(b"".join([batch.sizes for batch in batches]), "<u2").astype(np.int64)
        octets = np.frombuffer(b"".join([batch.octets for batch in batches]), np.uint8)
        times = np.repeat(starts, counts)
        times += steps
        if not lengths.all():
            times, lengths = times[lengths > 0], lengths[lengths > 0]
        return plain_reads(octets, times, lengths)
