"""Screen 7: the token ring of a bus that has one: its order, its times, what went wrong in it."""

from __future__ import annotations

from collections.abc import Sequence
from time import monotonic
from typing import Any

from rich.text import Text
from textual import events
from textual.app import ComposeResult
from textual.containers import Container, VerticalScroll
from textual.widgets import DataTable, Static

from dissectors.token_ring import Cell, TokenRing
from sniff.tui.analyzer import analyzer
from sniff.tui.hanging import hanging
from sniff.tui.ring_picture import ring_picture, share_bars
from sniff.tui.screens.searching import SearchScreen
from sniff.tui.still_judging import still_judging
from sniff.tui.tables import StationTable, count_cell

PERIOD = 1.0
"""Seconds between two looks: the ring as a value is made anew each time."""

SHORT: dict[str, str] = {
    "MAC": "mac",
    "master": "master",
    "next": "next",
    "tokens": "tok.",
    "retries": "retr",
    "repeats": "rep.",
    "lost": "lost",
    "claims": "claims",
    "loop p50 ms": "loop",
    "loop max ms": "max",
    "rotation p50 ms": "loop",
    "rotation max ms": "max",
    "use p95 ms": "use95",
    "reply p95 ms": "repl95",
    "requests": "req.",
    "postponed": "post",
    "polls unanswered": "poll-",
    "GAP polls": "polls",
    "GAP answers": "answ.",
    "damaged": "dam.",
}
"""Columns of a ring's table (`TokenRing.headings`) that fit into 80, with their short titles."""
ROOMY = 280
"""Width from which all columns are shown, with their titles in full."""
BESIDE = 160
"""Width from which the ring stands beside the table, else above it."""
TALL = 40
"""Height from which on the titles are explained below the sentences."""
INDENT, SIDES = 2, 3
"""Cells by which a long sentence goes on further in, and of what stands at both sides."""
TROUBLE = {"retries", "repeats", "lost", "claims", "damaged"}
BARS = "bars"
LOOPS = ("loop p50 ms", "rotation p50 ms")


class RingScreen(SearchScreen):
    """One line a master, then the ring in sentences; enter shows the frames of a master."""

    TITLE = "Ring"
    LEGEND = (
        ("next", "the master that it passes the token to"),
        ("tok.", "tokens that it passed on"),
        ("retr rep.", "tokens that it had to send again"),
        ("lost claims", "tokens that were lost at it; tokens that it made anew"),
        ("loop  max", "round trip of the token, ms: median, longest"),
        ("use95", "from getting the token to its first frame, ms: 95 of 100 are shorter (95th percentile)"),
        ("repl95", "time to its answers, ms: 95th percentile"),
        ("post", "answers that it postponed"),
        ("poll-", "its polls for masters that nobody answered"),
        ("polls answ.", "its polls for other masters, and how many were answered"),
        ("dam.", "damaged frames"),
        (BARS, "share of the time in which a master has the token"),
    )
    CSS_PATH = "ring.tcss"

    def __init__(self) -> None:
        super().__init__()
        self._drawn = (-1, 0.0, False)
        self._titles: tuple[str, ...] = ()

    def compose_view(self) -> ComposeResult:
        """The ring, its table, and the sentences."""
        with Container(id="ring"):
            yield Static(id="picture", markup=False)
            yield StationTable(id="main", cursor_type="row", zebra_stripes=True)
        with VerticalScroll(id="sentences", can_focus=False):
            yield Static(id="words", markup=False)

    def on_mount(self) -> None:
        """Close together."""
        self.query_one(StationTable).cell_padding = 1

    def on_resize(self, event: events.Resize) -> None:
        """The ring beside its table where there is room."""
        self.set_class(event.size.width >= BESIDE, "-beside")
        self._drawn = (-1, 0.0, False)
        self.call_after_refresh(self.draw)

    def draw(self) -> None:
        """Bring it up to date once a second, and when all has been judged, unless frozen."""
        version, time, was_open = self._drawn
        open_end = still_judging(analyzer(self).status, self.store)
        waits = self.viewing.frozen or (monotonic() - time < PERIOD and bool(open_end) == was_open)
        if self.store.version == version or (waits and version >= 0):
            return
        self._drawn = (self.store.version, monotonic(), bool(open_end))
        words = self.query_one("#words", Static)
        shown = self.store.dissector.ring
        self.query_one("#ring").display = shown is not None
        self.query_one("#sentences").set_class(shown is None, "-alone")
        if shown is None:
            session = self.store.session
            unknown = "protocol" in session.unknown
            why = "the protocol is not known" if unknown else f"{session.protocol} passes no token"
            words.update(f"{why}: there is no ring to show\n\nWho asks whom, and how often, is on Polls (8).")
            return
        ring = self.store.model.ring()
        rows = shown.rows(ring)
        self._fill(shown.headings, rows)
        self.query_one("#picture", Static).update("\n".join(self._picture(shown, ring, rows)))
        units = self._units(shown.headings)
        said = Text("\n".join((*([open_end] if open_end else []), *units, *shown.sentences(ring), "")))
        if self.size.height < TALL:
            said.append("\n?: what the titles mean")
        else:
            for title, means in self.LEGEND:
                if not {BARS, *self._titles}.isdisjoint(title.split()):
                    said.append(f"\n{title:<12}", style="bold").append(means, style="dim")
        words.update(hanging(said, self.app.size.width - SIDES, INDENT))

    def _units(self, headings: Sequence[str]) -> list[str]:
        """Which of the short titles are times; the full ones say it themselves."""
        short = [SHORT[name] for name in headings if name.endswith(" ms") and SHORT.get(name) in self._titles]
        return [f"{', '.join(short)}: ms"] if short else []

    def _fill(self, headings: Sequence[str], rows: list[tuple[Cell, ...]]) -> None:
        roomy = self.app.size.width >= ROOMY
        places = [at for at, name in enumerate(headings) if roomy or name in SHORT]
        titles = tuple(headings[at] if roomy else SHORT[headings[at]] for at in places)
        table = self.query_one(StationTable)
        if titles != self._titles:
            self._titles = titles
            table.clear(columns=True)
            for title in titles:
                table.add_column(Text(title, justify="right"), key=title)
        table.fill((str(row[0]), [_cell(headings[at], row[at]) for at in places]) for row in rows)

    def _picture(self, shown: TokenRing, ring: Any, rows: list[tuple[Cell, ...]]) -> list[str]:
        width = self.app.size.width // (2 if self.has_class("-beside") else 1) - 4
        loops = [shown.headings.index(name) for name in LOOPS if name in shown.headings]
        times = sorted(time for row in rows for at in loops if isinstance(time := row[at], float))
        said = f"a round takes {times[len(times) // 2]:.1f} ms" if times else ""
        order, noun = shown.order(ring), self.store.dissector.noun
        drawn = ring_picture(order, noun, width, said) or ["no closed ring was seen"]
        bars = share_bars(shown.shares(ring), noun, width)
        return [*drawn, *(["has the token", *bars] if bars else [])]

    def on_data_table_row_selected(self, event: DataTable.RowSelected) -> None:
        """Enter or click on a master: its frames."""
        event.stop()
        key = self.query_one(StationTable).key_here()
        if key is not None:
            analyzer(self).filter(f"addr == {key}")
            analyzer(self).action_switch("frames")


def _cell(name: str, value: Cell) -> Text:
    if value is None:
        return Text("–", justify="right")
    text = (f"{value:.1f}" if abs(value) < 100 else f"{value:.0f}") if isinstance(value, float) else str(value)
    return count_cell(text, name in TROUBLE)
