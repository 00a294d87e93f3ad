"""Tables of hundreds of rows: only what changed is written."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import ClassVar

from rich.segment import Segment
from rich.text import Text
from textual.binding import Binding, BindingType
from textual.strip import Strip
from textual.widgets import DataTable

from sniff.tui.key_names import named


def count_cell(text: str, is_trouble: bool = False) -> Text:
    """A number in a column of counts: no 0 stands out, and what is worth a look gets a "!"."""
    if text == "0":
        return Text(text, style="dim", justify="right")
    return Text(f"!{text}", style="bold", justify="right") if is_trouble else Text(text, justify="right")


class StationTable(DataTable[Text], inherit_bindings=False):
    """A table whose rows have keys; `fill` brings it to what it should be."""

    BINDINGS: ClassVar[list[BindingType]] = named(
        [
            Binding("enter", "select_cursor", "open", tooltip="open the row: show what belongs to it"),
            Binding("up,k", "cursor_up", "line up", show=False),
            Binding("down,j", "cursor_down", "line down", show=False),
            Binding("pageup", "page_up", "page up", show=False),
            Binding("pagedown", "page_down", "page down", show=False),
            Binding("g,home", "scroll_top", "first line", show=False),
            Binding("G,end", "scroll_bottom", "last line", show=False),
        ]
    )

    def fill(self, rows: Iterable[tuple[str, Sequence[Text]]]) -> None:
        """Show these rows in this order; the cursor stays on its key."""
        wanted = list(rows)
        here = self.key_here()
        names = [str(key.value) for key in self.rows]
        if names != [key for key, _ in wanted]:
            self.clear()
            for key, cells in wanted:
                self.add_row(*cells, key=key)
            keys = [key for key, _ in wanted]
            if here in keys:
                self.move_cursor(row=keys.index(here), animate=False)
            return
        columns = list(self.columns)
        for key, cells in wanted:
            for column, cell in zip(columns, cells, strict=True):
                if self.get_cell(key, column) != cell:
                    self.update_cell(key, column, cell, update_width=True)

    def render_line(self, y: int) -> Strip:
        """A line; one that goes on beyond the right edge ends with a sign of it."""
        line, width = super().render_line(y), self.scrollable_content_region.width
        if self.virtual_size.width - self.scroll_offset.x <= width or not line.text.strip():
            return line
        *_, last = line
        return Strip.join([line.crop(0, width - 1), Strip([Segment("…", last.style)])])

    def key_here(self) -> str | None:
        """Key of the row under the cursor, None without rows."""
        if not 0 <= self.cursor_row < self.row_count:
            return None
        return str(self.coordinate_to_cell_key(self.cursor_coordinate).row_key.value)
