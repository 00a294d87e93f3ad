"""Batches of /raw that nothing happened to, joined into columns many at a time."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from dissectors.columns import Reads
from sniff.engine.blocks import BLOCK_OCTETS, BLOCK_READS, plain_reads
from sniff.recording.batch import Batch
from sniff.recording.batch_run import BatchRun

_LATEST = (1 << 63) - (1 << 32)
"""ns; a batch that starts before it has no time over 64 bits."""
_MOST_RUN = 2 * BLOCK_OCTETS
"""Octets of a run, with times and sizes: about what a chunk of a recording holds."""


class CleanBatches:
    """Collects batches that follow one another."""

    def __init__(self) -> None:
        self._runs: list[BatchRun] = []
        self._count = self._octets = 0

    @staticmethod
    def takes(batch: Batch) -> bool:
        """Whether a batch is no larger than a block may be (a foreign one can be)."""
        return batch.count <= BLOCK_READS and len(batch.data) <= BLOCK_OCTETS and batch.start < _LATEST

    @staticmethod
    def takes_run(run: BatchRun) -> bool:
        """The same of all batches of a run together."""
        return run.entries <= BLOCK_READS and run.size <= _MOST_RUN and max(run.starts) < _LATEST

    def add(self, run: BatchRun) -> Iterator[Reads]:
        """Take the next; gives what was collected where a block holds no more."""
        if self._count + run.entries > BLOCK_READS or self._octets + run.size > BLOCK_OCTETS:
            yield from self.rest()
        self._runs.append(run)
        self._count += run.entries
        self._octets += run.size

    def rest(self) -> Iterator[Reads]:
        """What is collected, if anything."""
        if self._runs:
            yield self._take()

    def _take(self) -> Reads:
        """All entries but empty ones (a foreign file's); nothing is collected any more."""
        runs = self._runs
        self._runs = []
        self._count = self._octets = 0
        starts = np.array([start for run in runs for start in run.starts], np.int64)
        counts = np.array([count for run in runs for count in run.counts], np.int64)
        steps = np.frombuffer(b"".join([run.steps for run in runs]), "<u4")
        lengths = np.frombuffer(b"".join([run.sizes for run in runs]), "<u2").astype(np.int64)
        octets = np.frombuffer(b"".join([run.octets for run in runs]), np.uint8)
        times = np.repeat(starts, counts)
        times += steps
        if not lengths.all():
            times, lengths = times[lengths > 0], lengths[lengths > 0]
        return plain_reads(octets, times, lengths)
