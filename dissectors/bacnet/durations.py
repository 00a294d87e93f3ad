"""Many durations in little memory: a histogram whose classes grow by 1/16, so that parts of a capture add up."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

_NOTHING: Mapping[int, int] = MappingProxyType({})


def _class_of(duration: int) -> int:
    """The class of a duration: exact below 16 ns, above it 16 classes to each doubling."""
    if duration < 16:
        return max(0, duration)
    shift = duration.bit_length() - 5
    return (shift + 1) * 16 + (duration >> shift) - 16


def _middle(number: int) -> int:
    if number < 16:
        return number
    shift, step = divmod(number, 16)
    low = (step + 16) << (shift - 1)
    return low + (1 << (shift - 1)) // 2


@dataclass(frozen=True, slots=True)
class Durations:
    """A distribution of durations, ns; percentiles are right within 1/16. `least`, `most` are exact."""

    count: int = 0
    total: int = 0
    least: int | None = None
    most: int | None = None
    classes: Mapping[int, int] = field(default_factory=lambda: _NOTHING)

    @property
    def mean(self) -> int | None:
        """Arithmetic mean, ns; None when empty."""
        return self.total // self.count if self.count else None

    def percentile(self, share: float) -> int | None:
        """The duration that `share` (0 … 1) of all do not exceed, ns; None when empty."""
        if not self.count or self.least is None or self.most is None:
            return None
        wanted, seen = share * self.count, 0
        for number in sorted(self.classes):
            seen += self.classes[number]
            if seen >= wanted:
                return min(max(_middle(number), self.least), self.most)
        return self.most

    def over(self, limit: int) -> int:
        """How many are longer than `limit`, to the width of a class."""
        edge = _class_of(limit)
        return sum(count for number, count in self.classes.items() if number > edge)

    def merge(self, other: Durations) -> Durations:
        """Both together."""
        classes = dict(self.classes)
        for number, count in other.classes.items():
            classes[number] = classes.get(number, 0) + count
        leasts = [v for v in (self.least, other.least) if v is not None]
        mosts = [v for v in (self.most, other.most) if v is not None]
        return Durations(
            self.count + other.count,
            self.total + other.total,
            min(leasts, default=None),
            max(mosts, default=None),
            MappingProxyType(classes),
        )


class DurationTally:
    """Collects durations; `value()` is what it has so far."""

    __slots__ = ("_classes", "_count", "_least", "_most", "_total")

    def __init__(self) -> None:
        self._count = self._total = 0
        self._least: int | None = None
        self._most: int | None = None
        self._classes: dict[int, int] = {}

    def add(self, duration: int) -> None:
        """Add one, ns; negative ones count as 0."""
        duration = max(0, duration)
        self._count += 1
        self._total += duration
        if self._least is None or duration < self._least:
            self._least = duration
        if self._most is None or duration > self._most:
            self._most = duration
        number = _class_of(duration)
        self._classes[number] = self._classes.get(number, 0) + 1

    def value(self) -> Durations:
        """The distribution so far."""
        return Durations(self._count, self._total, self._least, self._most, MappingProxyType(dict(self._classes)))
