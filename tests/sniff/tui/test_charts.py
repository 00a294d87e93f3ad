"""Charts of characters."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
from rich.text import Text

from sniff.tui.charts import BARS, bar, sparkline
from sniff.tui.hanging import hanging

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


def test_long_lines_go_on_under_their_text() -> None:
    text = Text("health  0 of 100: nobody answers\nframes  read 72\n\nends    " + "x" * 30)
    text.stylize("bold", 8, 9)
    made = hanging(text, 20, 8)
    begun = ["health  0 of 100:", "        nobody", "        answers", "frames  read 72", "", "ends    " + "x" * 30]
    assert made.plain.split("\n") == begun
    assert [(span.start, span.end) for span in made.spans if span.style == "bold"] == [(8, 9)]
