"""The axes of charts and plots: all of the width, round numbers, no number that is cut or says more than is known."""

from __future__ import annotations

import asyncio
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.text import Text
from textual.app import App, ComposeResult

from sniff.tui.plot import HAS_PLOT, HistoryPlot, ticks
from sniff.tui.tables import StationTable, count_cell
from sniff.tui.timeline_picture import (
    LABEL,
    TELLING,
    UNHEARD,
    WIDEST,
    Chart,
    Row,
    axis,
    draw_charts,
    draw_rows,
    fitting,
    most_telling,
    widths,
)
from sniff.tui.times import interval, jitter, latency

MS = 1_000_000


@given(st.integers(1, 200), st.integers(1, 400))
def test_columns_take_all_of_the_width(count: int, room: int) -> None:
    cells = widths(count, room)
    assert len(cells) == count
    assert sum(cells) == min(room, count * WIDEST)
    assert max(cells) - min(cells) <= 1


def test_the_axis_is_as_wide_as_its_columns() -> None:
    cells = widths(150, 184)
    line, _ = axis(0, 2, 149, cells)
    assert len(line) == LABEL + 184
    assert line.endswith(("▲", "▲─"))


def test_charts_leave_the_axis_its_lines_and_show_what_nobody_heard() -> None:
    charts = [Chart(name, [1.0, None, 0.0], 1.0, "1") for name in reversed(TELLING)]
    for room in range(9):
        shown, text = most_telling(charts, room), Text()
        draw_charts(text, shown, room, lambda _, style: style, [1, 1, 1], [False, True, False])
        assert text.plain.count("\n") == max(1, room)
        assert {chart.name for chart in shown} == set(TELLING[: max(1, room)])
        assert {line[LABEL:] for line in text.plain.splitlines()} == {f"█{UNHEARD} "}


def test_days_are_told_apart() -> None:
    line, times = axis(0, 3600, -1, [1] * 150)
    assert line.count("┴") == 7
    assert times.split() == [f"1970-01-0{day}" for day in range(1, 8)]


def test_columns_of_many_days_have_few_ticks() -> None:
    line, times = axis(0, 9 * 86_400, -1, [1] * 60)
    assert 3 < line.count("┴") < 7
    assert times.split()[0] == "1970-01-01"


@pytest.mark.parametrize(
    ("noun", "at", "wrong", "shown"), [("station", 4, 72, "station 4   72"), ("station", 247, 123, "247        123")]
)
def test_no_number_of_a_station_is_cut(noun: str, at: int, wrong: int, shown: str) -> None:
    text = Text()
    draw_rows(text, [Row(noun, at, wrong, [1], [1])], lambda place, style: style, [1])
    assert text.plain.partition("│")[0] == shown


@given(st.floats(-1e6, 1e6), st.floats(1e-3, 1e6), st.integers(0, 12))
def test_ticks_are_few_and_evenly_apart(low: float, span: float, most: int) -> None:
    made = ticks(low, low + span, most)
    assert made
    if len(made) > 2:
        steps = [later - earlier for earlier, later in pairwise(made)]
        assert max(steps) - min(steps) <= max(steps) * 1e-6 + 1e-9
        assert len(made) <= 3 * max(2, most)


def test_ticks_of_a_load() -> None:
    assert ticks(0, 52.3, 4) == [0, 20, 40]
    assert ticks(0, 48, 2) == [0, 20, 40]
    assert ticks(0, 2.6, 4) == [0, 1, 2]


def test_what_is_too_small_to_tell_is_not_said_to_be_nothing() -> None:
    assert (interval(None), interval(1_001 * MS), interval(9_900_000)) == ("–", "1001", "9.9")
    assert jitter(0, 10_000 * MS) == "<120"
    assert jitter(0, 5 * MS) == "<0.1"
    assert jitter(189 * MS, 1_001 * MS) == "189"
    assert jitter(None, None) == "–"
    assert (latency(30), latency(60_000), latency(9_900_000)) == ("<0.01", "0.06", "9.9")


def test_a_count_of_nothing_stands_back() -> None:
    assert count_cell("0", is_trouble=True).style == "dim"
    assert count_cell("3", is_trouble=True).plain == "!3"
    assert count_cell("3").plain == "3"


def test_the_finest_zoom_that_holds_all() -> None:
    assert fitting(300, 184) == 1
    assert fitting(10**9, 184) == 9


@pytest.mark.skipif(not HAS_PLOT, reason="the extra `plot` is not installed")
def test_a_plot_that_grows_gets_more_numbers_at_its_axis() -> None:
    class Alone(App[None]):
        def compose(self) -> ComposeResult:
            yield HistoryPlot()

    async def script() -> list[int]:
        app, found = Alone(), []
        async with app.run_test(size=(100, 40)) as pilot:
            plot = app.query_one(HistoryPlot)
            plot.show("load", [(second * 10**9, 20 + second) for second in range(60)], least=0)
            for height in (8, 30):
                plot.styles.height = height
                await pilot.pause()
                await pilot.pause()
                strips = app.screen._compositor.render_strips()
                lines = ["".join(segment.text for segment in strip) for strip in strips[:height]]
                found.append(sum(line.strip()[:1].isdigit() and "┫" in line for line in lines))
        return found

    few, many = asyncio.run(script())
    assert few < many


def test_a_table_wider_than_its_screen_says_so() -> None:
    class Narrow(App[None]):
        def compose(self) -> ComposeResult:
            yield StationTable()

    async def lines(cells: int, rows: int) -> set[str]:
        app = Narrow()
        async with app.run_test(size=(40, 10)) as pilot:
            table = app.query_one(StationTable)
            table.add_column("what", key="what")
            table.fill((str(at), [Text("y" * cells)]) for at in range(rows))
            await pilot.pause()
            shown = table.scrollable_content_region
            return {table.render_line(at).text[: shown.width].rstrip()[-1] for at in range(shown.height)}

    assert asyncio.run(lines(60, 30)) == {"…"}
    assert "…" not in asyncio.run(lines(20, 30))
