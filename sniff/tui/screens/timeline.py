"""Screen 6: load and errors over time; zoom, go along, and take a stretch of it as a filter."""

from __future__ import annotations

from typing import ClassVar, NamedTuple

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import Static

from dissectors.findings import counted
from dissectors.line import NS_PER_S
from dissectors.words import brief, duration
from sniff.analysis.load import Second
from sniff.bus.rows import Store
from sniff.tui.analyzer import analyzer
from sniff.tui.charts import round_up
from sniff.tui.exchanges import Exchanges
from sniff.tui.screens.base import ViewScreen
from sniff.tui.themes import BENEATH, CHOSEN
from sniff.tui.timeline_picture import (
    LABEL,
    ZOOMS,
    Chart,
    Row,
    axis,
    draw_charts,
    draw_rows,
    fitting,
    most_telling,
    seconds_in_words,
    widths,
)
from sniff.tui.times import UNTIMED, clock

LOADS = (0.02, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.75, 1.0)
"""Where the axis of the load may end."""
OTHER_LINES = 7
"""Header, keys, axis, times and what is said of the cursor."""
LEAST_STATIONS = 3
LEAST_TOLD = 0.01
"""ms; no adapter tells shorter times apart."""
LEAST_AXIS = 0.1
"""ms; where the axis of times ends at least: a shorter one would make mountains of what nobody can measure."""


class Column(NamedTuple):
    """Some seconds of the bus drawn as one character. `begin`: s since the epoch; `load`: of its time, None where
    nobody heard it; `share`: of what the capture covers of that, `heard` (ns), which is less where it begins and ends.
    """

    begin: int
    load: float | None
    share: float
    heard: int
    frames: int
    damaged: int
    noise: int
    failed: int


def columns(store: Store, begin: int, width: int, zoom: int) -> list[Column]:
    """`width` columns of `zoom` seconds each from second `begin` on."""
    seconds = store.load.seconds
    made = []
    for at in range(begin, begin + width * zoom, zoom):
        parts = [seconds[number] for number in range(at, at + zoom) if number in seconds]
        together = Second(
            busy=sum(part.busy for part in parts),
            frames=sum(part.frames for part in parts),
            damaged=sum(part.damaged for part in parts),
            noise=sum(part.noise for part in parts),
        )
        failed = _failed(store, at, at + zoom) if parts else 0
        stretch = at * NS_PER_S, (at + zoom) * NS_PER_S
        load = store.load.drawn(together.busy, *stretch)
        share, heard = store.load.share_of(together, *stretch), store.load.heard_of(*stretch)
        made.append(Column(at, load, share, heard, together.frames, together.damaged, together.noise, failed))
    return made


def _failed(store: Store, begin: int, end: int) -> int:
    """Rows that are damaged, noise, or of a bad transaction in these seconds."""
    return sum(store.failed[second] for second in range(begin, end) if second in store.failed)


class TimelineScreen(ViewScreen):
    """Charts over the same seconds and a line a station, a cursor, and a selection."""

    TITLE = "Timeline"
    LEGEND = (
        ("load", "share of the time of a column in which the bus was busy"),
        ("frames errors", "in the time of a column; errors: rows damaged or noise, or whose exchange went wrong"),
        ("damaged noise", "frames and octets of noise in a column; the number is the most"),
        ("p95 p50", "time to the answers: 95 of 100 are shorter, half are shorter"),
        ("stations", "with how much went wrong in what is shown; dots: it was asked, bars: something went wrong"),
        ("░", "nobody heard the bus: the adapter was away, octets were lost, or nothing was kept"),
        ("▲", "the cursor; what it stands on is said below"),
    )
    CSS_PATH = "timeline.tcss"
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("left,h", "move(-1)", "earlier", tooltip="cursor to an earlier time"),
        Binding("right,l", "move(1)", "later", tooltip="cursor to a later time"),
        Binding("pageup", "move(-20)", "page earlier", show=False),
        Binding("pagedown", "move(20)", "page later", show=False),
        Binding("g,home", "end(-1)", "first", show=False),
        Binding("G,end", "end(1)", "last", show=False),
        Binding("plus,equals_sign", "zoom(-1)", "zoom in", key_display="+", tooltip="fewer seconds a column"),
        Binding("minus", "zoom(1)", "zoom out", key_display="-", tooltip="more seconds a column"),
        Binding("e", "error(1)", "error", tooltip="next column with errors"),
        Binding("E", "error(-1)", "error", tooltip="column with errors before", show=False),
        Binding("v", "select", "select", tooltip="begin a selection here; again: show its frames, as a filter"),
        Binding(
            "enter",
            "open",
            "frames",
            tooltip="show the frames of the selection, as a filter, or go to the first one at the cursor",
        ),
        Binding("escape", "clear", "clear", tooltip="remove selection and filter", show=False),
    ]

    def __init__(self) -> None:
        super().__init__()
        self._zoom: int | None = None  # place in ZOOMS; None until it has been chosen to show everything
        self._cursor: int | None = None  # s since the epoch; None follows the newest
        self._anchor: int | None = None  # where the selection began
        self._begin = 0
        self._cells: list[int] = []  # of each column
        self._drawn: tuple[object, ...] = ()
        self._exchanges = Exchanges()

    def compose_view(self) -> ComposeResult:
        """The charts."""
        yield _Chart(id="main", markup=False)

    def draw(self) -> None:
        """Bring the charts up to date, unless frozen."""
        width = max(10, self.size.width - LABEL - 2)  # and a cell at both sides
        state = (self.store.heard, width, self.size.height, self._zoom, self._cursor, self._anchor)
        frozen = self.viewing.frozen and self._drawn and self._drawn[1:] == state[1:]
        if state == self._drawn or frozen:
            return
        self._drawn = state
        chart = self.query_one("#main", Static)
        if not self.store.session.has_times:
            chart.update(f"when it was is {UNTIMED}")
            return
        first, last = self._span()
        if first is None or last is None:
            chart.update("nothing was heard yet" if analyzer(self).status.live else "no frames in this file")
            return
        if self._zoom is None:
            self._zoom = fitting(last - first + 1, width)
        zoom = ZOOMS[self._zoom]
        cursor = last if self._cursor is None else min(max(self._cursor, first), last)
        self._begin = self._scrolled(first, last, cursor, width, zoom)
        room, width = width, min(width, (last - self._begin) // zoom + 1)  # none after the end
        self._cells = widths(width, room)
        self._exchanges.bring_up(self.store, self.viewing.last_closed)
        chart.update(self._text(columns(self.store, self._begin, width, zoom), cursor, zoom))

    def _scrolled(self, first: int, last: int, cursor: int, width: int, zoom: int) -> int:
        """Second at which the charts begin, a whole number of columns after the first; the cursor is inside."""
        begin = first + max(0, (self._begin - first) // zoom) * zoom
        if cursor < begin:
            begin = first + (cursor - first) // zoom * zoom
        elif cursor >= begin + width * zoom:
            begin = first + ((cursor - first) // zoom - width + 1) * zoom
        return begin

    def _text(self, made: list[Column], cursor: int, zoom: int) -> Text:
        at = (cursor - self._begin) // zoom
        chosen = self._chosen(cursor, zoom)
        text = Text(no_wrap=True)

        def paint(place: int, style: str) -> str:
            begin = made[place].begin
            if place == at:
                return f"{style} on {BENEATH}"
            return f"{style} on {CHOSEN}" if chosen is not None and chosen[0] <= begin < chosen[1] else style

        rows = self._rows(len(made), zoom)
        room = self.size.height - OTHER_LINES
        charts = most_telling(self._charts(made, zoom), room)
        room -= 1 if rows else 0
        stations = rows[: max(LEAST_STATIONS, (room - 2 * len(charts)) // 3)] if room > 2 * len(charts) else []
        unheard = [column.load is None for column in made]
        draw_charts(text, charts, room - len(stations), paint, self._cells, unheard)
        if stations:
            hidden = len(rows) - len(stations)
            more = f"; and {hidden} more" if hidden else ""
            text.append(f"{'stations':<9}{'wrong':>5}", style="bold").append("│", style="dim")
            text.append(f" · asked, bars: went wrong{more}\n", style="dim")
            draw_rows(text, stations, paint, self._cells)
        for line in axis(self._begin, zoom, at, self._cells):
            text.append(line + "\n")
        text.append(self._words(made[at] if 0 <= at < len(made) else None, zoom, chosen))
        return text

    def _charts(self, made: list[Column], zoom: int) -> list[Chart]:
        peak = max((column.load or 0.0 for column in made), default=0.0)
        load = next((step for step in LOADS if peak <= step), 1.0)
        median, most = self._exchanges.latencies(self._begin, len(made), zoom, (0.5, 0.95))
        each = f"in {seconds_in_words(zoom)}"
        charts = [
            Chart("load", [column.load for column in made], load, f"{load:.0%}", 3, "blue", "of the time"),
            _counted("frames", [column.frames for column in made], 2, "magenta", each),
            _counted("errors", [column.failed for column in made], 2, "bold red", each),
            _counted("damaged", [column.damaged for column in made], 0, "red"),
            _counted("noise", [column.noise for column in made], 0, "yellow"),
        ]
        if any(value is not None for value in most):
            charts += [_timed("p95", most, 3), _timed("p50", median, 2)]
        return charts

    def _rows(self, width: int, zoom: int) -> list[Row]:
        """Stations, those where most went wrong first."""
        found = self._exchanges.stations(self._begin, width, zoom)
        noun = self.store.dissector.noun
        ordered = sorted(found.items(), key=lambda item: (-sum(item[1][1]), item[0]))
        return [Row(noun, at, sum(failed), asked, failed) for at, (asked, failed) in ordered]

    def _words(self, column: Column | None, zoom: int, chosen: tuple[int, int] | None) -> str:
        if column is None:
            return ""
        if column.load is None and not column.frames:
            ending = f" · one column {seconds_in_words(zoom)}"
            return f"{clock(column.begin * NS_PER_S)[:8]} + {seconds_in_words(zoom)}: nobody heard the bus{ending}"
        is_part = column.heard < 0.99 * zoom * NS_PER_S
        words = (
            f"{clock(column.begin * NS_PER_S)[:8]} + {seconds_in_words(zoom)}: load {column.share:.1%}"
            f"{f' of {duration(column.heard)} heard' if is_part else ''}, "
            f"{counted(column.frames, 'frame')}, {counted(column.failed, 'error')}, {column.damaged} damaged, "
            f"{counted(column.noise, 'octet')} of noise"
        )
        words += self._answers(column, zoom) + f" · one column {seconds_in_words(zoom)}"
        if self._anchor is not None and chosen is not None:
            span = f"{clock(chosen[0] * NS_PER_S)[:8]} … {clock(chosen[1] * NS_PER_S)[:8]}"
            words = f"selected: {span}; enter shows its frames, escape lets it go\n{words}"  # the end may have no line
        return words

    def _answers(self, column: Column, zoom: int) -> str:
        median, most = self._exchanges.latencies(column.begin, 1, zoom, (0.5, 0.95))
        if median[0] is None or most[0] is None:
            return ", nothing answered"
        return f", answers after {_answered(median[0])} (p50), {_answered(most[0])} (p95)"

    # -- time --------------------------------------------------------------------------------------------------

    def _span(self) -> tuple[int | None, int | None]:
        load = self.store.load
        if load.first is None or load.last is None or not self.store.session.has_times:
            return None, None
        return load.first // NS_PER_S, load.last // NS_PER_S

    def _chosen(self, cursor: int, zoom: int) -> tuple[int, int] | None:
        """The selected seconds, whole columns; None without a selection."""
        if self._anchor is None:
            return None
        low, high = sorted((self._anchor, cursor))
        low, high = (self._begin + (value - self._begin) // zoom * zoom for value in (low, high))
        return low, high + zoom

    # -- keys --------------------------------------------------------------------------------------------------

    def _place(self) -> int | None:
        first, last = self._span()
        if first is None or last is None:
            return None
        return last if self._cursor is None else min(max(self._cursor, first), last)

    def action_move(self, step: int) -> None:
        """Move the cursor by columns; at the newest one it follows."""
        here = self._place()
        if here is None or self._zoom is None:
            return
        first, last = self._span()
        moved = here + step * ZOOMS[self._zoom]
        self._cursor = None if moved >= (last or 0) else max(first or 0, moved)
        self.draw()

    def action_end(self, side: int) -> None:
        """To the first or the last column."""
        self._cursor = self._span()[0] if side < 0 else None
        self.draw()

    def action_zoom(self, step: int) -> None:
        """Fewer or more seconds a column."""
        if self._zoom is None:
            return
        if not 0 <= self._zoom + step < len(ZOOMS):
            self.app.notify("one second is the least" if step < 0 else "one hour is the most", timeout=2)
            return
        self._zoom += step
        self.draw()

    def action_error(self, step: int) -> None:
        """To the next column with an error, or the one before."""
        here = self._place()
        if here is None or self._zoom is None:
            return
        zoom = ZOOMS[self._zoom]
        begin = self._begin + (here - self._begin) // zoom * zoom
        edge = begin + zoom if step > 0 else begin
        row = self.store.row_at(edge * NS_PER_S)
        no = self.store.next_error(row - 1) if step > 0 else self.store.previous_error(row)
        found = self.store.by_no(no) if no is not None else None
        if found is None:
            self.app.notify("no more errors that way", timeout=2)
            return
        self._cursor = found.event.start // NS_PER_S
        self.draw()

    def action_select(self) -> None:
        """Begin a selection, or end it by showing its frames."""
        if self._anchor is not None:
            self.action_open()
            return
        self._anchor = self._place()
        self.draw()

    def action_clear(self) -> None:
        """No selection, no filter."""
        self._anchor = None
        if self.viewing.filter:
            analyzer(self).filter("")
        self.draw()

    def action_open(self) -> None:
        """Show the frames of the selection as a filter, or go to the first frame at the cursor."""
        here = self._place()
        if here is None or self._zoom is None:
            return
        zoom = ZOOMS[self._zoom]
        chosen = self._chosen(here, zoom)
        begin = self._begin + (here - self._begin) // zoom * zoom
        low, high = chosen or (begin, begin + zoom)
        first, after = (self.store.row_at(second * NS_PER_S) for second in (low, high))
        if chosen is not None:
            analyzer(self).filter(f"no >= {first} && no < {after}")
            self._anchor = None
            self.app.notify("a filter shows these frames only; esc removes it", timeout=5)
        analyzer(self).show_row(min(first, self.store.last_no))


def _counted(name: str, values: list[int], weight: int, style: str = "", of: str = "") -> Chart:
    top = max(values, default=0)
    return Chart(name, values, float(top), str(top), weight, style, of)


def _timed(name: str, values: list[float | None], weight: int) -> Chart:
    """Times in ms; the axis ends at a round number of its own: half of the answers may be far from the slowest."""
    top = round_up(max((value for value in values if value is not None), default=0.0))
    top = max(top, LEAST_AXIS)
    return Chart(name, values, top, f"{top:g} ms" if top < 1000 else f"{top / 1000:g} s", weight, "cyan", "of answers")


class _Chart(Static, can_focus=True):
    """The charts take the keys."""


def _answered(ms: float) -> str:
    told = float(f"{ms:.2g}")  # classes of times are right to no more
    return f"{brief(told, 2)} ms" if ms >= LEAST_TOLD else f"under {LEAST_TOLD:g} ms"
