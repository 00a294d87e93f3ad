"""A view of lines that draws only those that are visible: the base of lists, of the tree of fields and of the dump."""

from __future__ import annotations

from rich.style import Style
from textual.geometry import Region, Size
from textual.scroll_view import ScrollView
from textual.strip import Strip


class LineView(ScrollView, can_focus=True, inherit_bindings=False):
    """Its lines become more and fewer with every row that is looked at."""

    _below: Style | None = None

    def set_length(self, lines: int) -> None:
        """Say how many lines there are. The screen is laid out anew only where a scroll bar comes or goes: with
        `virtual_size` alone it would be for every number of lines."""
        self.set_reactive(LineView.virtual_size, Size(0, lines))
        self._scroll_update(self.virtual_size)

    def render_lines(self, crop: Region) -> list[Strip]:
        """Draw lines; the style below their text, of all that they lie on, is worked out once and not for each."""
        self._below = self.rich_style
        try:
            return super().render_lines(crop)
        finally:
            self._below = None

    @property
    def style_below(self) -> Style:
        """The style on which the text of a line stands."""
        return self._below or self.rich_style
