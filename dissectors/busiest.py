"""The busiest quarter of an hour: whether what is rare over a night was a fault of its own for a while. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

QUARTER: Final = 900_000_000_000  # ns

LEAST, SHARE = 10, 20
"""So many in one quarter of an hour, and one in so many of what came then, is no chance of a long night."""

SURELY: Final = 52
"""So many in one quarter are over two a minute, which Johnson Controls calls tolerable, and more than chance makes of
that in the worst quarter of a night (30 and four times its root): heard alone, that quarter would be worth a warning,
however much else was right."""

_KEPT = 1024

Quarters = dict[int, int]
"""How many came in each quarter of an hour that had any, by its number since the epoch."""


def count(quarters: Quarters, time: int) -> None:
    """One more at a time, ns. Beyond ten days of quarters, new ones are passed over."""
    number = time // QUARTER
    if number in quarters or len(quarters) < _KEPT:
        quarters[number] = quarters.get(number, 0) + 1


def take_back(quarters: Quarters) -> None:
    """One of the newest was none."""
    newest = max(quarters, default=None)
    if newest is not None:
        quarters[newest] -= 1
        if not quarters[newest]:
            del quarters[newest]


def summed(parts: Iterable[Mapping[int, int]]) -> Quarters:
    """Those of several."""
    total: Quarters = {}
    for part in parts:
        for number, times in part.items():
            total[number] = total.get(number, 0) + times
    return total


def is_fault(quarters: Mapping[int, int], of: int, span: int) -> bool:
    """Whether one quarter had so many as to be worth a warning. `of`: what they are part of, in all `span` ns."""
    most = max(quarters.values(), default=0)
    return most >= SURELY or (most >= LEAST and SHARE * most * max(span, QUARTER) >= of * QUARTER)


def words(quarters: Mapping[int, int], count: int, of: int, span: int) -> str:
    """How many of `count` came within a quarter of an hour, where that was a fault and twice its part of them; else
    empty. Quarters are those of the clock, so that it may be more."""
    most = max(quarters.values(), default=0)
    if not is_fault(quarters, of, span) or span < 4 * QUARTER or most * span < 2 * count * QUARTER:
        return ""
    return f"; at least {min(count, most)} of them within a quarter of an hour"
