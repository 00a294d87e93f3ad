"""A list of numbered lines that draws only what is visible: the base of the frame and transaction lists.

A view costs the same at a million lines as at a thousand: nothing here walks over the lines, it asks an `Index` which
number stands on a line, and the subclass for the cells of that number.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import ClassVar

from rich.segment import Segment
from rich.style import Style
from textual import events
from textual.binding import Binding, BindingType
from textual.geometry import Size
from textual.message import Message
from textual.strip import Strip

from sniff.config import COLOURS
from sniff.tui.analyzer import analyzer
from sniff.tui.columns import Cell, Column, pieces
from sniff.tui.index import Index
from sniff.tui.key_names import named
from sniff.tui.line_view import LineView
from sniff.tui.view_state import Viewing

SHIFT = 16
"""Cells by which the text scrolls at once."""


class LineList(LineView, inherit_bindings=False):
    """Shows the numbers of an index, one a line, below a line of column titles that stays."""

    BINDINGS: ClassVar[list[BindingType]] = named(
        [
            Binding("up,k", "move(-1)", "line up", show=False),
            Binding("down,j", "move(1)", "line down", show=False),
            Binding("pageup", "page(-1)", "page up", show=False),
            Binding("pagedown", "page(1)", "page down", show=False),
            Binding("home,g", "first", "first line", show=False),
            Binding("end,G", "last", "last line", show=False),
            Binding("right,l", "shift(1)", "right", tooltip="scroll the text to the right", show=False),
            Binding("left,h", "shift(-1)", "left", tooltip="scroll the text back to the left", show=False),
            Binding("enter", "choose", "open", tooltip="open the line: show what belongs to it"),
        ]
    )
    SCROLLED: ClassVar[str] = "text"
    """The column that may be wider than the screen."""

    COMPONENT_CLASSES: ClassVar[set[str]] = {
        "line-list--title",
        "line-list--cursor",
        "line-list--cursor-with-keys",
        "line-list--bad",
        "line-list--doubt",
        "line-list--good",
        "line-list--dim",
        "line-list--linked",
        "line-list--mark",
        *(f"line-list--{colour}" for colour in COLOURS),
    }

    class Moved(Message):
        """The cursor stands on another number; `by_user` is false when the list only followed."""

        def __init__(self, lines: LineList, number: int, by_user: bool) -> None:
            super().__init__()
            self.lines = lines
            self.number = number
            self.by_user = by_user

    class Chosen(Message):
        """Enter was pressed on a number."""

        def __init__(self, lines: LineList, number: int) -> None:
            super().__init__()
            self.lines = lines
            self.number = number

    def __init__(self, viewing: Viewing, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.viewing = viewing
        self.index = Index()
        self.cursor = 0
        self.shifted = 0  # cells by which the text of all lines is scrolled to the left
        self.drawn_lines = 0  # how many lines were ever drawn; tests count them
        self.columns: list[Column] = []
        self._drawn: object = None

    # -- what a subclass gives ---------------------------------------------------------------------------------

    def lay_out_columns(self, width: int) -> list[Column]:
        """The columns for a width in cells."""
        raise NotImplementedError

    def cells(self, number: int, line: int) -> dict[str, Cell]:
        """The cells of a number, by column name."""
        raise NotImplementedError

    def edge(self, number: int) -> Cell:
        """Two characters before the first column."""
        return Cell("> " if number == self.cursor else "  ")

    def row_of(self, number: int) -> int | None:
        """The row of the store that a number stands for."""
        raise NotImplementedError

    def linked(self, number: int) -> tuple[int, ...]:
        """Numbers that are drawn otherwise while the cursor is on `number`."""
        return ()

    def state(self, number: int) -> object:
        """What else than its number decides how a line looks; compared with `==`."""
        return None

    def empty_text(self) -> str:
        """What to say when there is no line."""
        return "nothing yet"

    # -- keeping up --------------------------------------------------------------------------------------------

    def bring_up(self, first: int, last: int) -> None:
        """Take new bounds; keep what is on the screen where it is, or go to the end when following."""
        top = self._top()
        self.index.bound(first, last)
        self._settle(top)

    def use_index(self, index: Index) -> None:
        """Show other lines; the cursor goes to the nearest of them."""
        self.index = index
        self._settle(None)
        self.show_cursor(centre=True)

    def search(self, count: int, until: float) -> None:
        """Let the index test `count` numbers up and down, and again until then (`time.perf_counter`)."""
        top = self._top()
        self.index.step(count)
        while self.index.pending and time.perf_counter() < until:
            self.index.step(count)
        self._settle(top)

    def retest(self, numbers: Iterable[int]) -> None:
        """Let the index test some numbers again."""
        top = self._top()
        for number in numbers:
            self.index.retest(number)
        self._settle(top)

    def _top(self) -> int | None:
        """The number on the first visible line."""
        line = self.scroll_offset.y
        return self.index[line] if line < len(self.index) else None

    def _settle(self, top: int | None) -> None:
        """After the index changed: size, scroll position (`top` stays at the top), cursor."""
        follow = self.viewing.follow and not self.is_vertical_scrollbar_grabbed
        self._set_length(len(self.index) + 1)
        if top is not None and not follow:
            line = self.index.position(top)
            if line != self.scroll_offset.y:
                self.scroll_to(y=line, animate=False, force=True)
        if len(self.index):
            wanted = self.index[len(self.index) - 1] if follow else self.index.nearest(self.cursor)
            if wanted is not None and wanted != self.cursor:
                self._set_cursor(wanted, by_user=False)
            if follow:
                self.show_cursor()
        self.columns = self.lay_out_columns(self._width)
        picture = self._picture()
        if picture != self._drawn:  # over a slow line every line drawn again costs
            self._drawn = picture
            self.refresh()

    def _set_length(self, lines: int) -> None:
        """Set the virtual size and the scroll bar; without the layout and the full redraw that the reactive causes."""
        self.set_reactive(LineList.virtual_size, Size(0, lines))
        self.vertical_scrollbar.window_virtual_size = lines
        self.vertical_scrollbar.window_size = self.scrollable_content_region.height

    def _picture(self) -> object:
        """Equal as long as the visible lines are, the cursor apart: who moves it draws what it touches."""
        index, top = self.index, self.scroll_offset.y
        visible = [index[line] for line in range(top, min(len(index), top + self.size.height))]
        note = "" if len(index) else self.empty_text()
        return self.columns, note, [(number, self.state(number)) for number in visible]

    # -- the cursor --------------------------------------------------------------------------------------------

    def go_to(self, number: int, by_user: bool = True) -> None:
        """Put the cursor on a number, or the nearest one shown, and show it; that of a user ends following."""
        nearest = self.index.nearest(number)
        if nearest is None:
            return
        if by_user and nearest != self.index[len(self.index) - 1]:
            self.viewing.follow = False
        if nearest != self.cursor:
            self._set_cursor(nearest, by_user)
        self.show_cursor(centre=not self._visible(self.index.position(nearest)))

    def _set_cursor(self, number: int, by_user: bool) -> None:
        touched = [self.cursor, *self.linked(self.cursor), number, *self.linked(number)]
        self.cursor = number
        self.viewing.row = self.row_of(number) or self.viewing.row
        self.viewing.row_from = self
        for changed in touched:
            if changed in self.index:
                self.refresh_line(self.index.position(changed) + 1)
        self.post_message(self.Moved(self, number, by_user))

    def _visible(self, line: int) -> bool:
        return 0 <= line - self.scroll_offset.y < self.visible_lines

    @property
    def visible_lines(self) -> int:
        """How many lines fit below the titles."""
        return max(1, self.scrollable_content_region.height - 1)

    def show_cursor(self, centre: bool = False) -> None:
        """Scroll as little as needed to see the cursor; to the middle with `centre`."""
        if not len(self.index):
            return
        line = self.index.position(self.cursor)
        top, height = self.scroll_offset.y, self.visible_lines
        if centre:
            wanted = line - height // 2
        elif line < top:
            wanted = line
        elif line >= top + height:
            wanted = line - height + 1
        else:
            return
        self.scroll_to(y=max(0, wanted), animate=False, force=True)

    def _move(self, by: int) -> None:
        if not len(self.index):
            return
        line = self.index.position(self.cursor) + by
        self.go_to(self.index[min(max(0, line), len(self.index) - 1)])

    def action_move(self, by: int) -> None:
        """Move the cursor by lines."""
        self._move(by)

    def action_page(self, by: int) -> None:
        """Move the cursor by pages."""
        self._move(by * self.visible_lines)

    def action_first(self) -> None:
        """Go to the first line."""
        if len(self.index):
            self.go_to(self.index[0])

    def action_last(self) -> None:
        """Go to the last line, and follow where more come."""
        if len(self.index):
            self.go_to(self.index[len(self.index) - 1])
            status = analyzer(self).status
            growing = status.reading or (status.live and not status.ended)
            self.viewing.follow = self.viewing.follow or (growing and not self.viewing.frozen)

    def action_shift(self, by: int) -> None:
        """Scroll the text of the lines, the other columns stand."""
        self.shifted = max(0, self.shifted + by * SHIFT)
        self.refresh()

    def action_choose(self) -> None:
        """Tell that the line under the cursor was chosen."""
        if self.cursor in self.index:
            self.post_message(self.Chosen(self, self.cursor))

    def watch_has_focus(self, _has_focus: bool) -> None:
        """The cursor's look is chosen as it is drawn: Textual would match its sheets to every style of the list."""

    # -- mouse -------------------------------------------------------------------------------------------------

    def on_click(self, event: events.Click) -> None:
        """Put the cursor where the mouse is; a double click opens."""
        line = self.scroll_offset.y + event.y - 1
        if event.y < 1 or line >= len(self.index):
            return
        self.go_to(self.index[line])
        if event.chain > 1:
            self.action_choose()

    def _on_mouse_scroll_down(self, event: events.MouseScrollDown) -> None:
        self._move(3)
        event.stop()

    def _on_mouse_scroll_up(self, event: events.MouseScrollUp) -> None:
        self._move(-3)
        event.stop()

    # -- drawing -----------------------------------------------------------------------------------------------

    def on_resize(self) -> None:
        """Lay the columns out anew and keep the cursor in sight."""
        self.columns = self.lay_out_columns(self._width)
        self.show_cursor()

    @property
    def _width(self) -> int:
        return max(1, self.scrollable_content_region.width - 2)

    def render_line(self, y: int) -> Strip:
        """Draw one visible line: the titles, or a row."""
        width = self.scrollable_content_region.width
        if y == 0:
            return self._strip([Cell("  "), *pieces(self.columns, self._titles())], width, "title")
        line = self.scroll_offset.y + y - 1
        if line >= len(self.index):
            note = "  " + self.empty_text() if y == 2 and not len(self.index) else ""
            return self._strip([Cell(note, "dim")], width, "")
        self.drawn_lines += 1
        number = self.index[line]
        cells = [self.edge(number), *pieces(self.columns, self._shifted(self.cells(number, line)))]
        return self._strip(cells, width, self._cursor_style if number == self.cursor else "")

    @property
    def _cursor_style(self) -> str:
        return "cursor-with-keys" if self.has_focus else "cursor"

    def _shifted(self, cells: dict[str, Cell]) -> dict[str, Cell]:
        """The cells with the text scrolled; what stands left of the screen is "…"."""
        cell = cells.get(self.SCROLLED)
        if not self.shifted or cell is None:
            return cells
        return {**cells, self.SCROLLED: Cell(f"…{cell.text[self.shifted + 1 :]}", cell.style)}

    def _titles(self) -> dict[str, Cell]:
        return {column.name: Cell(column.title) for column in self.columns}

    def _strip(self, cells: list[Cell], width: int, over: str) -> Strip:
        base = self.style_below
        top = self._style(over) if over else None
        segments = []
        for cell in cells:
            style = base + self._style(cell.style) if cell.style else base
            segments.append(Segment(cell.text, style + top if top else style))
        return Strip(segments).adjust_cell_length(width, base + top if top else base)

    def _style(self, name: str) -> Style:
        return self.get_component_rich_style(f"line-list--{name}", partial=True)
