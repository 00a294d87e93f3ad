"""What is rare over a night may have been a fault for a quarter of an hour."""

from __future__ import annotations

from random import Random

import pytest

from dissectors import busiest
from dissectors.chances import is_rare
from dissectors.findings import Tally, together

S = 1_000_000_000
NIGHT = 13 * 3600 * S
ASKED = 39_000
"""Requests to a station in a night: 750 in a quarter of an hour."""


def tally(times: list[int]) -> Tally:
    made = Tally()
    for time in times:
        made.add(time)
    return made


def test_a_fault_of_a_quarter_of_an_hour_is_not_rare() -> None:
    """300 of 750 answers from 9:10 to 9:25, and no other."""
    lost = tally([33_000 * S + 3 * S * number for number in range(300)])
    assert is_rare(lost.count, ASKED, NIGHT)
    assert not is_rare(lost.count, ASKED, NIGHT, lost.quarters)
    assert (
        busiest.words(lost.quarters, lost.count, ASKED, NIGHT) == "; at least 200 of them within a quarter of an hour"
    )


@pytest.mark.parametrize("seed", range(5))
def test_what_falls_anywhere_stays_rare(seed: int) -> None:
    dice = Random(seed)
    lost = tally([dice.randrange(NIGHT) for _ in range(300)])
    assert is_rare(lost.count, ASKED, NIGHT, lost.quarters)
    assert busiest.words(lost.quarters, lost.count, ASKED, NIGHT) == ""


def test_a_burst_of_two_seconds_is_no_fault_of_a_quarter() -> None:
    burst = tally([33_000 * S + S // 10 * number for number in range(20)])
    assert is_rare(burst.count, ASKED, NIGHT, burst.quarters)


def test_what_strikes_several_at_once_adds_up() -> None:
    parts = [tally([33_300 * S + number * S for number in range(9)]) for _ in range(8)]
    assert busiest.is_fault(together(parts).quarters, ASKED, NIGHT)
    assert not busiest.is_fault(parts[0].quarters, ASKED, NIGHT)


def test_many_at_once_are_counted_as_one_by_one() -> None:
    times = [33_000 * S + number * 100 * S for number in range(50)]
    many = Tally()
    many.add_many(times, range(50))
    assert many.quarters == tally(times).quarters
