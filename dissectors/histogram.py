"""Many durations in little memory: a histogram with a stated precision, so that parts of a capture add up."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

_STEPS = 32  # buckets per factor of two: a quantile is right to about 2 %


@dataclass(slots=True)
class Histogram:
    """Counts of non-negative integers (ns) in logarithmic buckets; a quantile is at most 2.2 % too large."""

    buckets: Counter[int] = field(default_factory=Counter)
    tops: dict[int, int] = field(default_factory=dict)  # the largest value of each bucket
    count: int = 0
    total: int = 0
    least: int | None = None
    most: int | None = None

    def add(self, value: int) -> None:
        """Count one value; negative ones count as 0."""
        if value < 0:
            value = 0
        bucket = _bucket(value)
        self.buckets[bucket] += 1
        if value > self.tops.get(bucket, -1):
            self.tops[bucket] = value
        self.count += 1
        self.total += value
        if self.least is None or value < self.least:
            self.least = value
        if self.most is None or value > self.most:
            self.most = value

    def add_many(self, values: npt.NDArray[np.int64]) -> None:
        """Count many values; the same as one after the other."""
        import numpy as np

        add_grouped(lambda group: self, np.zeros(len(values), np.int64), values)

    def merge(self, other: Histogram) -> Histogram:
        """Both together, as a new value."""
        least = [value for value in (self.least, other.least) if value is not None]
        most = [value for value in (self.most, other.most) if value is not None]
        return Histogram(
            self.buckets + other.buckets,
            {key: max(self.tops.get(key, 0), other.tops.get(key, 0)) for key in self.tops.keys() | other.tops.keys()},
            self.count + other.count,
            self.total + other.total,
            min(least, default=None),
            max(most, default=None),
        )

    def since(self, before: Histogram) -> Histogram:
        """What was added since `before`, an earlier copy; its least and most are right to the stated precision."""
        buckets = self.buckets - before.buckets
        tops = {bucket: self.tops[bucket] for bucket in buckets}
        return Histogram(
            buckets,
            tops,
            self.count - before.count,
            self.total - before.total,
            min(tops.values(), default=None),
            max(tops.values(), default=None),
        )

    def copy(self) -> Histogram:
        """As it is now, for a value that does not change any more."""
        return Histogram(Counter(self.buckets), dict(self.tops), self.count, self.total, self.least, self.most)

    @property
    def mean(self) -> float | None:
        """Arithmetic mean, None without values."""
        return self.total / self.count if self.count else None

    def quantile(self, share: float) -> int | None:
        """The value that `share` (0 … 1) of all values do not exceed, one of those that were counted; None without."""
        if not self.count or self.least is None or self.most is None:
            return None
        rank = max(1, math.ceil(share * self.count))
        seen = 0
        for bucket in sorted(self.buckets):
            seen += self.buckets[bucket]
            if seen >= rank:
                return self.tops[bucket]
        return self.most

    def apart(self, low: float, high: float) -> int | None:
        """How far apart the values from one share to another are, at most: those of one bucket are not told apart."""
        least, most = self.quantile(low), self.quantile(high)
        if least is None or most is None or self.least is None:
            return None
        return most - max(self.least, min(least, math.floor(2 ** ((_bucket(least) - 1) / _STEPS))))

    def spread(self, edges: Sequence[int]) -> list[int]:
        """Counts of the values below the first edge, between two neighbours …, and from the last edge on (edges
        ascending, ns); a value nearer to an edge than the precision may be counted on its other side."""
        counts = [0] * (len(edges) + 1)
        for bucket, count in self.buckets.items():
            counts[bisect_right(edges, self.tops[bucket])] += count
        return counts


def width(ordered: Sequence[int]) -> int:
    """Within how many ns eight in ten of a few durations lie, the others beside them; they are given ascending."""
    return ordered[9 * len(ordered) // 10] - ordered[len(ordered) // 10]


def _bucket(value: int) -> int:
    return 0 if value < 1 else 1 + int(math.log2(value) * _STEPS)


def add_grouped(
    of: Callable[[int], Histogram], groups: npt.NDArray[np.integer[Any]], values: npt.NDArray[np.int64]
) -> None:
    """Count each value in the histogram of its group; the same as one after the other. `groups`: 0 or more."""
    import numpy as np

    if not len(values):
        return
    if len(values) < _FEW:
        for group, value in zip(groups.tolist(), values.tolist(), strict=True):
            of(group).add(value)
        return
    values = np.maximum(values, 0)
    if int(values.max()) < 1 << _VALUE_BITS and int(groups.max()) < 1 << (63 - _VALUE_BITS):
        both = groups.astype(np.int64) << _VALUE_BITS | values  # sorted far faster than by a key
        both.sort()
        groups, values = both >> _VALUE_BITS, both & ((1 << _VALUE_BITS) - 1)
    else:
        order = np.lexsort((values, groups))
        groups, values = groups[order].astype(np.int64), values[order]
    keys = groups * _BUCKETS + np.searchsorted(_edges(), values, side="right")
    begins = np.flatnonzero(np.append(True, keys[1:] != keys[:-1]))
    ends = np.append(begins[1:], len(keys))
    first = np.append(np.flatnonzero(np.append(True, np.diff(groups[begins]))), len(begins)).tolist()
    buckets, counts = (keys[begins] % _BUCKETS).tolist(), (ends - begins).tolist()
    tops, leasts = values[ends - 1].tolist(), values[begins].tolist()
    sums = np.add.reduceat(values, begins).tolist()
    for begin, end in pairwise(first):
        histogram = of(int(groups[begins[begin]]))
        held, largest = histogram.buckets, histogram.tops
        for bucket, count, top in zip(buckets[begin:end], counts[begin:end], tops[begin:end], strict=True):
            held[bucket] += count
            largest[bucket] = max(top, largest.get(bucket, 0))
        least, most = leasts[begin], tops[end - 1]
        histogram.count += sum(counts[begin:end])
        histogram.total += sum(sums[begin:end])
        histogram.least = least if histogram.least is None else min(histogram.least, least)
        histogram.most = most if histogram.most is None else max(histogram.most, most)


_FEW = 64
"""Values that cost less one after the other."""

_VALUE_BITS = 48
"""Bits of a value that is sorted together with its group: 78 hours in ns."""

_BUCKETS = 1 << 12
"""More than there are for any value of 64 bits."""


@cache
def _edges() -> npt.NDArray[np.int64]:
    """The least value of each bucket but the first."""
    import numpy as np

    edges = []
    for bucket in range(1, 63 * _STEPS):
        edge = max(1, math.floor(2 ** ((bucket - 1) / _STEPS)) - 1)
        while _bucket(edge) < bucket:
            edge += 1
        edges.append(edge)
    return np.array(edges, np.int64)
