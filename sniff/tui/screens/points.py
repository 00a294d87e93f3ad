"""Screen 4: the latest value of every point, by device and name."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import ClassVar

from rich.text import Text
from textual import events
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import DataTable, Static

from dissectors.findings import counted
from dissectors.line import NS_PER_S
from dissectors.profiles.decoding import Quality, Value, number, range_words
from dissectors.words import brief
from sniff.analysis.guessed_points import GuessedPoint, LatestGuesses, guess_of
from sniff.analysis.points import Point
from sniff.analysis.sanitizing import sanitized
from sniff.tui.analyzer import analyzer
from sniff.tui.charts import BARS
from sniff.tui.plot import HistoryPlot
from sniff.tui.screens.tabling import TableScreen
from sniff.tui.still_judging import still_judging
from sniff.tui.tables import StationTable
from sniff.tui.times import UNTIMED, interval, jitter

SHOWN = 500
"""Points in the table at most."""

FRESH = 2 * NS_PER_S
"""How long a change is marked."""

TREND = 12
"""Values of the small chart."""

STEADY = "─"
"""A value that stays what it was."""

WORDS, LEAST_WORDS = 26, 16
"""Cells of a value, where there is room and where there is little."""
BETWEEN, MARK = 2, 3
"""Cells between two columns; of marks, and of a scrollbar."""
MARKS = {Quality.UNCERTAIN: "?", Quality.BAD: "!"}


def trend(values: Sequence[float]) -> str:
    """A chart between the least and the most of the values; a thin line when they are all the same."""
    values = values[-TREND:]
    if len(values) < 2:
        return ""
    low, high = min(values), max(values)
    if low == high:
        return STEADY * len(values)
    steps = len(BARS) - 2
    return "".join(BARS[1 + round((value - low) / (high - low) * steps)] for value in values)


def age(nanoseconds: int) -> str:
    """ "3 s", "4 min", "2 h"."""
    seconds = max(0, nanoseconds) // NS_PER_S
    if seconds < 120:
        return f"{seconds} s"
    return f"{seconds // 60} min" if seconds < 7200 else f"{seconds // 3600} h"


def shown_value(value: Value, room: int = WORDS) -> str:
    """The value with unit, or what it says in words, in so many cells."""
    text = value.words or number(value.value, value.entry, value.unit)
    return sanitized(text if len(text) <= room else text[: room - 1] + "…")


NARROW: tuple[str, ...] = ("", "stn", "point", "value", "age", "n", "every ms")
WIDE: tuple[str, ...] = (*NARROW, "±", "low", "high", "trend", "what it is")
LEFT = {"", "point", "trend", "what it is"}
"""Columns that are no numbers."""
FROM = 110
"""Width from which on all columns are shown."""

TALL = 30
"""Height from which on the plot is shown at once."""

Key = tuple[str, str]


Order = Callable[[Point], tuple[float | str, ...]]


def _device(point: Point) -> float:
    return 1 << 20 if point.sample.device is None else point.sample.device


ORDERS: tuple[tuple[str, Order], ...] = (
    ("station", lambda point: (_device(point),)),
    ("name", lambda point: (point.sample.name, _device(point))),
    ("newest change", lambda point: (-point.changed, _device(point))),
    ("most samples", lambda point: (-point.count, _device(point))),
    ("shortest interval", lambda point: (point.interval or NS_PER_S << 20, _device(point))),
)


class PointsScreen(TableScreen):
    """One line a point; enter shows the frame that carried its latest value."""

    TITLE = "Points"
    ORDERS = tuple(name for name, _ in ORDERS)
    HINT = "output-   3/   holding   running"
    LEGEND = (
        ("^", "pinned to the top (p)"),
        ("→", "a command: written to the device"),
        ("?", "uncertain value, or one that was guessed of registers that nobody described"),
        ("!", "value out of its range"),
        ("*", "before a value: it changed in the last two seconds; then it is bold too"),
        ("age", "how long ago the value was seen, at the time of the newest row"),
        ("n", "how often it was seen"),
        ("every ms  ±", "from one time to the next, half are shorter; by how much nine of ten differ, halved"),
        ("low  high", "the least and the most of its values"),
        ("trend", "the last values, between their least and their most"),
    )
    CSS_PATH = "points.tcss"
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("p", "pin", "pin", tooltip="pin the point to the top, or let it go"),
        Binding("b", "bits", "bits", tooltip="show the single bits of registers, or hide them"),
        Binding("v", "plot", "plot", tooltip="plot the last values of the point under the cursor, or not"),
        Binding("c", "commands", "commands", tooltip="only what was written to devices, or everything"),
    ]

    def __init__(self) -> None:
        super().__init__()
        self._pinned: list[Key] = []
        self._bits = False
        self._commands = False
        self._drawn: tuple[int, tuple[object, ...]] | None = None
        self._columns: tuple[str, ...] = ()
        self._plotted: bool | None = None
        self._guessed: tuple[tuple[Key, int] | None, GuessedPoint | None] = (None, None)
        self._guesses = LatestGuesses()

    def compose_view(self) -> ComposeResult:
        """The table, and more about the point under the cursor."""
        yield StationTable(id="main", cursor_type="row", zebra_stripes=True)
        yield HistoryPlot(id="plot")
        yield Static(id="detail", markup=False)

    def on_mount(self) -> None:
        """Columns."""
        self.query_one(StationTable).cell_padding = 1
        self._lay_out(self.app.size.width, self.app.size.height)

    def on_resize(self, event: events.Resize) -> None:
        """Columns that fit, and a plot where there is room."""
        self._lay_out(event.size.width, event.size.height)
        self._drawn = None

    def _lay_out(self, width: int, height: int) -> None:
        self._show_plot(height >= TALL if self._plotted is None else self._plotted)
        columns = WIDE if width >= FROM else NARROW
        if columns == self._columns:
            return
        self._columns = columns
        table = self.query_one(StationTable)
        table.clear(columns=True)
        for title in columns:
            table.add_column(Text(title, justify="left" if title in LEFT else "right"), key=title or "mark")
        self._drawn = None

    def draw(self) -> None:
        """Bring the table up to date, unless frozen."""
        view = (tuple(self._pinned), self._bits, self._commands, *self.view)
        state = (self.store.version, view)
        if self._drawn == state or (self.viewing.frozen and self._drawn and self._drawn[1] == view):
            return
        self._drawn = state
        newest = self.store.by_no(self.store.last_no)
        now, has_times = newest.event.end if newest is not None else 0, self.store.session.has_times
        guesses = self._guesses.of(self.store.points, self.store.model.series)
        told = [(point, guesses.get(_place(point)) if point.entry is None else None) for point in self._chosen()]
        points = [(point, guess) for point, guess in told if guess is None or not guess.is_covered]
        room = WORDS if self._columns == WIDE else self._room([point for point, _ in points[:SHOWN]], now)
        self.query_one(StationTable).fill(
            (_key(point), _cells(point, now, self._pinned, guess, room, has_times)[: len(self._columns)])
            for point, guess in points[:SHOWN]
        )
        self._hidden = max(0, len(points) - SHOWN)
        self._draw_detail()

    def _room(self, points: Sequence[Point], now: int) -> int:
        """Cells that the other columns leave for values."""
        texts: tuple[Callable[[Point], str], ...] = (
            lambda point: point.sample.station,
            lambda point: point.sample.name,
            lambda point: age(now - point.sample.time),
            lambda point: str(point.count),
            lambda point: interval(point.interval),
        )
        titles = (title for title in NARROW if title not in ("", "value"))
        others = [
            max(len(title), max((len(text(point)) for point in points), default=0))
            for title, text in zip(titles, texts, strict=True)
        ]
        left = self.app.size.width - sum(others) - BETWEEN * len(NARROW) - MARK
        return min(WORDS, max(LEAST_WORDS, left - 1))  # and the mark of a change

    def _chosen(self) -> list[Point]:
        wanted: Callable[[Point], bool] = lambda point: (  # noqa: E731
            (self._bits or not point.sample.value.bit)
            and (not self._commands or point.is_command)
            and self.holds(f"{point.sample.station}/{point.sample.name}", point.sample.value.words)
        )
        pinned = [point for key in self._pinned if (point := self.store.points.get(*key)) is not None]
        others = [point for point in self.store.points if _place(point) not in self._pinned and wanted(point)]
        others.sort(key=ORDERS[self.order][1])
        return pinned + others

    def _draw_detail(self) -> None:
        open_end = still_judging(analyzer(self).status, self.store)
        self.query_one("#detail", Static).update("\n".join(part for part in (open_end, self._detail()) if part))
        self._draw_plot()

    def _draw_plot(self) -> None:
        plot, point = self.query_one(HistoryPlot), self._here()
        if not plot.display:
            return
        if point is None:
            plot.show("", ())
            return
        unit = f" in {point.sample.value.unit}" if point.sample.value.unit else ""
        unit = " as a number" if point.sample.value.words and not unit else unit
        history, how = tuple(point.history), ""
        guess = self._guess(point)
        if guess is not None and guess.history:
            history, how = guess.history, f", {guess.words}"
        plot.show(f"{_key(point)}{unit}{how}", history)

    def _guess(self, point: Point) -> GuessedPoint | None:
        """What it may be, worked out once for each sample."""
        state = _place(point), point.count
        if self._guessed[0] != state:
            self._guessed = state, guess_of(point, self.store.model.series, self.store.points)
        return self._guessed[1]

    def _detail(self) -> str:
        point = self._here()
        if point is None and (self._commands or self.words):
            return sanitized(f"no such value · {self.said}") + self._more()
        if point is None:
            return "no values yet: they come from answered reads, confirmed writes and reports" + self._more()
        value, entry = point.sample.value, point.entry
        words = [f"{point.sample.station}/{value.name}"]
        words += [entry.title] if entry is not None else []
        words.append(number(value.value, entry, value.unit) + (f" ({value.words})" if value.words else ""))
        words.append(f"raw {value.raw:#x}" if value.raw is not None else "")
        span = "" if entry is None else range_words(entry)
        words.append(f"range {span}" if span else "")
        words += [{Quality.UNCERTAIN: "? uncertain", Quality.BAD: "! out of range"}.get(point.quality, "")]
        words += [f"? {entry.doubt}" if entry is not None and entry.doubt else ""]
        words.append("→ a command" if point.is_command else "")
        guess = self._guess(point)
        if guess is not None:
            words.append(guess.words + ("" if guess.value is None else f", so read {number(guess.value)}"))
        words += _seen(point, guess, self.store.session.has_times)
        words.append(f"row {point.sample.frame}")
        return sanitized(" · ".join(word for word in words if word) + f" · {self.said}" + self._more())

    @property
    def said(self) -> str:
        """With what is left out because nobody wrote it."""
        return f"only commands (c: everything) · {super().said}" if self._commands else super().said

    def _more(self) -> str:
        hidden = getattr(self, "_hidden", 0)
        return f" · {hidden} more points are not shown" if hidden else ""

    def _here(self) -> Point | None:
        key = self.query_one(StationTable).key_here()
        if key is None:
            return None
        station, _, name = key.partition("/")
        return self.store.points.get(station, name)

    def on_data_table_row_highlighted(self, event: DataTable.RowHighlighted) -> None:
        """The cursor went to another point."""
        event.stop()
        self._draw_detail()

    def on_data_table_row_selected(self, event: DataTable.RowSelected) -> None:
        """Enter or click on a point."""
        event.stop()
        self.action_choose()

    def action_choose(self) -> None:
        """Show the frame that carried the latest value."""
        point = self._here()
        if point is None:
            return
        if self.store.by_no(point.sample.frame) is None:
            self.notify("its frame is no longer in memory", timeout=2)
        else:
            analyzer(self).show_row(point.sample.frame)

    def action_pin(self) -> None:
        """Pin the point under the cursor, or let it go."""
        point = self._here()
        if point is None:
            return
        key = _place(point)
        if key in self._pinned:
            self._pinned.remove(key)
        else:
            self._pinned.append(key)
        self.draw()

    def action_plot(self) -> None:
        """The plot or not."""
        if not self.store.session.has_times:
            self.notify(f"when values came is {UNTIMED}", timeout=4)
            return
        self._plotted = not self.query_one(HistoryPlot).display
        self._show_plot(self._plotted)
        self._draw_detail()

    def _show_plot(self, shown: bool) -> None:
        """With a plot the table is no longer than its rows, and the plot takes the rest."""
        shown = shown and self.store.session.has_times
        self.query_one(HistoryPlot).display = shown
        self.set_class(shown, "-plotted")

    def action_bits(self) -> None:
        """Single bits or not."""
        self._bits = not self._bits
        self.draw()

    def action_commands(self) -> None:
        """Only commands or everything."""
        self._commands = not self._commands
        self.draw()


def _seen(point: Point, guess: GuessedPoint | None, has_times: bool) -> list[str]:
    """How often, how it moved, who wrote it."""
    samples = counted(point.count, "sample")
    if point.interval is not None and has_times:
        samples += f" every {interval(point.interval)} ms"
        samples += f" ±{jitter(point.jitter, point.interval)}" if point.jitter is not None else ""
    words = [samples]
    low, high, rate = (point.low, point.high, point.rate) if guess is None else (guess.low, guess.high, guess.rate)
    if point.sample.value.words:  # of states and flags the numbers between say nothing
        low = high = rate = None
    if low is not None and high is not None and low != high:
        words.append(f"seen {number(low)} … {number(high)}")
    if rate and has_times:
        words.append(f"moves {brief(rate, 3)} a second")
    if point.written:
        words.append(f"written {point.written} times" if point.written > 1 else "written once")
    return words


def _place(point: Point) -> Key:
    return point.sample.station, point.sample.name


def _key(point: Point) -> str:
    return "/".join(_place(point))


def _cells(
    point: Point, now: int, pinned: list[Key], guess: GuessedPoint | None, room: int, has_times: bool
) -> list[Text]:
    sample, value, entry = point.sample, point.sample.value, point.entry
    is_number = not value.words  # of states and flags the numbers between say nothing
    shown, low, high = shown_value(value, room), point.low, point.high
    quality = MARKS.get(point.quality, "")
    if guess is not None and guess.value is not None and not guess.is_itself:
        shown, low, high, quality = number(guess.value), guess.low, guess.high, MARKS[Quality.UNCERTAIN]
    mark = ("^" if _place(point) in pinned else "") + ("→" if point.is_command else "") + quality
    fresh = has_times and bool(point.changed) and now - point.changed <= FRESH
    style = "bold" if fresh else ""
    return [
        Text(mark),
        Text(sample.station, justify="right"),
        Text(sanitized(sample.name)),
        Text(("*" if fresh else "") + shown, style=style, justify="right"),
        Text(age(now - sample.time) if has_times else "–", justify="right"),
        Text(str(point.count), justify="right"),
        Text(interval(point.interval if has_times else None), justify="right"),
        Text(jitter(point.jitter, point.interval) if has_times else "–", justify="right"),
        Text(brief(low, 5) if low is not None and is_number else "–", justify="right"),
        Text(brief(high, 5) if high is not None and is_number else "–", justify="right"),
        Text(trend([number for _, number in point.history])),
        Text(sanitized(entry.title if entry is not None else guess.words if guess is not None else "")),
    ]
