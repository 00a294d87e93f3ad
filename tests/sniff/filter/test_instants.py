"""Times of filters: what is equal, before and behind, and in whose clocks."""

from __future__ import annotations

import numpy as np
import pytest

from sniff.filter.comparing import During, When
from sniff.filter.literals import Instant, instant
from sniff.filter.syntax import Quoted

S = 1_000_000_000
HOUR = 3600 * S
WRITTEN = ("1970-01-02", "1970-01-02 03:00", "1970-01-02T03:00:00.5+01:00", "03:00", "23:59", "00:00:00.25")
TIMES = [
    day * 24 * HOUR + time for day in range(3) for time in (0, S // 4, 2 * HOUR + S // 2, 3 * HOUR, 3 * HOUR + 59 * S)
]
TIMES += [time - 1 for time in TIMES] + [24 * HOUR - 1, 24 * HOUR - 60 * S]


def at(text: str, east: int | None = None) -> Instant:
    found = instant(Quoted(text, 0), "frame.time")
    return found if east is None else found.local(lambda time: east, 0)


@pytest.mark.parametrize("east", [None, 0, 2 * HOUR, -5 * HOUR])
@pytest.mark.parametrize("text", WRITTEN)
def test_a_time_is_before_at_or_behind_another(text: str, east: int | None) -> None:
    tests = {operator: When(operator, at(text, east)) for operator in ("<", "<=", "==", "!=", ">=", ">")}
    for time in TIMES:
        said = {operator: test(time) for operator, test in tests.items()}
        assert said["<"] + said["=="] + said[">"] == 1
        assert said["<="] is (said["<"] or said["=="])
        assert said[">="] is (said[">"] or said["=="])
        assert said["!="] is not said["=="]
    for test in tests.values():
        assert test.many(np.array(TIMES)).tolist() == [test(time) for time in TIMES]
        for one in TIMES:
            for other in TIMES:
                alike = test.of_all(min(one, other), max(one, other))
                assert alike is None or all(
                    test(time) is alike for time in TIMES if min(one, other) <= time <= max(one, other)
                )


def test_a_range_holds_its_last_time_whole() -> None:
    days = During(at("1970-01-01"), at("1970-01-02"))
    assert [days(time) for time in (0, 24 * HOUR, 48 * HOUR - 1, 48 * HOUR)] == [True, True, True, False]
    assert days.of_all(24 * HOUR, 48 * HOUR - 1) is True
    assert days.of_all(24 * HOUR, 48 * HOUR) is None
    night = During(at("23:59"), at("00:01"))
    assert [night(time) for time in (0, 119 * S, 120 * S, 24 * HOUR - 60 * S)] == [True, True, False, True]


@pytest.mark.parametrize(
    ("text", "utc"),
    [
        ("1970-01-02 03:00", 25 * HOUR),
        ("1970-01-02 03:00Z", 27 * HOUR),
        ("1970-01-02", 22 * HOUR),
        ("03:00", 25 * HOUR),
        ("01:00", 23 * HOUR),
        ("01:00", 47 * HOUR),
    ],
)
def test_clocks_of_people(text: str, utc: int) -> None:
    assert When("==", at(text, 2 * HOUR))(utc)
    assert not When("==", at(text, 2 * HOUR))(utc - 1)
