"""How likely so much is by chance, and what is too rare to be worth a warning: the borders of both measures."""

from __future__ import annotations

import pytest

from dissectors.chances import MINUTE, at_least, is_by_chance, is_rare, is_silent_by_chance

LONG = 1_000_000


@pytest.mark.parametrize(
    ("count", "of", "span", "is_so"),
    [
        (1, 1, 1, True),  # one is nothing, whatever it is one of
        (2, 200, MINUTE, False),  # one in a hundred
        (2, 201, MINUTE, True),
        (3, 918, 53 * MINUTE // 60, True),  # three in the only minute do not say two a minute
        (4, LONG, MINUTE, True),
        (5, LONG, MINUTE, False),
        (4, LONG, 1, True),  # less than a minute is one
        (5, LONG, 0, False),
        (8, LONG, 2 * MINUTE, True),
        (9, LONG, 2 * MINUTE, False),
        (9, LONG, 2 * MINUTE + 1, True),
        (28, LONG, 10 * MINUTE, True),
        (29, LONG, 10 * MINUTE, False),
    ],
)
def test_what_is_rare(count: int, of: int, span: int, is_so: bool) -> None:
    assert is_rare(count, of, span) is is_so


def test_the_chance_of_so_many() -> None:
    assert at_least(0, 10, 0.3) == at_least(0, 10, 0.5) == at_least(5, 5, 1.0) == 1
    assert at_least(10, 10, 0.5) == pytest.approx(2**-10)
    assert at_least(3, 3, 0.5) == pytest.approx(0.125)
    assert at_least(1, 2, 0.5) == pytest.approx(0.75)
    assert at_least(300, 500, 0.5) < 1e-5
    assert at_least(500, 1000, 0.5) == pytest.approx(0.51, abs=0.02)


@pytest.mark.parametrize("share", [0.01, 0.1, 0.5, 0.9])
def test_the_tail_goes_on_where_it_is_no_longer_summed(share: float) -> None:
    for count in (0, 1, 40, 41, 200, 400):
        assert at_least(count, 401, share) == pytest.approx(at_least(count, 400, share), abs=0.1)
        assert at_least(count + 1, 400, share) <= at_least(count, 400, share)
    assert at_least(1, 1000, 0.0) == at_least(1, 10, 0.0) == 0
    assert at_least(1, 10, 1.0) == 1


def test_more_than_there_are_do_not_come() -> None:
    assert at_least(1, -2, 0.2) == at_least(3, 2, 0.5) == at_least(500, 450, 0.5) == 0.0


@pytest.mark.parametrize(
    ("count", "of", "share", "chance"),
    [(4, 400, 0.00125, 1.75e-3), (4, 1000, 0.0005, 1.75e-3), (9, 1000, 0.002, 2.32e-4), (40, 10**7, 1e-6, 1.2e-12)],
)
def test_few_of_very_many_are_no_more_surprising(count: int, of: int, share: float, chance: float) -> None:
    assert at_least(count, of, share) == pytest.approx(chance, rel=0.1)


def test_of_many_senders_one_is_always_struck_most() -> None:
    assert not is_by_chance(4, 5, 0.1, 10)
    assert is_by_chance(3, 5, 0.1, 10)
    assert is_by_chance(2, 2, 0.1, 10)
    assert not is_by_chance(3, 3, 0.1, 10)  # nobody else is struck at all
    assert is_by_chance(3, 3, 0.1, 100)


def test_who_is_asked_seldom_where_most_fails_may_be_there() -> None:
    assert is_silent_by_chance(7, 53, 90, 16)
    assert not is_silent_by_chance(20, 53, 90, 16)
    assert not is_silent_by_chance(2, 0, 90, 16)
    assert not is_silent_by_chance(2, 0, 0, 1)  # nobody else is heard
    assert not is_silent_by_chance(7, 5, 90, 16)
