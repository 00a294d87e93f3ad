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


def test_a_night_says_what_its_worst_quarter_says_alone() -> None:
    """However much else was right: 60 of a million frames, 40 tokens of a ring a second."""
    lost = tally([33_300 * S + 15 * S * number for number in range(60)])
    for of in (750, 36_000, 180_000):
        assert not is_rare(lost.count, of, busiest.QUARTER)
        assert not is_rare(lost.count, of * 52, NIGHT, lost.quarters)


@pytest.mark.parametrize("seed", range(5))
def test_what_falls_anywhere_is_no_fault_of_a_quarter(seed: int) -> None:
    """Nearly two a minute, which is tolerable; and more, of which no quarter is told alone."""
    dice = Random(seed)
    steady = tally([dice.randrange(NIGHT) for _ in range(1450)])
    assert is_rare(steady.count, 1000 * ASKED, NIGHT, steady.quarters)
    many = tally([dice.randrange(NIGHT) for _ in range(20_000)])
    assert busiest.words(many.quarters, many.count, 1000 * ASKED, NIGHT) == ""


def test_what_was_none_is_taken_from_the_newest_quarter() -> None:
    noted = tally([0, 1000 * S, 1001 * S])
    busiest.take_back(noted.quarters)
    assert noted.quarters == tally([0, 1000 * S]).quarters


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
