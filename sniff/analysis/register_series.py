"""Registers of undescribed stations over time: blocks of words as they were answered. Pure, bounded."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from dissectors.columns import NONE, Times, counted
from dissectors.reading_columns import HOWS
from dissectors.readings import Origin
from sniff.analysis.point_reader import PointReader, Sample

if TYPE_CHECKING:
    from dissectors.manifest import Dissector
    from sniff.analysis.point_columns import PlainSamples, TableSamples
    from sniff.engine.engine import Output
    from sniff.engine.session import LineEvent
    from sniff.engine.table import Table

MOST_SAMPLES = 512
"""Answers of one block that are kept: beyond it every second one is let go, and so on."""

MOST_BLOCKS = 4096
ENOUGH = 2
"""Blocks that tell of one register, where not all are looked at."""

WORD_SPACES = ("holding", "input")

_WRITE = HOWS.index(Origin.WRITE)

Words = npt.NDArray[np.uint16]
Span = tuple[int, str, int, int]
"""Device, table, first register, and how many."""


@dataclass(slots=True)
class RegisterStretch:
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

    def add_many(self, times: Times, rows: Words) -> None:
        """Take answers that follow one another; the same as one after the other."""
        at = 0
        while at < len(times):
            skipped = -self.count % self._every  # none of these would be kept
            if at + skipped >= len(times):
                self.count += len(times) - at
                return
            at += skipped
            self.count += skipped
            self.add(int(times[at]), tuple(rows[at].tolist()))
            at += 1

    @property
    def words(self) -> Words:
        """uint16[answers, width]."""
        return np.array(self.rows, np.uint16).reshape(-1, self.width)


class RegisterSeries:
    """Fed the samples of one bus or more; gives blocks. `written`: what a master wrote, together as it wrote it.

    `objects`: by device, what it told that is no register: its kinds of objects.
    """

    def __init__(self) -> None:
        self._blocks: dict[Span, RegisterStretch] = {}
        self.written: set[Span] = set()
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
            if run and not _follows(run[-1], sample):
                self._keep(run)
                run = []
            run.append(sample)
        if run:
            self._keep(run)

    def add_samples(self, samples: TableSamples) -> None:
        """Take those of a table."""
        words = [one for one in samples.others if _is_word(one[1])]
        self.add_columns(_together(samples.plain, words) if words else samples.plain)
        self.add(sample for _, sample in samples.others if not _is_word(sample))

    def add_columns(self, plain: PlainSamples) -> None:
        """Take samples of many exchanges; the same as one after the other."""
        if not len(plain):
            return
        spaces = np.array([space in WORD_SPACES for space in plain.spaces])
        of_station = plain.device != NONE
        told = of_station & ~spaces[plain.space]
        for (device, space), _ in counted(plain.device[told], plain.space[told]):
            self.objects.setdefault(device, set()).add(plain.spaces[space])
        words = plain.take(of_station & spaces[plain.space])
        writes = words.how == _WRITE
        written = words.take(writes)
        begins, widths = _pieces(written)
        spans = counted(written.device[begins], written.space[begins], written.address[begins], widths)
        self.written |= {
            (device, written.spaces[space], address, width) for (device, space, address, width), _ in spans
        }
        self._keep_columns(words.take(~writes))

    def _keep_columns(self, words: PlainSamples) -> None:
        """Cut the columns where a sample is not the next register of the same answer, and keep the pieces by block."""
        if not len(words):
            return
        begins, widths = _pieces(words)
        keys = np.stack([words.device[begins], words.space[begins], words.address[begins], widths], axis=1)
        distinct, first, which = np.unique(keys, axis=0, return_index=True, return_inverse=True)
        which = which.reshape(-1)
        by_block = begins[np.argsort(which, kind="stable")]
        ends = np.cumsum(np.bincount(which))
        for number in np.argsort(first).tolist():
            device, space, address, width = distinct[number].tolist()
            block = self._block((device, words.spaces[space], address, width))
            if block is not None:
                at = by_block[ends[number - 1] if number else 0 : ends[number]]
                block.add_many(words.time[at], (words.raw[at[:, None] + np.arange(width)] & 0xFFFF).astype(np.uint16))

    def blocks(self) -> Iterator[RegisterStretch]:
        """All blocks, by device, table and register."""
        return (self._blocks[key] for key in sorted(self._blocks))

    def _keep(self, run: list[Sample]) -> None:
        first = run[0]
        assert first.device is not None
        key = first.device, first.value.reading.space, first.value.reading.address, len(run)
        if first.value.how is Origin.WRITE:
            self.written.add(key)
            return
        block = self._block(key)
        if block is None:
            return
        block.add(first.time, tuple((sample.value.reading.raw or 0) & 0xFFFF for sample in run))

    def _block(self, key: Span) -> RegisterStretch | None:
        block = self._blocks.get(key)
        if block is None and len(self._blocks) < MOST_BLOCKS:
            block = self._blocks[key] = RegisterStretch(*key)
        return block


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

        self.series.add_samples(samples_of(self.reader, table))

    def add_line_event(self, event: LineEvent) -> None:
        """It says nothing of a register."""


def _pieces(words: PlainSamples) -> tuple[Times, Times]:
    """Where a sample is not the next register of the same answer: the places, and how many samples each begins."""
    follows = np.zeros(len(words), bool)
    follows[1:] = words.address[1:] == words.address[:-1] + 1
    for name in ("order", "frame", "device", "space"):
        column = getattr(words, name)
        follows[1:] &= column[1:] == column[:-1]
    begins = np.flatnonzero(~follows)
    return begins, np.diff(np.append(begins, len(words)))


def _is_word(sample: Sample) -> bool:
    reading = sample.value.reading
    return reading.space in WORD_SPACES and reading.raw is not None and not sample.value.bit


def _together(plain: PlainSamples, words: Sequence[tuple[int, Sample]]) -> PlainSamples:
    """Both as columns in the order of closing: one that came late stands between others."""
    spaces = (*plain.spaces, *WORD_SPACES)
    columns: dict[str, list[int]] = {
        "order": [order for order, _ in words],
        "time": [one.time for _, one in words],
        "device": [NONE if one.device is None else one.device for _, one in words],
        "frame": [one.frame for _, one in words],
        "space": [spaces.index(one.value.reading.space) for _, one in words],
        "address": [one.value.reading.address for _, one in words],
        "raw": [(one.value.reading.raw or 0) & 0xFFFF for _, one in words],
        "how": [HOWS.index(one.value.reading.how) for _, one in words],
    }
    both = {name: np.concatenate([getattr(plain, name), values]) for name, values in columns.items()}
    in_order = np.argsort(both["order"], kind="stable")
    sorted_ones: dict[str, Any] = {name: values[in_order].astype(np.int64) for name, values in both.items()}
    return replace(plain, **sorted_ones, spaces=spaces, told=None)


def covering(blocks: Iterable[RegisterStretch]) -> list[RegisterStretch]:
    """Blocks that hold every register of all of them, those first that were answered most; none whose registers are
    all in two others already, so that their number is bounded by that of the registers."""
    covered: dict[tuple[int, str, int], int] = {}
    kept = []
    for block in sorted(blocks, key=lambda one: (-len(one.rows), -one.width)):
        places = [(block.device, block.space, block.first + step) for step in range(block.width)]
        if any(covered.get(place, 0) < ENOUGH for place in places):
            kept.append(block)
            for place in places:
                covered[place] = covered.get(place, 0) + 1
    return kept


def _follows(before: Sample, sample: Sample) -> bool:
    """Whether a sample is the next register of the same answer."""
    one, other = before.value.reading, sample.value.reading
    same = before.frame == sample.frame and before.device == sample.device and one.space == other.space
    return same and one.how is other.how and other.address == one.address + 1
