"""Drift of a station's response time over the days: how much, and how sure. Pure.

Of each day with enough answers the median counts once, so that a busy day is no more than a quiet one. Before and after
are the medians of the first and the last third of the days; the speed is the median of the slopes between all pairs of
days (Theil and Sen), which one strange day does not move. How sure: the probability that days without any trend, in
a random order, rise or fall as steadily as these did (Kendall's rank correlation with the days, two-sided; of few days
all orders are tried).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from enum import Enum
from functools import cache
from itertools import combinations, permutations
from statistics import median

from dissectors.histogram import Histogram

DAYS = 3
"""Fewer say nothing."""

ANSWERS = 20
"""Of a day that counts."""

GROWN = 1.25
"""Factor between before and after from which on a drift is told; less is shown in the tables only."""

FEW = 7
"""Of so many days all orders are tried: 5040."""

MOST = 400
"""Days whose pairs are looked at; of more, so many evenly spread."""


class DriftSureness(Enum):
    """How sure a drift is, by the chance of seeing as much without one."""

    SURE = "sure"  # at most 1 in 100
    LIKELY = "likely"  # at most 1 in 20
    UNSURE = "unsure"


@dataclass(frozen=True, slots=True)
class Drift:
    """Of one station. `before`, `after`: medians, ns; `slope`: ns a day; `chance`: 0 … 1; `since`: the day from which
    on most medians are nearer to after than to before; `medians`: day and ns, ascending."""

    station: int
    before: int
    after: int
    slope: float
    chance: float
    since: str
    medians: tuple[tuple[str, int], ...]

    @property
    def sure(self) -> DriftSureness:
        """In one word."""
        return (
            DriftSureness.SURE
            if self.chance <= 0.01
            else DriftSureness.LIKELY
            if self.chance <= 0.05
            else DriftSureness.UNSURE
        )

    def is_told(self, latency: int) -> bool:
        """Whether it is large enough to be told, and more than the adapters may have added (`latency`, ns)."""
        low, high = sorted((self.before, self.after))
        return high - low > latency and high > GROWN * low


def drift(station: int, days: Sequence[tuple[str, Histogram]]) -> Drift | None:
    """None where there are too few days with enough answers. `days`: dates ascending."""
    told = [(day, value) for day, one in days if one.count >= ANSWERS and (value := one.quantile(0.5)) is not None]
    if len(told) < DAYS:
        return None
    thin = told[:: math.ceil(len(told) / MOST)]
    places = [date.fromisoformat(day).toordinal() for day, _ in thin]
    values = [value for _, value in thin]
    third = max(1, len(told) // 3)
    before = int(median(value for _, value in told[:third]))
    after = int(median(value for _, value in told[-third:]))
    slopes = [(b - a) / (y - x) for (x, a), (y, b) in combinations(zip(places, values, strict=True), 2)]
    return Drift(station, before, after, median(slopes), chance(values), _since(told, before, after), tuple(told))


def _since(told: Sequence[tuple[str, int]], before: int, after: int) -> str:
    """The day at which a step from before to after fits best."""
    late = [abs(value - after) < abs(value - before) for _, value in told]
    scores = [sum(not one for one in late[:at]) + sum(late[at:]) for at in range(1, len(told))]
    return told[1 + scores.index(max(scores))][0]


def chance(values: Sequence[int]) -> float:
    """Probability that the values in a random order are as ordered as these; 1 where all are equal."""
    score = abs(_score(values))
    if len(values) <= FEW:
        return _among_all(tuple(sorted(values)), score)
    size = len(values)
    spread = size * (size - 1) * (2 * size + 5)
    spread -= sum(count * (count - 1) * (2 * count + 5) for count in Counter(values).values())
    return math.erfc(max(0, score - 1) / math.sqrt(spread / 18) / math.sqrt(2)) if spread else 1.0


@cache
def _among_all(values: tuple[int, ...], score: int) -> float:
    orders = [abs(_score(order)) >= score for order in permutations(values)]
    return sum(orders) / len(orders)


def _score(values: Sequence[int]) -> int:
    """Kendall's: pairs that rise less those that fall."""
    return sum((b > a) - (b < a) for a, b in combinations(values, 2))
