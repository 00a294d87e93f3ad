"""Widths, and what gives way on a narrow screen."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
from rich.cells import cell_len

from sniff.tui.columns import Cell, Column, fit, lay_out, pieces
from sniff.tui.frame_list import COLUMNS as FRAMES
from sniff.tui.transaction_list import COLUMNS as TRANSACTIONS


@given(st.text(st.characters(exclude_categories=("C", "M"))), st.integers(1, 40), st.booleans())
def test_fit_is_exact(text: str, width: int, right: bool) -> None:
    assert cell_len(fit(text, width, right)) == width


def test_what_is_cut_says_so() -> None:
    assert fit("answered", 5) == "answ…"
    assert fit("answered", 8) == "answered"
    assert fit("12", 4, right=True) == "  12"


def test_no_number_is_cut_in_the_middle() -> None:
    assert fit("DC voltage 324.7 V", 15) == "DC voltage…    "
    assert fit("DC voltage 324.7 V", 16) == "DC voltage…     "
    assert fit("DC voltage 324.7 V", 17) == "DC voltage 324.7…"
    assert fit("inputs (holding/49505 ×4)", 18) == "inputs (…         "
    assert fit("A → 1010044DAC0001020043E60000", 20) == "A → 1010044DAC00010…"
    assert fit("1234567", 4) == "123…"


@given(st.integers(70, 300), st.sampled_from([FRAMES, TRANSACTIONS]))
def test_a_line_fills_its_width(width: int, columns: tuple[Column, ...]) -> None:
    shown = lay_out(columns, width)
    line = pieces(shown, {column.name: Cell("x" * 50) for column in shown})
    assert sum(cell_len(cell.text) for cell in line) == width


def test_narrow_screens_keep_what_matters() -> None:
    narrow = [column.name for column in lay_out(FRAMES, 77)]
    wide = [column.name for column in lay_out(FRAMES, 150)]
    assert narrow == ["no", "time", "text", "verdict", "latency", "flags"]
    assert wide == [column.name for column in FRAMES]
    text = next(column for column in lay_out(FRAMES, 77) if column.name == "text")
    assert text.width >= 20


def test_a_long_text_goes_on_over_empty_cells() -> None:
    columns = [Column("text", "what", 6, spills=True), Column("verdict", "verdict", 4), Column("len", "len", 2)]
    long = {"text": Cell("0123456789ab"), "verdict": Cell(""), "len": Cell("8")}
    assert "".join(cell.text for cell in pieces(columns, long)) == "0123456789… 8 "
    held = {**long, "verdict": Cell("late")}
    assert "".join(cell.text for cell in pieces(columns, held)) == "01234… late 8 "
