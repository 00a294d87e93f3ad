"""Samples of many exchanges as columns: numbers, of stations without a profile. Pure."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from dissectors.columns import NONE, Codes, Masks, Names, Numbers, Times
from dissectors.histogram import Histogram
from dissectors.profiles.decoding import Quality, Value, point_name
from dissectors.reading_columns import HOWS, Bits, ToldValues
from dissectors.readings import Origin, Reading
from sniff.analysis.point_reader import Sample, station_name
from sniff.analysis.points import HISTORY, Key, PointTable, SampleRun

MANY = 12
"""Samples of one point in a table that are quicker taken together than one by one."""

_WRITE = HOWS.index(Origin.WRITE)


@dataclass(frozen=True, slots=True)
class PlainSamples:
    """One entry a sample, in the order of closing. `order`: place of its exchange, ascending. `device`: `NONE` for all.

    The others as in `Sample` and its `Reading`; `space` and `how` are places in `spaces` and `HOWS`. `told`: None where
    each value is its `raw`.
    """

    order: Times
    time: Times
    device: Numbers
    frame: Times
    space: Codes | Names
    address: Numbers
    raw: Bits
    how: Codes
    spaces: tuple[str, ...] = ("",)
    told: ToldValues | None = None

    def __len__(self) -> int:
        return len(self.order)

    def take(self, which: Masks | Times) -> PlainSamples:
        """Some of them."""
        columns: dict[str, Any] = {one.name: getattr(self, one.name)[which] for one in fields(self)[:-2]}
        return replace(self, **columns, told=self.told.take(which) if self.told is not None else None)

    @property
    def number(self) -> npt.NDArray[Any]:
        """What each is."""
        return self.raw if self.told is None else self.told.number

    def values(self) -> Iterable[int | float]:
        """The same one by one, whole numbers as such."""
        return self.raw.tolist() if self.told is None else self.told.numbers()

    def words(self) -> Iterable[str]:
        """In the protocol's own words, where it has some."""
        told = self.told
        return ("",) * len(self) if told is None else (told.phrases[at] for at in told.words.tolist())

    def units(self) -> Iterable[str]:
        """Of each, where the protocol itself fixes one."""
        told = self.told
        return ("",) * len(self) if told is None else (told.units[at] for at in told.words.tolist())

    def _parts_and_stations(self) -> tuple[Iterable[str], Iterable[int | None]]:
        told = self.told
        if told is None:
            return ("",) * len(self), (None,) * len(self)
        return (told.parts[at] for at in told.part.tolist()), told.station.tolist()

    def points(self) -> tuple[list[Key], Times]:
        """The points that there are, and of which each sample is."""
        whole = (self.device.astype(np.int64) + 1) << 48 | self.space.astype(np.int64) << 32 | self.address
        distinct, which = np.unique(whole, return_inverse=True)
        parts: tuple[str, ...] = ("",)
        part_of = [0] * len(distinct)
        if self.told is not None and len(self.told.parts) > 1:
            parts = self.told.parts
            both, which = np.unique(which.astype(np.int64) * len(parts) + self.told.part, return_inverse=True)
            distinct, part_of = distinct[both // len(parts)], (both % len(parts)).tolist()
        keys = [
            (
                station_name((one >> 48) - 1 if one >> 48 else None),
                point_name(self.spaces[one >> 32 & 0xFFFF], one & 0xFFFF_FFFF, parts[part]),
            )
            for one, part in zip(distinct.tolist(), part_of, strict=True)
        ]
        return keys, which.astype(np.int64)

    def samples(self) -> Iterator[Sample]:
        """All as objects."""
        numbers = (self.time, self.device, self.frame, self.space, self.address, self.raw, self.how)
        columns = zip(*(one.tolist() for one in numbers), strict=True)
        told = zip(self.values(), self.words(), self.units(), *self._parts_and_stations(), strict=True)
        for (time, device, frame, space, address, raw, how), (number, words, unit, part, station) in zip(
            columns, told, strict=True
        ):
            reading = Reading(
                self.spaces[space], address, raw, number, HOWS[how], part, station=station, words=words, unit=unit
            )
            name = point_name(reading.space, address, part)
            value = Value(name, number, raw, unit, Quality.GOOD, reading, words=words)
            yield Sample(time, None if device == NONE else device, value, frame)


def no_samples() -> PlainSamples:
    """None at all."""
    nothing, small, codes = np.zeros(0, np.int64), np.zeros(0, np.int32), np.zeros(0, np.uint8)
    return PlainSamples(nothing, nothing, small, nothing, codes, small, small, codes)


@dataclass(frozen=True, slots=True)
class TableSamples:
    """Samples of a table: those that are plain, and the others as they are, each with the place of its exchange."""

    plain: PlainSamples
    others: Sequence[tuple[int, Sample]]

    def in_order(self) -> Iterator[Sample]:
        """All as objects, in the order of closing."""
        plain = zip(self.plain.order.tolist(), self.plain.samples(), strict=True)
        for _, sample in sorted([*plain, *self.others], key=lambda one: one[0]) if self.others else plain:
            yield sample

    @property
    def last(self) -> int | None:
        """The latest time of all, ns."""
        times = [sample.time for _, sample in self.others]
        if len(self.plain):
            times.append(int(self.plain.time.max()))
        return max(times, default=None)

    def named(self, wanted: Callable[[str], bool]) -> TableSamples:
        """Only those of points whose name is wanted."""
        points, which = self.plain.points()
        chosen = np.array([wanted(name) for _, name in points], bool)
        others = [(order, sample) for order, sample in self.others if wanted(sample.name)]
        return TableSamples(self.plain.take(chosen[which]) if points else self.plain, others)


def add_to(table: PointTable, samples: TableSamples) -> None:
    """Give a table of points the samples that follow; the same as one after the other."""
    for one in by_point(samples):
        if isinstance(one, PointRun):
            one.add_to(table)
        else:
            table.add([one])


def by_point(samples: TableSamples) -> Iterator[PointRun | Sample]:
    """All samples of a point at once, in the place of the first, where they are many and all of them plain; others one
    by one, those of a point in their order."""
    plain = samples.plain
    keys, which = plain.points()
    one_by_one = [((order, at), sample) for at, (order, sample) in enumerate(samples.others)]
    both = {(sample.station, sample.name) for _, sample in samples.others}
    mixed = np.array([key in both for key in keys], bool)  # a point of which there are both
    mixed |= np.bincount(which, minlength=len(keys)) < MANY
    if mixed.any():
        places = np.flatnonzero(mixed[which])
        orders = zip(plain.order[places].tolist(), places.tolist(), strict=True)
        one_by_one += zip(orders, plain.take(places).samples(), strict=True)
    one_by_one.sort(key=lambda one: one[0])
    runs = [run for run, among in zip(_runs(plain, keys, which), mixed.tolist(), strict=True) if not among]
    at = 0
    for run in sorted(runs, key=lambda run: run.begin):
        while at < len(one_by_one) and one_by_one[at][0] < run.begin:
            yield one_by_one[at][1]
            at += 1
        yield run
    for _, sample in one_by_one[at:]:
        yield sample


@dataclass(frozen=True, slots=True)
class PointRun:
    """All samples of one point. `places`: of each in the columns; `begin`: of the first, its exchange before it."""

    key: Key
    begin: tuple[int, int]
    places: Times
    plain: PlainSamples

    def numbers(self) -> Iterator[tuple[int, float]]:
        """Times, ns, and values."""
        places, plain = self.places, self.plain
        return zip(plain.time[places].tolist(), plain.number[places].astype(float).tolist(), strict=True)

    @property
    def unit(self) -> str:
        """Of the first."""
        return next(iter(self.plain.take(self.places[:1]).units()))

    def add_to(self, table: PointTable) -> None:
        """Give a table of points all of them."""
        places, plain = self.places, self.plain
        numbers = plain.number[places]
        changes = np.flatnonzero(numbers[1:] != numbers[:-1])
        changed = int(plain.time[places[changes[-1] + 1]]) if len(changes) else None
        last = next(plain.take(places[-1:]).samples())
        first = next(iter(plain.take(places[:1]).values())), int(plain.time[places[0]])
        history = list(replace(self, places=places[-HISTORY:]).numbers())
        every, times, since = Histogram(), plain.time[places], None
        steps = np.diff(times)
        if table.is_apart(int(times[0]), int(times[-1])):
            apart = np.array([table.is_apart(*two) for two in pairwise(times.tolist())], bool)
            steps, since = steps[~apart], int(times[1:][apart][-1])
        every.add_many(steps)
        written = int(np.count_nonzero(plain.how[places] == _WRITE))
        seen = SampleRun(len(places), every, float(numbers.min()), float(numbers.max()), written, since)
        table.add_run(self.key, last, first, changed, history, seen)


def _runs(plain: PlainSamples, keys: Sequence[Key], which: Times) -> Iterator[PointRun]:
    order = np.argsort(which, kind="stable")
    ends = np.cumsum(np.bincount(which, minlength=len(keys)))
    for number, key in enumerate(keys):
        places = order[ends[number - 1] if number else 0 : ends[number]]
        yield PointRun(key, (int(plain.order[places[0]]), int(places[0])), places, plain)
