"""Charts of characters."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from sniff.tui.charts import BARS, bar, sparkline

SHARES = st.floats(0, 1)


@given(st.lists(SHARES), SHARES)
def test_sparkline_has_one_bar_a_value(values: list[float], top: float) -> None:
    text = sparkline(values, top)
    assert len(text) == len(values)
    if top > 0:
        for value, character in zip(values, text, strict=True):
            assert (character == " ") == (value <= 0)
            assert character in BARS


def test_sparkline_heights() -> None:
    assert sparkline([0, 0.01, 0.5, 1, 2], 1) == " ▁▄██"


@given(SHARES, st.integers(1, 60))
def test_bar_is_as_wide_as_asked(share: float, width: int) -> None:
    text = bar(share, width)
    assert len(text) == width
    assert (text.strip() == "") == (share == 0)


def test_bar_lengths() -> None:
    assert bar(1, 4) == "████"
    assert bar(0.5, 4) == "██  "
    assert bar(0.000001, 4) == "▏   "
