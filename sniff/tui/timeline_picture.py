"""The picture on the Timeline: charts above each other over the same columns of time, as tall as there is room for.
Pure."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import accumulate, groupby

from rich.text import Text

from dissectors.line import NS_PER_S
from sniff.tui.charts import BARS, tall_bars
from sniff.tui.times import clock, date_and_clock

LABEL = 15
"""Cells left of the charts, their axis among them."""
WIDEST = 16
"""Cells of a column at most, where little time has to fill the screen."""
ZOOMS = (1, 2, 5, 10, 30, 60, 300, 600, 1800, 3600)
"""Seconds that one column may stand for."""
TICKS = (1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 21_600, 43_200, 86_400)
"""Seconds that may lie between two times of the axis."""
APART = 14
"""Cells between two of them at least."""
TALLEST = 12
"""Lines of a chart; what is left over stays empty."""
TELLING = ("load", "errors", "p95", "frames", "p50", "damaged", "noise")
"""Charts, what must not be missing first."""
UNHEARD = "░"


@dataclass(frozen=True, slots=True)
class Chart:
    """A quantity over time. `top`: value at full height; `label`: how it is written. `weight`: how much of the height
    it takes beside others, 0: a single line. `style`: of its bars. `of`: what is counted, where there is a line for
    it."""

    name: str
    values: Sequence[float | None]
    top: float
    label: str
    weight: int = 1
    style: str = ""
    of: str = ""


@dataclass(frozen=True, slots=True)
class Row:
    """A station: a line of "·" where it was asked and bars where exchanges went wrong, and how many did in all.
    `noun`: what its kind is called."""

    noun: str
    address: int
    wrong: int
    asked: Sequence[int]
    failed: Sequence[int]


Paint = Callable[[int, str], str]
"""The style of a column of that style, with the cursor and what is selected."""


def fitting(seconds: int, width: int) -> int:
    """Place in `ZOOMS` of the least at which so many seconds fit into `width` columns; the last where none does."""
    return next((at for at, zoom in enumerate(ZOOMS) if seconds <= zoom * width), len(ZOOMS) - 1)


def seconds_in_words(seconds: int) -> str:
    """ "5 s", "10 min", "1 h"."""
    return f"{seconds} s" if seconds < 60 else f"{seconds // 60} min" if seconds < 3600 else f"{seconds // 3600} h"


def widths(count: int, room: int) -> list[int]:
    """Cells of each of `count` columns, so that together they take all the room, unless they are few."""
    whole = min(room, count * WIDEST)
    return [(at + 1) * whole // count - at * whole // count for at in range(count)]


def heights(charts: Sequence[Chart], room: int) -> list[int]:
    """Lines for each chart out of `room`: one at least, the rest by weight."""
    made = [1] * len(charts)
    left = room - len(charts)
    whole = sum(chart.weight for chart in charts)
    if left <= 0 or not whole:
        return made
    for at, chart in enumerate(charts):
        made[at] += min(TALLEST - 1, left * chart.weight // whole) if chart.weight else 0
    rest = room - sum(made)
    for at, chart in enumerate(charts):
        if rest > 0 and chart.weight and made[at] < TALLEST:
            made[at] += 1
            rest -= 1
    return made


def most_telling(charts: Sequence[Chart], room: int) -> list[Chart]:
    """Those that have a line each in `room`, one at least."""
    kept = sorted(charts, key=lambda chart: TELLING.index(chart.name))[: max(1, room)]
    return [chart for chart in charts if chart in kept]


def draw_charts(
    text: Text, charts: Sequence[Chart], room: int, paint: Paint, cells: Sequence[int], unheard: Sequence[bool]
) -> None:
    """Add the charts: name and full height at the upper end of the axis, 0 at the lower one. `cells`: of each
    column; `unheard`: where nobody listened."""
    for chart, height in zip(charts, heights(charts, room), strict=True):
        for line, bars in enumerate(tall_bars(chart.values, chart.top, height)):
            if height == 1:
                label = f"{chart.name} {chart.label}"
                corner = "│"
            else:
                said = {1: chart.of, 0: f"{chart.name:<8}{chart.label:>6}", height - 1: f"{'0':>14}"}
                label, corner = said.get(line, ""), "┤" if line in (0, height - 1) else "│"
            text.append(f"{label:<14}"[:14], style="bold" if line == 0 else "")
            text.append(corner, style="dim")
            shown = "".join(
                UNHEARD if missed and bar == " " else bar for bar, missed in zip(bars, unheard, strict=True)
            )
            styles = ["dim" if missed else chart.style for missed in unheard]
            _append(text, shown, [paint(place, style) for place, style in enumerate(styles)], cells)


def _append(text: Text, bars: str, styles: Sequence[str], cells: Sequence[int]) -> None:
    """Add a line of columns, those of one style together: each piece costs as much as a hundred cells."""
    begin = 0
    for style, same in groupby(styles):
        end = begin + sum(1 for _ in same)
        text.append("".join(bars[at] * cells[at] for at in range(begin, end)), style=style)
        begin = end
    text.append("\n")


def draw_rows(text: Text, rows: Sequence[Row], paint: Paint, cells: Sequence[int]) -> None:
    """Add a line for each station; the highest bar is the most that went wrong in a column of any of them."""
    most = max((max(row.failed, default=0) for row in rows), default=0)
    for row in rows:
        text.append(_label(row)).append("│", style="dim")
        bars = "".join(
            BARS[max(1, round(failed / most * 8))] if failed else "·" if asked else " "
            for asked, failed in zip(row.asked, row.failed, strict=True)
        )
        _append(text, bars, [paint(at, "bold red" if failed else "dim") for at, failed in enumerate(row.failed)], cells)


def _label(row: Row) -> str:
    """A station and how much went wrong with it; its number alone where both have no room."""
    names = (f"{row.noun} {row.address}", str(row.address))
    room = LABEL - 1 - len(str(row.wrong))
    name = next((one for one in names if len(one) < room), names[-1])
    return f"{name:<{room}}{row.wrong}"


def axis(begin: int, zoom: int, cursor: int, cells: Sequence[int]) -> tuple[str, str]:
    """The line below the charts, with ticks and the cursor's place, and the times below that line: dates where there
    is a day between them."""
    count, width = len(cells), sum(cells)
    others = -(-APART * count // width) * zoom  # where none of the round ones will do
    step = next((one for one in TICKS if one * width >= APART * zoom * count and one % zoom == 0), others)
    edges = list(accumulate(cells, initial=0))
    line, times = ["─"] * width, [" "] * (width + APART)
    for place, at in enumerate(edges[:-1]):
        second = begin + place * zoom
        if second // step != (second - zoom) // step or place == 0:
            line[at] = "┴"
            time = second * NS_PER_S
            said = clock(time)[:8] if step < TICKS[-1] else date_and_clock(time)[:10]
            if at + len(said) <= width + 4 and not "".join(times[max(0, at - 2) : at + len(said) + 1]).strip():
                times[at : at + len(said)] = said
    if 0 <= cursor < count:
        line[edges[cursor] + cells[cursor] // 2] = "▲"
    return " " * (LABEL - 1) + "└" + "".join(line), " " * LABEL + "".join(times).rstrip()
