"""Screen 8: the master's programme: what is asked of whom, how often, and with which success."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

from rich.text import Text
from textual import events
from textual.app import ComposeResult
from textual.widgets import DataTable, Static

from dissectors.findings import counted
from dissectors.line import NS_PER_S
from dissectors.words import milliseconds
from sniff.analysis.poll import Poll
from sniff.analysis.poll_words import asked, changes, told
from sniff.analysis.sanitizing import sanitized
from sniff.tui.analyzer import analyzer
from sniff.tui.charts import round_up, sparkline
from sniff.tui.screens.tabling import TableScreen
from sniff.tui.still_judging import still_judging
from sniff.tui.tables import StationTable, count_cell
from sniff.tui.timeline_picture import LABEL, ZOOMS, Chart, axis, draw_charts, fitting, seconds_in_words, widths
from sniff.tui.times import between, clock, day_and_clock, interval, jitter, latency

SHOWN = 500
"""Entries in the table at most."""

WIDE = 110
"""From this width on all columns are shown."""

CHART = 60
"""Characters of the chart of one entry."""

TALL, HEIGHT, AXIS = 40, 7, 2
"""Height of the screen from which on the entry under the cursor has a chart with axes, of that at least, and of its
times."""

SMALL = 40
"""Characters of the chart in a line."""

Cell = Callable[[Poll], str]


def _time(value: int | None) -> str:
    return "–" if value is None else latency(value)


NARROW: tuple[tuple[str, Cell], ...] = (
    ("every ms", lambda poll: interval(poll.interval)),
    ("±", lambda poll: jitter(poll.jitter, poll.interval)),
    ("asked", lambda poll: str(poll.asked + poll.repeats)),
    ("none", lambda poll: str(poll.unanswered)),
    ("exc.", lambda poll: str(poll.exceptions)),
)
MORE: tuple[tuple[str, Cell], ...] = (
    ("late", lambda poll: str(poll.late)),
    ("dam.", lambda poll: str(poll.damaged)),
    ("rep.", lambda poll: str(poll.repeats)),
    ("p95 ms", lambda poll: _time(poll.latency.quantile(0.95))),
)
MOST: tuple[tuple[str, Cell], ...] = (
    *MORE[:-1],
    ("p50 ms", lambda poll: _time(poll.latency.quantile(0.5))),
    MORE[-1],
    ("max ms", lambda poll: _time(poll.latency.most)),
    ("first", lambda poll: clock(poll.first or 0)[:8]),
    ("last", lambda poll: clock(poll.last or 0)[:8]),
)
"""Columns of the widest screens, which have a chart too."""
WIDEST = 160
OFTEN = "how often"
OF_TIME = {"every ms", "±", "first", "last"}
"""Columns that say nothing of a capture without times."""
TROUBLE = {"none", "exc.", "late", "dam."}
"""Columns where anything is worth a look: such cells get a "!"."""


def _answered(poll: Poll) -> float:
    return poll.answered / (poll.asked + poll.repeats)


Order = Callable[[Poll], tuple[float, ...]]
ORDERS: tuple[tuple[str, Order], ...] = (
    ("when first asked", lambda poll: (poll.first or 0,)),
    ("station", lambda poll: (-1 if poll.key.station is None else poll.key.station, poll.first or 0)),
    ("least answered", lambda poll: (_answered(poll), poll.first or 0)),
    ("most often asked", lambda poll: (-poll.asked - poll.repeats, poll.first or 0)),
    ("most uneven", lambda poll: (-(poll.jitter or 0), poll.first or 0)),
)


class PollsScreen(TableScreen):
    """One line a distinct request; enter shows the newest frame that asked it."""

    TITLE = "Polls"
    ORDERS = tuple(name for name, _ in ORDERS)
    HINT = "holding   output-frequency   write"
    LEGEND = (
        ("stn", "who is asked; 1→5: by whom, where the frames say"),
        ("asks", "what for, with names where a profile is known; the values written are not part of it"),
        ("every ms", "from one request to the next: half of the intervals are shorter; repeats not counted"),
        ("±", "by how much nine of ten intervals differ, halved"),
        ("none  exc.", "requests without answer, and refused"),
        ("late  dam.", "answers that came too late, and damaged ones"),
        ("rep.", "requests that were repeats"),
        ("p50 p95 max ms", "response time: half are shorter, 95 of 100 are, the longest"),
        ("first  last", "when it was asked first and last"),
        (OFTEN, "requests over the time from the first request of all to the last; the highest bar is its own most"),
    )
    CSS_PATH = "polls.tcss"

    def __init__(self) -> None:
        super().__init__()
        self._drawn: tuple[int, tuple[object, ...]] | None = None
        self._shown: dict[str, Poll] = {}
        self._hidden = 0
        self._columns: tuple[tuple[str, Cell], ...] = ()
        self._charts: dict[str, tuple[tuple[int, ...], str]] = {}  # what each was drawn of, and the chart

    def compose_view(self) -> ComposeResult:
        """The table, and more about the entry under the cursor: a chart too where there is room."""
        yield StationTable(id="main", cursor_type="row", zebra_stripes=True)
        yield Static(id="chart", markup=False)
        yield Static(id="detail", markup=False)

    def on_mount(self) -> None:
        """Columns."""
        self.query_one(StationTable).cell_padding = 1
        self._lay_out(self.app.size.width)

    def on_resize(self, event: events.Resize) -> None:
        """Columns that fit."""
        self._lay_out(event.size.width)
        self.query_one("#chart").display = event.size.height >= TALL
        self.set_class(event.size.height >= TALL, "-charted")
        self._drawn = None

    def _lay_out(self, width: int) -> None:
        columns = (*NARROW, *(MOST if width >= WIDEST else MORE)) if width >= WIDE else NARROW
        if columns == self._columns:
            return
        self._columns = columns
        table = self.query_one(StationTable)
        table.clear(columns=True)
        table.add_column(Text("stn", justify="right"), key="stn")
        table.add_column(Text("asks"), key="asks")
        for title, _ in columns:
            table.add_column(Text(title, justify="right"), key=title)
        if width >= WIDEST:
            table.add_column(Text(OFTEN), key=OFTEN)
        self._drawn = None

    def draw(self) -> None:
        """Bring the table up to date, unless frozen."""
        state = (self.store.polls.version, self.view)
        if self._drawn == state or (self.viewing.frozen and self._drawn and self._drawn[1] == self.view):
            return
        self._drawn = state
        held = [
            poll for poll in self.store.polls if self.holds(_who(poll), self._asks(poll), poll.key.kind, _bad(poll))
        ]
        held.sort(key=ORDERS[self.order][1])
        self._hidden = max(0, len(held) - SHOWN)
        self._shown = {_key(poll): poll for poll in held[:SHOWN]}
        span = self._steps()
        self.query_one(StationTable).fill((key, self._cells(key, poll, span)) for key, poll in self._shown.items())
        self._describe()

    def _asks(self, poll: Poll, room: int = 0) -> str:
        said = asked(poll, self.store.model.devices, room)
        return said or poll.key.kind

    def _span(self) -> tuple[int, int]:
        """When anything was asked first and last, ns."""
        begin = min((one.first for one in self.store.polls if one.first is not None), default=0)
        return begin, max((one.last for one in self.store.polls if one.last is not None), default=0)

    def _steps(self) -> tuple[int, int]:
        """When anything was asked first, ns, and how long a character of a chart lasts."""
        begin, end = self._span()
        return begin, int(max(1.0, round_up((end - begin) / NS_PER_S / SMALL)) * NS_PER_S)

    def _cells(self, key: str, poll: Poll, span: tuple[int, int]) -> list[Text]:
        is_widest = len(self._columns) > len((*NARROW, *MORE))
        room = max(20, self.app.size.width - (44 if self._columns == NARROW else 118 + SMALL if is_widest else 78))
        said = sanitized(self._asks(poll, room))
        said = said if len(said) <= room else said[: room - 1] + "…"
        cells = [
            Text(_who(poll), justify="right"),
            Text(said),
            *(count_cell("–" if self._is_untold(title) else of(poll), title in TROUBLE) for title, of in self._columns),
        ]
        return [*cells, Text(self._small(key, poll, span))] if is_widest else cells

    def _is_untold(self, title: str) -> bool:
        return title in OF_TIME and not self.store.session.has_times

    def _small(self, key: str, poll: Poll, span: tuple[int, int]) -> str:
        """The chart of a line, which is only drawn anew where something came."""
        if not self.store.session.has_times:
            return ""
        state = poll.asked + poll.repeats, *span
        drawn = self._charts.get(key)
        if drawn is None or drawn[0] != state:
            self._charts[key] = drawn = state, _over_time(poll, *span)
        return drawn[1]

    def _describe(self) -> None:
        poll, open_end = self._here(), still_judging(analyzer(self).status, self.store)
        said = [self._detail(poll)] if poll is not None else ["nobody asked anything" + (" so" if self.words else "")]
        more = f" · {self._hidden} more are not shown" if self._hidden else ""
        summary = f"{counted(len(self._shown), 'request')}, {self.said}{more}"
        self.query_one("#detail", Static).update("\n".join(part for part in (*said, summary, open_end) if part))
        is_drawn = poll is not None and self.store.session.has_times
        self.query_one("#chart", Static).update(self._chart(poll) if poll is not None and is_drawn else "")

    def _detail(self, poll: Poll) -> str:
        key = poll.key
        whom = "all stations" if key.station is None else f"{self.store.dissector.noun} {key.station}"
        words = [f"{key.kind} to {whom}" + (f" from {key.source}" if key.source is not None else "")]
        said = asked(poll, self.store.model.devices)
        words += [said] if said else []
        counts = f"{poll.answered} of {poll.asked + poll.repeats} answered"
        if key.station is None and not poll.answered:  # nobody answers what is for all
            counts = f"said {poll.asked + poll.repeats} times" if poll.asked + poll.repeats > 1 else "said once"
        words.append(counts + (f", {counted(poll.repeats, 'repeat')} among them" if poll.repeats else ""))
        if poll.latency.count:
            low, high = poll.latency.quantile(0.5), poll.latency.most
            words.append(f"answers after {milliseconds(low or 0)}, at most {milliseconds(high or 0)}")
        if not self.store.session.has_times:
            return sanitized(" · ".join(words))
        first, last = poll.first or 0, poll.last or 0
        words.append(between(first, last))
        begin, end = self._span()
        found = changes(poll, begin, end, self.store.polls.holes)
        turned = told(found, lambda time: day_and_clock(time, begin, end).partition(".")[0])
        words += [turned] if turned else []
        chart = "" if self.size.height >= TALL else _chart(poll)
        return sanitized(" · ".join(words)) + (f"\nhow often  {chart}" if chart else "")

    def _chart(self, poll: Poll) -> Text:
        """How often it was asked over the time of the whole programme, with axes."""
        begin, end = (time // NS_PER_S for time in self._span())
        room = max(10, self.size.width - LABEL - 2)
        zoom = max(ZOOMS[fitting(end - begin + 1, room)], poll.slices.width // NS_PER_S)
        zoom *= -(-(end - begin + 1) // (zoom * room))  # no column without a cell
        sums = [0] * ((end - begin) // zoom + 1)
        for place, count in poll.slices.counts.items():
            sums[min(len(sums) - 1, max(0, place * poll.slices.width // NS_PER_S - begin) // zoom)] += count
        text, top, cells = Text(no_wrap=True), max(sums), widths(len(sums), room)
        height = max(HEIGHT, self.query_one("#chart").size.height - AXIS)
        asked_in = f"in {seconds_in_words(zoom)}"
        edges = range(begin * NS_PER_S, (begin + (len(sums) + 1) * zoom) * NS_PER_S, zoom * NS_PER_S)
        unheard = [self.store.load.drawn(0, *edge) is None for edge in pairwise(edges)]
        chart = Chart("asked", sums, top, str(top), style="cyan", of=asked_in)
        draw_charts(text, [chart], height, _plain, cells, unheard)
        return text.append("\n".join(axis(begin, zoom, -1, cells)))

    def _here(self) -> Poll | None:
        key = self.query_one(StationTable).key_here()
        return None if key is None else self._shown.get(key)

    def on_data_table_row_highlighted(self, event: DataTable.RowHighlighted) -> None:
        """The cursor went to another entry."""
        event.stop()
        self._describe()

    def on_data_table_row_selected(self, event: DataTable.RowSelected) -> None:
        """Enter or click on an entry."""
        event.stop()
        poll = self._here()
        if poll is None:
            return
        if self.store.by_no(poll.request) is None:
            self.notify("its frames are no longer in memory", timeout=2)
        else:
            analyzer(self).show_row(poll.request)


def _who(poll: Poll) -> str:
    station = "all" if poll.key.station is None else str(poll.key.station)
    return station if poll.key.source is None else f"{poll.key.source}→{station}"


def _key(poll: Poll) -> str:
    return repr(poll.key)


def _bad(poll: Poll) -> str:
    """Words that are found by who looks for trouble."""
    return " ".join(word for word, there in (("none", poll.unanswered), ("exception", poll.exceptions)) if there)


def _plain(place: int, style: str) -> str:
    """Every column as it is: there is no cursor."""
    return style


def _over_time(poll: Poll, begin: int, step: int) -> str:
    """How many requests in each `step` ns from `begin` on."""
    step = max(step, poll.slices.width)
    sums: dict[int, int] = {}
    for place, count in poll.slices.counts.items():
        at = max(0, place * poll.slices.width - begin) // step
        sums[at] = sums.get(at, 0) + count
    return sparkline([sums.get(at, 0) for at in range(max(sums, default=-1) + 1)], max(sums.values(), default=0))


def _chart(poll: Poll) -> str:
    """How many requests when, from the first to the last."""
    counts = poll.slices.counts
    if len(counts) < 3:
        return ""
    low, high = min(counts), max(counts)
    step = -(-(high - low + 1) // CHART)
    sums = [sum(counts.get(place + ahead, 0) for ahead in range(step)) for place in range(low, high + 1, step)]
    return sparkline(sums, max(sums))
