"""Samples of many exchanges as columns: plain registers, of stations without a profile. Pure."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from dissectors.columns import NONE, Codes, Masks, Numbers, Times
from dissectors.histogram import Histogram
from dissectors.profiles.decoding import Quality, Value, plain_name
from dissectors.reading_columns import HOWS
from dissectors.readings import Origin, Reading
from sniff.analysis.point_reader import Sample, station_name
from sniff.analysis.points import HISTORY, Key, PointTable, SampleRun

_WRITE = HOWS.index(Origin.WRITE)


@dataclass(frozen=True, slots=True)
class PlainSamples:
    """One entry a sample, in the order of closing. `order`: place of its exchange, ascending. `device`: `NONE` for all.

    The others as in `Sample` and its `Reading`; `space` and `how` are places in `spaces` and `HOWS`.
    """

    order: Times
    time: Times
    device: Numbers
    frame: Times
    space: Codes
    address: Numbers
    raw: Numbers
    how: Codes
    spaces: tuple[str, ...] = ("",)

    def __len__(self) -> int:
        return len(self.order)

    def take(self, which: Masks | Times) -> PlainSamples:
        """Some of them."""
        return replace(self, **{one.name: getattr(self, one.name)[which] for one in fields(self)[:-1]})

    def points(self) -> tuple[list[Key], Times]:
        """The points that there are, and of which each sample is."""
        whole = (self.device.astype(np.int64) + 1) << 24 | self.space.astype(np.int64) << 16 | self.address
        distinct, which = np.unique(whole, return_inverse=True)
        keys = [
            (
                station_name((one >> 24) - 1 if one >> 24 else None),
                plain_name(self.spaces[one >> 16 & 0xFF], one & 0xFFFF),
            )
            for one in distinct.tolist()
        ]
        return keys, which.astype(np.int64)

    def samples(self) -> Iterator[Sample]:
        """All as objects."""
        columns = (self.time, self.device, self.frame, self.space, self.address, self.raw, self.how)
        for time, device, frame, space, address, raw, how in zip(*(one.tolist() for one in columns), strict=True):
            reading = Reading(self.spaces[space], address, raw, raw, HOWS[how])
            value = Value(plain_name(reading.space, address), raw, raw, "", Quality.GOOD, reading)
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
    plain = samples.plain
    keys, which = plain.points()
    one_by_one = [((order, at), sample) for at, (order, sample) in enumerate(samples.others)]
    both = {(sample.station, sample.name) for _, sample in samples.others}
    mixed = np.array([key in both for key in keys], bool)
    if mixed.any():  # a point of which there are both
        places = np.flatnonzero(mixed[which])
        orders = zip(plain.order[places].tolist(), places.tolist(), strict=True)
        one_by_one += zip(orders, plain.take(places).samples(), strict=True)
    one_by_one.sort(key=lambda one: one[0])
    runs = [run for run, among in zip(_runs(plain, keys, which), mixed.tolist(), strict=True) if not among]
    at = 0
    for run in sorted(runs, key=lambda run: run.begin):
        while at < len(one_by_one) and one_by_one[at][0] < run.begin:
            table.add([one_by_one[at][1]])
            at += 1
        run.add_to(table, plain)
    table.add([sample for _, sample in one_by_one[at:]])


@dataclass(frozen=True, slots=True)
class _Run:
    """All samples of one point. `places`: of each in the columns; `begin`: of the first, its exchange before it."""

    key: Key
    begin: tuple[int, int]
    places: Times

    def add_to(self, table: PointTable, plain: PlainSamples) -> None:
        """Give a table of points all of them."""
        places = self.places
        raws = plain.raw[places]
        changes = np.flatnonzero(raws[1:] != raws[:-1])
        changed = int(plain.time[places[changes[-1] + 1]]) if len(changes) else None
        last = next(plain.take(places[-1:]).samples())
        newest = places[-HISTORY:]
        history = list(zip(plain.time[newest].tolist(), plain.raw[newest].astype(float).tolist(), strict=True))
        times = plain.time[places]
        first = int(raws[0]), int(times[0])
        every = Histogram()
        every.add_many(np.diff(times))
        written = int(np.count_nonzero(plain.how[places] == _WRITE))
        seen = SampleRun(len(places), every, float(raws.min()), float(raws.max()), written)
        table.add_run(self.key, last, first, changed, history, seen)


def _runs(plain: PlainSamples, keys: Sequence[Key], which: Times) -> Iterator[_Run]:
    order = np.argsort(which, kind="stable")
    ends = np.cumsum(np.bincount(which, minlength=len(keys)))
    for number, key in enumerate(keys):
        places = order[ends[number - 1] if number else 0 : ends[number]]
        yield _Run(key, (int(plain.order[places[0]]), int(places[0])), places)
