"""Screen 3: who is on the bus, and who fails."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import DataTable, Static

from dissectors.tracker import Verdict
from dissectors.words import milliseconds
from sniff.analysis.nodes import Node
from sniff.tui.analyzer import analyzer
from sniff.tui.screens.base import ViewScreen
from sniff.tui.tables import StationTable

ANSWERS = (Verdict.ANSWERED, Verdict.RETRY, Verdict.EXCEPTION)


def answered(node: Node) -> float | None:
    """Share of the requests to a station that it answered in time, exceptions included; None when never asked."""
    return sum(node.verdicts[verdict] for verdict in ANSWERS) / node.asked if node.asked else None


def _percent(share: float | None) -> str:
    if share is None:
        return "–"
    text = f"{share:.1%}"
    return "99.9%" if text == "100.0%" and share < 1 else text  # one failure in ten thousand is still a failure


def _time(value: int | None) -> str:
    return "–" if value is None else milliseconds(value)


COLUMNS: tuple[tuple[str, Callable[[Node], str]], ...] = (
    ("stn", lambda node: str(node.address)),
    ("sent", lambda node: str(node.sent)),
    ("recv", lambda node: str(node.received)),
    ("asked", lambda node: str(node.asked)),
    ("answ.", lambda node: _percent(answered(node))),
    ("none", lambda node: str(node.unanswered)),
    ("exc.", lambda node: str(node.verdicts[Verdict.EXCEPTION])),
    ("dam.", lambda node: str(node.damaged)),
    ("p50", lambda node: _time(node.latency.quantile(0.5))),
    ("p95", lambda node: _time(node.latency.quantile(0.95))),
    ("max", lambda node: _time(node.latency.most)),
)
TROUBLE = {"none", "exc.", "dam."}
"""Columns where anything but 0 is worth a look: such cells get a "!"."""

Order = Callable[[Node], tuple[float, ...]]
ORDERS: tuple[tuple[str, Order], ...] = (
    ("address", lambda node: (node.address,)),
    ("least answered", lambda node: (2.0 if (share := answered(node)) is None else share, node.address)),
    ("slowest", lambda node: (-(node.latency.quantile(0.95) or 0), node.address)),
    ("most damaged", lambda node: (-node.damaged, node.address)),
)


class NodesScreen(ViewScreen):
    """One line a station; enter shows its frames."""

    TITLE = "Nodes"
    CSS_PATH = "nodes.tcss"
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("s", "sort", "sort", tooltip="sort by address, least answered, slowest, most damaged"),
    ]

    def __init__(self) -> None:
        super().__init__()
        self._order = 0
        self._drawn: tuple[int, int] | None = None

    def compose_view(self) -> ComposeResult:
        """The table, and what its columns mean."""
        yield StationTable(id="main", cursor_type="row", zebra_stripes=True)
        yield Static(id="legend", markup=False)

    def on_mount(self) -> None:
        """Columns."""
        table = self.query_one(StationTable)
        for title, _ in COLUMNS:
            table.add_column(Text(title, justify="right"), key=title)
        table.cell_padding = 1

    def draw(self) -> None:
        """Bring the table up to date, unless frozen."""
        state = (self.store.heard, self._order)
        if self._drawn == state or (self.viewing.frozen and self._drawn and self._drawn[1] == self._order):
            return
        self._drawn = state
        title, order = ORDERS[self._order]
        nodes = sorted(self.store.nodes.present(), key=order)
        self.query_one(StationTable).fill((str(node.address), _cells(node)) for node in nodes)
        self.query_one("#legend", Static).update(
            f"{len(nodes)} stations, sorted by {title} · answ.: answered in time, exceptions too · none: no answer · "
            "exc.: exceptions · dam.: damaged frames · p50, p95, max: latency" + self._doubt()
        )

    def _doubt(self) -> str:
        latency = self.store.session.adapter.latency
        return f" (±{milliseconds(latency)})" if latency else ""

    def action_sort(self) -> None:
        """Next order."""
        self._order = (self._order + 1) % len(ORDERS)
        self.draw()

    def on_data_table_row_selected(self, event: DataTable.RowSelected) -> None:
        """Enter or click on a station."""
        event.stop()
        self.action_choose()

    def action_choose(self) -> None:
        """Show the frames of the station under the cursor."""
        key = self.query_one(StationTable).key_here()
        if key is not None:
            analyzer(self).filter(f"addr == {key}")
            analyzer(self).action_switch("frames")


def _cells(node: Node) -> list[Text]:
    return [_cell(title, text(node)) for title, text in COLUMNS]


def _cell(title: str, text: str) -> Text:
    if title in TROUBLE and text != "0":
        return Text(f"!{text}", style="bold", justify="right")
    return Text(text, justify="right")
