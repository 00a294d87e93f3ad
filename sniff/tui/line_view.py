"""A view of lines that draws only those that are visible: the base of the tree of fields and of the dump."""

from __future__ import annotations

from textual.geometry import Size
from textual.scroll_view import ScrollView


class LineView(ScrollView, can_focus=True, inherit_bindings=False):
    """Its lines become more and fewer with every row that is looked at."""

    def set_length(self, lines: int) -> None:
        """Say how many lines there are. The screen is laid out anew only where a scroll bar comes or goes: with
        `virtual_size` alone it would be for every number of lines."""
        self.set_reactive(LineView.virtual_size, Size(0, lines))
        self._scroll_update(self.virtual_size)
