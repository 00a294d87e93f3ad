"""The help page: all keys that work on the screen below, and what the letters in the lists mean."""

from __future__ import annotations

from typing import Any, ClassVar

from rich.table import Table
from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.screen import ModalScreen, Screen
from textual.widgets import Static

from sniff.tui.keybar import explanation, rank, working_keys

LEGEND: tuple[tuple[str, str], ...] = (
    (">", "the row under the cursor"),
    ("=", "the row that belongs to it: its request or response"),
    ("*  [words]", "a row that was marked (m), and what was written about it"),
    ("!", "damaged frame"),
    ("~", "noise: octets that are no frame"),
    ("P F B O", "line error on an octet: parity, framing, break, overrun"),
    ("E", "parity or framing error, the driver did not say which"),
    ("n", "noise directly before the frame"),
    ("s j", "frame split out of a run of octets, joined over a silence"),
    ("ms ±16", "times in ms: in truth up to 16 less or more, as far as the adapter tells"),
    ("38.0?", "a time that is less sure than that; its fields say how much"),
)

HEADER: tuple[tuple[str, str], ...] = (
    ("load", "share of the time in which the bus was busy"),
    ("health", "0 to 100 by a formula that the manual has; Nodes says what it is made of"),
    ("err", "rows that are damaged or noise, or whose exchange went wrong"),
    ("LOST", "octets or rows that were lost before they could be shown"),
    ("FOLLOW", "the newest row is under the cursor (f)"),
    ("FOLLOW OFF", "rows come at the end, the cursor stays where it is (f follows)"),
    ("FROZEN +n", "the view stands, n rows came since (space lets it go on)"),
)


class HelpScreen(ModalScreen[None]):
    """Closed by the keys that anybody would try."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,q,question_mark,enter", "dismiss", "close", show=False),
    ]

    def __init__(self, below: Screen[Any], title: str) -> None:
        super().__init__()
        self.below = below
        self.title_text = title

    def compose(self) -> ComposeResult:
        """One scrolling page."""
        with VerticalScroll() as page:
            page.border_title = Text(f"keys on {self.title_text}")
            page.border_subtitle = Text("esc closes")
            yield Static(self._keys())
            own = getattr(self.below, "LEGEND", ())
            if own:
                yield Static(Text(f"\nmarks and titles on {self.title_text}", style="bold"))
                yield Static(_table(own))
            yield Static(Text("\nmarks in the lists", style="bold"))
            yield Static(_table(LEGEND))
            yield Static(Text("\nwords in the first line", style="bold"))
            yield Static(_table(HEADER))

    def _keys(self) -> Table:
        """What keys do first, as in the footer; then those that only move: they have no explanation beyond their
        name."""
        together: dict[tuple[bool, str], list[str]] = {}
        for key, active in working_keys(self.below):
            together.setdefault((not active.binding.tooltip, explanation(active)), []).append(key)
        wanted = {explanation(active): rank(active) for _, active in working_keys(self.below)}
        ordered = sorted(together.items(), key=lambda item: (item[0][0], wanted[item[0][1]]))
        return _table(tuple(("  ".join(keys), words) for (_, words), keys in ordered))


def _table(rows: tuple[tuple[str, str], ...]) -> Table:
    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0), pad_edge=False)
    table.add_column(no_wrap=True, min_width=11)
    table.add_column()
    for keys, words in rows:
        table.add_row(Text(keys, style="bold"), Text(words))
    return table
