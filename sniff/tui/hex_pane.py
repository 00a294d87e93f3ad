"""The octets of the selected frame in hex and ASCII, with the selected field and the line errors."""

from __future__ import annotations

from typing import ClassVar

from rich.segment import Segment
from rich.style import Style
from textual import events
from textual.binding import Binding, BindingType
from textual.message import Message
from textual.strip import Strip

from dissectors.frame import Mark
from sniff.analysis.sanitizing import ascii_of
from sniff.analysis.wording import mark_names
from sniff.tui.frame_list import mark_letter
from sniff.tui.key_names import named
from sniff.tui.line_view import LineView

WIDE = 72
"""Width in cells from which 16 octets stand on a line instead of 8."""
NAMED_MARKS = 64
"""Line errors that are also written out in words below the dump."""


class HexPane(LineView, inherit_bindings=False):
    """A line error is a letter after its octet; the octets of the field are in reverse video."""

    BINDINGS: ClassVar[list[BindingType]] = named(
        [
            Binding("left,h", "move(-1)", "octet left", show=False),
            Binding("right,l", "move(1)", "octet right", show=False),
            Binding("up,k", "move_line(-1)", "line up", show=False),
            Binding("down,j", "move_line(1)", "line down", show=False),
            Binding("home,g", "move(-65536)", "first octet", show=False),
            Binding("end,G", "move(65536)", "last octet", show=False),
        ]
    )
    COMPONENT_CLASSES: ClassVar[set[str]] = {
        "hex-pane--title",
        "hex-pane--offset",
        "hex-pane--field",
        "hex-pane--cursor",
        "hex-pane--mark",
    }

    class Picked(Message):
        """The user moved to an octet."""

        def __init__(self, offset: int) -> None:
            super().__init__()
            self.offset = offset

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.row: int | None = None  # number of the row that is shown
        self.octets = b""
        self.letters: dict[int, str] = {}
        self.notes: list[str] = []
        self.cursor = 0
        self.span: tuple[int, int] | None = None
        self.field_name = ""

    def show(self, row: int | None, octets: bytes, marks: tuple[Mark, ...]) -> None:
        """Show the octets of another row; None and nothing where there is none."""
        self.row = row
        self.octets = octets
        self.letters = {mark.offset: mark_letter(mark.error) for mark in marks}
        self.notes = [f"octet {mark.offset}: {mark_names(mark.error)}" for mark in marks[:NAMED_MARKS]]
        if len(marks) > NAMED_MARKS:
            self.notes.append(f"and {len(marks) - NAMED_MARKS} more line errors")
        self.cursor = min(self.cursor, max(0, len(octets) - 1))
        self.span = None
        self.field_name = ""
        self._measure()

    def select(self, begin: int | None, end: int | None, name: str, cursor: int | None = None) -> None:
        """Show which octets a field has (None: nobody can tell)."""
        self.span = None if begin is None or end is None else (begin, end)
        self.field_name = name
        if cursor is None and begin is not None:
            cursor = begin
        if cursor is not None:
            self.cursor = min(max(0, cursor), max(0, len(self.octets) - 1))
            self._show_cursor()
        self.refresh()

    @property
    def per_line(self) -> int:
        """Octets on a line."""
        return 16 if self.scrollable_content_region.width >= WIDE - 1 else 8

    def _measure(self) -> None:
        lines = -(-len(self.octets) // self.per_line)
        self.set_length(1 + lines + len(self.notes))
        self.scroll_to(y=0, animate=False, force=True)
        self.refresh()

    def on_resize(self) -> None:
        """Other width, other lines."""
        self._measure()
        self._show_cursor()

    # -- moving ------------------------------------------------------------------------------------------------

    def action_move(self, by: int) -> None:
        """Move by octets."""
        if self.octets:
            self.cursor = min(max(0, self.cursor + by), len(self.octets) - 1)
            self._show_cursor()
            self.refresh()
            self.post_message(self.Picked(self.cursor))

    def action_move_line(self, by: int) -> None:
        """Move by lines, staying in the dump."""
        if 0 <= self.cursor + by * self.per_line < len(self.octets):
            self.action_move(by * self.per_line)

    def on_click(self, event: events.Click) -> None:
        """Pick the octet under the mouse."""
        line = self.scroll_offset.y + event.y - 1
        column = (event.x - 5 - (self.per_line == 16 and event.x > 28)) // 3
        offset = line * self.per_line + column
        if event.y >= 1 and 0 <= column < self.per_line and 0 <= offset < len(self.octets):
            self.action_move(offset - self.cursor)

    def _show_cursor(self) -> None:
        line = self.cursor // self.per_line
        top, height = self.scroll_offset.y, max(1, self.scrollable_content_region.height - 1)
        if not top <= line < top + height:
            self.scroll_to(y=max(0, line - height // 2), animate=False, force=True)

    # -- drawing -----------------------------------------------------------------------------------------------

    def title(self) -> str:
        """Which row this is, and which octets are selected, in words; the list may be ahead while it follows."""
        return "no row" if self.row is None else f"row {self.row} · {self._selected()}"

    def _selected(self) -> str:
        count = len(self.octets)
        if self.span is None:
            known = f"{self.field_name}: octets not known" if self.field_name else ""
            return known or f"{count} octet{'' if count == 1 else 's'}"
        begin, end = self.span
        where = f"octet {begin}" if end - begin <= 1 else f"octets {begin}–{end - 1}"
        return f"{where} of {count}: {self.field_name}"

    def render_line(self, y: int) -> Strip:
        """The title, a line of the dump, or a line error in words."""
        width = self.scrollable_content_region.width
        base = self.style_below
        if y == 0:
            style = base + self._style("title")
            return Strip([Segment(self.title(), style)]).adjust_cell_length(width, style)
        line = self.scroll_offset.y + y - 1
        begin = line * self.per_line
        if begin < len(self.octets):
            return Strip(self._dump(begin, base)).adjust_cell_length(width, base)
        note = line - -(-len(self.octets) // self.per_line)
        text = self.notes[note] if note < len(self.notes) else ""
        return Strip([Segment(text, base + self._style("mark"))]).adjust_cell_length(width, base)

    def _dump(self, begin: int, base: Style) -> list[Segment]:
        octets = self.octets[begin : begin + self.per_line]
        segments = [Segment(f"{begin:04x} ", base + self._style("offset"))]
        for position, octet in enumerate(octets, begin):
            style = base + self._octet_style(position)
            segments.append(Segment(f"{octet:02X}", style))
            letter = self.letters.get(position, " ")
            joined = style if self._in_span(position) and self._in_span(position + 1) else base
            segments.append(Segment(letter, base + self._style("mark") if letter != " " else joined))
            if position - begin == 7 and self.per_line == 16:
                segments.append(Segment(" ", base))
        missing = self.per_line - len(octets)
        gap = " " if self.per_line == 16 and missing > 8 else ""
        segments.append(Segment("   " * missing + gap + " ", base))
        for position, character in enumerate(ascii_of(octets), begin):
            segments.append(Segment(character, base + self._octet_style(position)))
        return segments

    def _in_span(self, position: int) -> bool:
        return self.span is not None and self.span[0] <= position < self.span[1]

    def _octet_style(self, position: int) -> Style:
        style = self._style("field") if self._in_span(position) else Style.null()
        if position == self.cursor and self.has_focus:
            style += self._style("cursor")
        return style

    def _style(self, name: str) -> Style:
        return self.get_component_rich_style(f"hex-pane--{name}", partial=True)
