"""Points: the latest value of each by device and name, with a short history. Pure.

`PointTable` is fed the samples that a `PointReader` takes out of exchanges, and merges.
"""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from math import isnan
from typing import NamedTuple

from dissectors.histogram import Histogram
from dissectors.line import NS_PER_S
from dissectors.profiles.decoding import Quality
from dissectors.profiles.model import Entry
from dissectors.readings import Origin
from sniff.analysis.point_reader import Sample

MOST_POINTS = 50_000
HISTORY = 120
MOST_HOLES = 4096


class SampleRun(NamedTuple):
    """Samples of one point that follow one another, as in `Point`. `since`: of the first behind the latest hole among
    them, ns; None without one."""

    samples: int
    every: Histogram
    low: float
    high: float
    written: int
    since: int | None = None


@dataclass(slots=True)
class Point:
    """The latest of one point. `changed`: ns, when its value last became another one, 0 when it never did; `history`:
    (ns, value). `first`: value and time, ns, of the earliest sample. `every`: ns from one sample to the next; `low`,
    `high`: of its numbers; `written`: how many of the samples a master wrote; `since`: of the first sample behind the
    latest hole, ns: over a hole there is no interval and no rate."""

    sample: Sample
    count: int = 0
    changed: int = 0
    history: deque[tuple[int, float]] = field(default_factory=lambda: deque(maxlen=HISTORY))
    every: Histogram = field(default_factory=Histogram)
    low: float | None = None
    high: float | None = None
    written: int = 0
    since: int | None = None
    first: tuple[int | float | str, int] = field(init=False)

    def __post_init__(self) -> None:
        self.first = self.sample.value.value, self.sample.time

    @property
    def entry(self) -> Entry | None:
        """What the profile says of it."""
        return self.sample.value.entry

    @property
    def is_command(self) -> bool:
        """Whether the latest was written to the station, not read from it."""
        return self.sample.value.how is Origin.WRITE

    @property
    def quality(self) -> Quality:
        """Of the latest sample."""
        return self.sample.value.quality

    @property
    def interval(self) -> int | None:
        """From one sample to the next as it usually is, ns; None where there was but one."""
        return self.every.quantile(0.5)

    @property
    def jitter(self) -> int | None:
        """By how much nine of ten intervals differ at most, halved: ± ns; None with less than three samples."""
        apart = self.every.apart(0.05, 0.95)
        return None if apart is None or self.every.count < 2 else apart // 2

    @property
    def rate(self) -> float | None:
        """Mean change a second, up and down, lately; None where no time went by."""
        lately = [one for one in self.history if self.since is None or one[0] >= self.since]
        if len(lately) < 2 or lately[-1][0] <= lately[0][0]:
            return None
        moved = sum(abs(now - was) for (_, was), (_, now) in pairwise(lately))
        return moved * NS_PER_S / (lately[-1][0] - lately[0][0])

    def reach_time(self, time: int, is_behind_hole: bool) -> None:
        """The next sample is of that time, ns."""
        if is_behind_hole:
            self.since = time
        else:
            self.every.add(time - self.sample.time)

    def add(self, sample: Sample, is_behind_hole: bool = False) -> None:
        """Take a later sample."""
        if self.count:
            self.reach_time(sample.time, is_behind_hole)
            if _are_different(sample.value.value, self.sample.value.value):
                self.changed = sample.time
        self.sample = sample
        self.count += 1
        self.written += sample.value.how is Origin.WRITE
        if sample.finite and not isinstance(sample.value.value, str):
            number = float(sample.value.value)
            self.history.append((sample.time, number))
            self.reach(number, number)

    def reach(self, low: float, high: float) -> None:
        """Its numbers went from `low` to `high`."""
        self.low = low if self.low is None else min(self.low, low)
        self.high = high if self.high is None else max(self.high, high)

    def copy(self) -> Point:
        """The same, which goes on by itself."""
        copy = Point(
            self.sample,
            self.count,
            self.changed,
            self.history.copy(),
            self.every.copy(),
            self.low,
            self.high,
            self.written,
            self.since,
        )
        copy.first = self.first
        return copy

    def go_on(self, later: Point, is_behind_hole: bool = False) -> None:
        """Take what a later stretch saw of the same point."""
        if later.changed:
            self.changed = later.changed
        elif _are_different(later.first[0], self.sample.value.value):
            self.changed = later.first[1]
        self.every = self.every.merge(later.every)
        self.reach_time(later.first[1], is_behind_hole)
        self.since = self.since if later.since is None else later.since
        if later.low is not None and later.high is not None:
            self.reach(later.low, later.high)
        self.written += later.written
        self.sample = later.sample
        self.count += later.count
        self.history.extend(later.history)


def _are_different(one: float | str, other: float | str) -> bool:
    """Whether a value became another one; what is no number and stays so did not."""
    return one != other and not (isinstance(one, float) and isinstance(other, float) and isnan(one) and isnan(other))


Key = tuple[str, str]
"""Station and name of a point."""


class PointTable:
    """The latest value of every point, in the order of first sight. `dropped`: samples of points beyond the limit."""

    def __init__(self) -> None:
        self._points: dict[Key, Point] = {}
        self.dropped = 0
        self.version = 0
        self._holes: list[int] = []  # when octets may have been missed, ns, ascending

    def miss(self, time: int) -> None:
        """Octets may be lost at `time`, ns."""
        self._holes.append(max(time, self._holes[-1]) if self._holes else time)
        del self._holes[:-MOST_HOLES]

    def is_apart(self, one: int, later: int) -> bool:
        """Whether there was a hole between two samples, by their times, ns."""
        return bool(self._holes) and bisect_right(self._holes, one) < bisect_right(self._holes, later)

    def add(self, samples: Iterable[Sample]) -> None:
        """Take samples in the order of time."""
        for sample in samples:
            key = sample.station, sample.name
            point = self._points.get(key)
            if point is None:
                if len(self._points) >= MOST_POINTS:
                    self.dropped += 1
                    continue
                point = self._points[key] = Point(sample)
            point.add(sample, self.is_apart(point.sample.time, sample.time))
            self.version += 1

    def add_run(
        self,
        key: Key,
        last: Sample,
        first: tuple[float, int],
        changed: int | None,
        history: Iterable[tuple[int, float]],
        seen: SampleRun,
    ) -> None:
        """Take samples of one point, numbers all, of which `last` is the last. `first`: value and time of the
        first; `changed`: ns, of the last that was another one than the one before it among them, None where none was;
        `history`: of the last `HISTORY`; `seen`: what they add up to."""
        count = seen.samples
        point = self._points.get(key)
        if point is None:
            if len(self._points) >= MOST_POINTS:
                self.dropped += count
                return
            point = self._points[key] = Point(last)
            point.first = first
        else:
            point.reach_time(first[1], self.is_apart(point.sample.time, first[1]))
            if _are_different(point.sample.value.value, first[0]):
                point.changed = first[1]
        if changed is not None:
            point.changed = changed
        point.sample = last
        point.count += count
        point.history.extend(history)
        point.every = point.every.merge(seen.every)
        point.reach(seen.low, seen.high)
        point.written += seen.written
        point.since = point.since if seen.since is None else seen.since
        self.version += count

    def merge(self, later: PointTable) -> PointTable:
        """With a table of a later stretch of the same bus, as a new value: the table of both stretches. Where either
        was full, what it dropped stays dropped."""
        whole = PointTable()
        whole.dropped = self.dropped + later.dropped
        whole._holes = sorted([*self._holes, *later._holes])[-MOST_HOLES:]
        whole._points = {key: point.copy() for key, point in self._points.items()}
        for key, point in later._points.items():
            mine = whole._points.get(key)
            if mine is not None:
                mine.go_on(point, whole.is_apart(mine.sample.time, point.first[1]))
            elif len(whole._points) < MOST_POINTS:
                whole._points[key] = point.copy()
            else:
                whole.dropped += point.count
        whole.version = sum(point.count for point in whole._points.values())
        return whole

    def __len__(self) -> int:
        return len(self._points)

    def __iter__(self) -> Iterator[Point]:
        return iter(self._points.values())

    def get(self, station: str, name: str) -> Point | None:
        """One point."""
        return self._points.get((station, name))
