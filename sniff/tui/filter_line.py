"""The line that says which filter is on and how much it lets through."""

from __future__ import annotations

from rich.text import Text
from textual.widgets import Static

from sniff.analysis.sanitizing import sanitized
from sniff.tui.index import Index
from sniff.tui.view_state import Viewing

LEAST = 20
"""Cells that a filter has at least: what is counted, and that esc removes it, is said shorter then."""


class FilterLine(Static):
    """Hidden while everything is shown."""

    def show(self, viewing: Viewing, index: Index, things: str) -> None:
        """Say what is shown of `things`."""
        self.set_class(bool(viewing.filter), "on")
        if not viewing.filter:
            return
        whole = max(0, index.last - index.first + 1)
        state = f", {index.pending} to be searched" if index.pending else ""
        text = Text(f"filter: {sanitized(viewing.filter)}", no_wrap=True, overflow="ellipsis")
        tail = f"{len(index)} of {whole} {things}{state} · esc removes it "
        width = self.app.size.width
        if width < LEAST + 2 + len(tail):
            tail = f"{len(index)} of {whole} · esc "
        text.truncate(max(LEAST, width - len(tail) - 2), overflow="ellipsis", pad=True)
        self.update(text.append("  ").append(tail))
