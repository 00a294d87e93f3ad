"""Screen 7: the token ring of a bus that has one: its order, its times, what went wrong in it."""

from __future__ import annotations

from time import monotonic

from rich.text import Text
from textual.app import ComposeResult
from textual.containers import VerticalScroll
from textual.widgets import DataTable, Static

from dissectors.token_ring import Cell
from sniff.tui.analyzer import analyzer
from sniff.tui.screens.base import ViewScreen
from sniff.tui.still_judging import still_judging
from sniff.tui.tables import StationTable

PERIOD = 1.0
"""Seconds between two looks: the ring as a value is made anew each time."""

COLUMNS: tuple[tuple[str, str], ...] = (
    ("MAC", "mac"),
    ("next", "next"),
    ("tokens", "tok."),
    ("retries", "retr"),
    ("lost", "lost"),
    ("loop p50 ms", "loop"),
    ("loop max ms", "max"),
    ("use p95 ms", "use95"),
    ("reply p95 ms", "repl95"),
    ("postponed", "post"),
    ("polls unanswered", "poll-"),
    ("damaged", "dam."),
)
"""Columns of a ring's table (`TokenRing.headings`) that fit into 80, with their short titles."""
TROUBLE = {"retries", "lost", "damaged"}


class RingScreen(ViewScreen):
    """One line a master, then the ring in sentences; enter shows the frames of a master."""

    TITLE = "Ring"
    LEGEND = (
        ("MAC  next", "a master, and the one that it passes the token to"),
        ("tok.", "tokens that it passed on"),
        ("retr", "tokens that it had to send again"),
        ("lost", "tokens that were lost at it"),
        ("loop  max", "round trip of the token, ms: median, longest"),
        ("use95", "from getting the token to its first frame, ms: 95 of 100 are shorter (95th percentile)"),
        ("repl95", "time to its answers, ms: 95th percentile"),
        ("post", "answers that it postponed"),
        ("poll-", "its polls for masters that nobody answered"),
        ("dam.", "damaged frames"),
    )
    CSS_PATH = "ring.tcss"

    def __init__(self) -> None:
        super().__init__()
        self._drawn = (-1, 0.0, False)

    def compose_view(self) -> ComposeResult:
        """The table, and the sentences."""
        yield StationTable(id="main", cursor_type="row", zebra_stripes=True)
        with VerticalScroll(id="sentences"):
            yield Static(id="words", markup=False)

    def on_mount(self) -> None:
        """Columns."""
        table = self.query_one(StationTable)
        for name, title in COLUMNS:
            table.add_column(Text(title, justify="right"), key=name)
        table.cell_padding = 1

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
        if shown is None:
            session = self.store.session
            unknown = "protocol" in session.unknown
            why = "the protocol is not known" if unknown else f"{session.protocol} passes no token"
            words.update(f"{why}: there is no ring to show")
            return
        ring = self.store.model.ring()
        places = [shown.headings.index(name) for name, _ in COLUMNS if name in shown.headings]
        rows = shown.rows(ring)
        self.query_one(StationTable).fill(
            (str(row[0]), [_cell(COLUMNS[at][0], row[place]) for at, place in enumerate(places)]) for row in rows
        )
        legend = (
            "tok.: tokens passed · retr: sent again · times in ms, 95: 95th percentile · loop, max: round trip of the "
            "token · use: from token to first frame · repl: answers · post: postponed · poll-: unanswered polls for "
            "masters · dam.: damaged frames"
        )
        words.update("\n".join((*([open_end] if open_end else []), *shown.sentences(ring), "", legend)))

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
    if name in TROUBLE and text != "0":
        return Text(f"!{text}", style="bold", justify="right")
    return Text(text, justify="right")
