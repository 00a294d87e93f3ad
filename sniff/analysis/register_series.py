"""What the registers of undescribed stations held over time: blocks of words as they were answered. Pure, bounded."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from dissectors.readings import How
from sniff.analysis.points import PointReader, Sample

if TYPE_CHECKING:
    from dissectors.manifest import Dissector
    from sniff.engine.engine import Output
    from sniff.engine.session import LineEvent
    from sniff.engine.table import Table

MOST_SAMPLES = 512
"""Answers of one block that are kept: beyond it every second one is let go, and so on."""

MOST_BLOCKS = 4096
WORD_SPACES = ("holding", "input")

Words = npt.NDArray[np.uint16]


@dataclass(slots=True)
class Block:
    """One stretch of registers, as one question asks for it again and again.

    `device`, `space`, `first`, `width`: whose, and which registers, as on the wire. `times`: ns; `rows`: the words of
    each answer that is kept. `count`: answers, those let go too.
    """

    device: int
    space: str
    first: int
    width: int
    times: list[int] = field(default_factory=list)
    rows: list[tuple[int, ...]] = field(default_factory=list)
    count: int = 0
    _every: int = 1

    def add(self, time: int, words: tuple[int, ...]) -> None:
        """Take an answer."""
        if self.count % self._every == 0:
            if len(self.rows) >= MOST_SAMPLES:
                del self.times[1::2], self.rows[1::2]
                self._every *= 2
            self.times.append(time)
            self.rows.append(words)
        self.count += 1

    @property
    def words(self) -> Words:
        """uint16[answers, width]."""
        return np.array(self.rows, np.uint16).reshape(-1, self.width)


class RegisterSeries:
    """Fed the samples of one bus or more; gives blocks. `written`: device, space, register of what a master wrote.

    `objects`: by device, what it told that is no register: its kinds of objects.
    """

    def __init__(self) -> None:
        self._blocks: dict[tuple[int, str, int, int], Block] = {}
        self.written: set[tuple[int, str, int]] = set()
        self.objects: dict[int, set[str]] = {}

    def of(self, dissector: Dissector) -> SeriesReader:
        """An observer that feeds it what a bus answers."""
        return SeriesReader(self, PointReader(dissector))

    def add(self, samples: Iterable[Sample]) -> None:
        """Take samples of one exchange or more, in their order."""
        run: list[Sample] = []
        for sample in samples:
            reading = sample.value.reading
            if sample.device is None:
                continue
            if reading.space not in WORD_SPACES:
                self.objects.setdefault(sample.device, set()).add(reading.space)
            if reading.space not in WORD_SPACES or reading.raw is None or sample.value.bit:
                continue
            if reading.how is How.WRITE:
                self.written.add((sample.device, reading.space, reading.address))
                continue
            if run and not _follows(run[-1], sample):
                self._keep(run)
                run = []
            run.append(sample)
        if run:
            self._keep(run)

    def blocks(self) -> Iterator[Block]:
        """All blocks, by device, table and register."""
        return (self._blocks[key] for key in sorted(self._blocks))

    def _keep(self, run: list[Sample]) -> None:
        first = run[0]
        assert first.device is not None
        key = first.device, first.value.reading.space, first.value.reading.address, len(run)
        block = self._blocks.get(key)
        if block is None:
            if len(self._blocks) >= MOST_BLOCKS:
                return
            block = self._blocks[key] = Block(*key)
        block.add(first.time, tuple((sample.value.reading.raw or 0) & 0xFFFF for sample in run))


@dataclass(frozen=True, slots=True)
class SeriesReader:
    """An observer (`engine.observer`) of one bus."""

    series: RegisterSeries
    reader: PointReader

    def add(self, output: Output) -> None:
        """Take rows and closed transactions."""
        self.series.add(self.reader.add(output))

    def add_table(self, table: Table) -> None:
        """Take many at once."""
        from sniff.analysis.table_points import samples_of

        self.series.add(samples_of(self.reader, table).in_order())

    def add_line_event(self, event: LineEvent) -> None:
        """It says nothing of a register."""


def _follows(before: Sample, sample: Sample) -> bool:
    """Whether a sample is the next register of the same answer."""
    one, other = before.value.reading, sample.value.reading
    same = before.frame == sample.frame and before.device == sample.device and one.space == other.space
    return same and other.address == one.address + 1
