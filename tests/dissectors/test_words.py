"""Numbers, durations and shares as people read them."""

from __future__ import annotations

import pytest

from dissectors.line import MS, NS_PER_S
from dissectors.modbus.finding_words import share_words
from dissectors.register_maps import Mapped, RegisterMap, document
from dissectors.words import brief, elapsed, exact_duration, percent


@pytest.mark.parametrize(
    ("value", "most", "said"),
    [
        (4_294_967_295, 5, "4294967295"), (12_345_678.0, 5, "12345678"), (123_456.789, 5, "123457"), (150.4, 2, "150"),
        (99_999.7, 5, "100000"), (1234.5, 3, "1234"), (0.12345, 3, "0.123"), (-65_536.0, 3, "-65536"), (0, 3, "0"),
        (1e300, 3, f"{1e300:.0f}"), (float("inf"), 3, "inf"), (float("nan"), 3, "nan"),
    ],
)  # fmt: skip
def test_no_number_is_a_power_of_ten(value: float, most: int, said: str) -> None:
    assert brief(value, most) == said


@pytest.mark.parametrize(
    ("share", "places", "said"),
    [
        (1, 0, "100%"), (0.9996, 0, "over 99%"), (0.9999, 1, "over 99.9%"), (0.5, 0, "50%"), (0, 2, "0.00%"),
        (1e-7, 2, "under 0.01%"), (0.004, 0, "under 1%"), (0.006, 0, "1%"),
    ],
)  # fmt: skip
def test_some_is_not_none_and_not_all(share: float, places: int, said: str) -> None:
    assert percent(share, places) == said


@pytest.mark.parametrize(
    ("seconds", "said"),
    [
        (0, "0.0 s"), (299.9, "299.9 s"), (300, "5 min"), (33_000.1, "9 h 10 min"), (3_600, "1 h"),
        (3_725, "1 h 2 min 5 s"), (7_199.7, "2 h"), (100_000, "27 h 46 min 40 s"),
    ],
)  # fmt: skip
def test_a_moment_of_a_night_is_no_number_of_seconds(seconds: float, said: str) -> None:
    assert elapsed(round(seconds * NS_PER_S)) == said


def test_a_duration_in_words_is_exact() -> None:
    assert exact_duration(86_400_123_456_789, MS) == "86400123.456789"
    assert exact_duration(-1_500_000_000, NS_PER_S) == "-1.5"
    assert exact_duration(1500.5, MS) == "0.0015005"
    assert exact_duration(0, MS) == "0"
    assert exact_duration(20 * MS, MS) == "20"


def test_some_is_not_none_and_nearly_all_is_not_all() -> None:
    assert [percent(share) for share in (0, 0.0004, 0.0006, 0.5, 0.9996, 1)] == [
        *("0.0%", "under 0.1%", "0.1%", "50.0%", "over 99.9%", "100.0%"),
    ]
    assert [percent(share, 0) for share in (0, 0.004, 0.05, 0.996)] == ["0%", "under 1%", "5%", "over 99%"]


def test_the_bounds_of_a_share_differ() -> None:
    assert share_words(3, 543) == "0.2% to 1.6%"
    assert share_words(3, 100_000) == "0.0010% to 0.0088%"
    assert share_words(10_000, 10_000) == "99.962% to 100.000%"
    assert (share_words(0, 20), share_words(20, 20)) == ("0.0% to 16.1%", "83.9% to 100.0%")


def test_many_entries_of_one_name_are_told_apart() -> None:
    said = RegisterMap([Mapped("holding", at, title) for at, title in enumerate(("a", "a-2", "a", "a", "A-2"))])
    text, count = document("x", "x", said, "modbus", ("modbus-rtu",))
    names = [line for line in text.splitlines() if line.startswith("name = ")]
    assert count == 5
    assert names == [f'name = "{name}"' for name in ("x", "a", "a-2", "a-3", "a-4", "a-2-2")]
