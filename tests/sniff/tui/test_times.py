"""Times and sizes as text."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sniff.tui.times import TimeMode, between, clock, date_and_clock, seconds, size

T = 1_772_359_200_000_000_000  # 2026-03-01T10:00:00Z


def test_clock() -> None:
    assert clock(T + 123_999_999) == "10:00:00.123"
    assert date_and_clock(T + 123_456_789) == "2026-03-01 10:00:00.123456 +0000"


@given(st.integers())
def test_any_time_has_a_text(time: int) -> None:
    assert len(clock(time)) == 12


@pytest.mark.parametrize(
    ("span", "text"),
    [(0, "+0.000000"), (8_200_000, "+0.008200"), (-1_500_000_000, "-1.500000"), (3_600_000_000_999, "+3600.000000")],
)
def test_seconds(span: int, text: str) -> None:
    assert seconds(span) == text


@pytest.mark.parametrize(
    ("octets", "text"),
    [(0, "0 B"), (999, "999 B"), (1000, "1.0 kB"), (99_960, "100 kB"), (12_345_678, "12.3 MB"), (10**15, "1000 TB")],
)
def test_size(octets: int, text: str) -> None:
    assert size(octets) == text


@given(st.integers(0, 10**15))
def test_size_fits_the_header(octets: int) -> None:
    assert len(size(octets)) <= 8


def test_moments_of_several_days_have_their_day() -> None:
    begin = 1_772_359_200_123_000_000
    assert between(begin, begin) == "10:00:00.123"
    assert between(begin, begin + 3600 * 10**9) == "10:00:00.123 … 11:00:00.123"
    assert between(begin, begin + 20 * 3600 * 10**9) == "03-01 10:00:00.123 … 03-02 06:00:00.123"


def test_modes_go_round() -> None:
    assert TimeMode.ABSOLUTE.next().next().next() is TimeMode.ABSOLUTE
    assert len({TimeMode.ABSOLUTE, TimeMode.ABSOLUTE.next(), TimeMode.ABSOLUTE.next().next()}) == 3
