"""What the times of one log mean, told by its first lines together: which of two numbers is the day, and what a number
that nobody named counts. Pure.

A date of two small numbers reads two ways. What holds for one of its dates holds for all: a number above 12 is a day;
of two readings that which goes forward, and in smaller steps, is right. Where both do, one is assumed, and said.

A number that stands before every line and rises is a time. Its unit is told by what it must be: octets take their time
on the line, a clock since 1970 shows a year that serial buses had, and nobody logs a bus once a minute by the µs.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from decimal import Decimal
from enum import Enum
from itertools import pairwise

from dissectors.line import MS, NS_PER_S

FASTEST = 130_000
"""ns an octet of a log takes at least, on average: 115200 Bd, two thirds busy."""

SLOWEST = 60 * NS_PER_S
"""ns from one line to the next, in the middle of a log, from which on a finer unit is meant."""

SLOWEST_ANSWER = 5 * NS_PER_S
"""The same for the shorter steps, from a request to its answer."""

SLOWEST_OCTET = NS_PER_S // 5
"""The same where each line is an octet: most follow one another in a frame."""

EPOCH = (1_100_000_000, 2_600_000_000)
"""s since 1970 that a log may have been written at: 2004 to 2052."""

LEAST = 3
"""Numbers that tell something."""

_US, _NS = MS // 1000, 1
_RISING = 0.9
_DATE = re.compile(r"(?<![0-9A-Za-z:.])(\d{1,4})([-./])(\d{1,2})\2(\d{1,4})(?=[ \tT_,]+\d{1,2}:\d{2})")
BARE = re.compile(
    r"[\s>*|#]*(?:[^\W\d_]{1,12}(?:[:=]\s*|\s+))?[\[({<]?\s*(?P<number>-?\d{1,19}(?:\.\d{1,9}|,\d{3,9})?)"
    r"(?=\s*[\])}>]|[:|;,]?[ \t]|[|;,\t:])"
)
"""A number ahead of a line, behind a direction at most."""


class Order(Enum):
    """How the numbers of a date follow one another, where the year is not first and of four digits."""

    DAY_FIRST = "day.month.year"
    MONTH_FIRST = "month/day/year"
    YEAR_FIRST = "year-month-day"  # a year of two digits


@dataclass(frozen=True, slots=True)
class Times:
    """How times of one log are read. `order`: of a date; None: as its signs suggest. `unit`: ns that the number ahead
    of a line counts; 0: such a number is no time. `since_1970`: it counts from there. `steps`: times are those since
    the line before. `clocks_only`: only a date or a time of day is a time. `said`: what was assumed, in words.
    """

    order: Order | None = None
    unit: int = 0
    since_1970: bool = False
    steps: bool = False
    clocks_only: bool = False
    said: tuple[str, ...] = ()


AS_WRITTEN = Times()
"""What is read where nobody has looked at the log."""


def order_of(texts: Sequence[str]) -> Times:
    """What the dates of a log say."""
    found = [match for text in texts if (match := _DATE.search(text[:160])) is not None and int(match[1]) <= 31]
    if not found:
        return AS_WRITTEN
    dates = [(int(match[1]), int(match[3]), int(match[4])) for match in found]
    short = all(len(match[1]) <= 2 and len(match[4]) <= 2 for match in found)
    readings = [Order.DAY_FIRST, Order.MONTH_FIRST] + ([Order.YEAR_FIRST] if short else [])
    costs = {order: cost for order in readings if (cost := _cost([day_of(date, order) for date in dates])) is not None}
    usual = Order.MONTH_FIRST if found[0][2] == "/" else Order.DAY_FIRST
    if not costs:
        return AS_WRITTEN
    least = min(costs.values())
    best = [order for order in costs if costs[order] == least]
    order = usual if usual in best else best[0]
    if len(best) == 1 or all(first == second for first, second, _ in dates):
        return Times(order)
    return Times(order, said=(f"dates taken as {order.value}",))


def day_of(date: tuple[int, int, int], order: Order) -> int | None:
    """Days since 1970; None for no such day."""
    first, second, third = date
    day, month, year = {
        Order.DAY_FIRST: (first, second, third),
        Order.MONTH_FIRST: (second, first, third),
        Order.YEAR_FIRST: (third, second, first),
    }[order]
    try:
        return datetime(year if year > 99 else 2000 + year, month, day, tzinfo=UTC).toordinal() - 719_163
    except ValueError:
        return None


def _cost(days: Sequence[int | None]) -> tuple[int, int] | None:
    """How often the days go back, and over how many they go; None where one of them is none."""
    known = [day for day in days if day is not None]
    if len(known) < len(days):
        return None
    return sum(later < earlier for earlier, later in pairwise(known)), max(known) - min(known)


def number_ahead(text: str) -> Decimal | None:
    """The number ahead of a line."""
    match = BARE.match(text[:80])
    return Decimal(match["number"].replace(",", ".")) if match is not None else None


def counted(numbers: Sequence[Decimal], lengths: Sequence[int], times: Times) -> Times:
    """The times of a log whose lines have these numbers ahead, of `lengths` octets each; `times` when they are none."""
    if len(numbers) < LEAST or len(set(numbers)) < LEAST or (is_count(numbers) and numbers[0] < EPOCH[0]):
        return times
    steps = [later - earlier for earlier, later in pairwise(numbers)]
    if sum(step >= 0 for step in steps) < _RISING * len(steps) or sum(step > 0 for step in steps) < len(steps) / 3:
        return times
    if max(abs(number) for number in numbers) < 1000 and all(number == int(number) for number in numbers):
        return times  # octets, lengths, addresses
    unit, since_1970, is_sure = unit_of(numbers, lengths)
    said = times.said if is_sure else (*times.said, f"times taken as {UNIT_NAMES[unit]}")
    return replace(times, unit=unit, since_1970=since_1970, said=said)


UNIT_NAMES = {NS_PER_S: "s", MS: "ms", _US: "µs", _NS: "ns"}


def is_count(numbers: Sequence[Decimal]) -> bool:
    """Whether they number lines: one more each time."""
    steps = [later - earlier for earlier, later in pairwise(numbers)]
    return sum(step == 1 for step in steps) >= _RISING * len(steps)


def unit_of(numbers: Sequence[Decimal], lengths: Sequence[int]) -> tuple[int, bool, bool]:
    """ns that one stands for, whether the numbers count from 1970, and whether nothing else can be meant."""
    steps = sorted(abs(later - earlier) for earlier, later in pairwise(numbers))
    middle = steps[len(steps) // 2] if steps else Decimal(0)
    for unit in (NS_PER_S, MS, _US, _NS):
        low, high = (bound * NS_PER_S // unit for bound in EPOCH)
        if all(low <= number <= high for number in numbers) and middle * unit < 86_400 * NS_PER_S:
            return unit, True, True
    needed = FASTEST * sum(lengths[1:])
    span = numbers[-1] - numbers[0] if numbers else Decimal(0)
    has_parts = any(number != int(number) for number in numbers)
    units: tuple[int, ...] = (NS_PER_S, MS, _US) if has_parts else (MS, _US, _NS)
    if not has_parts and len(steps) >= 2 * LEAST and steps[len(steps) // 4] * MS > SLOWEST_ANSWER:
        units = (_US, _NS)
    slowest = SLOWEST if sum(lengths) > 2 * len(lengths) else SLOWEST_OCTET
    if not has_parts and span * MS < needed:
        return NS_PER_S, False, False
    unit = next((one for one in units if middle * one <= slowest), units[-1])
    return unit, False, has_parts and unit == NS_PER_S
