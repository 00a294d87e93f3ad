"""The tree of the selected frame's fields. Draws only visible lines: it is new for every frame that is looked at."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from rich.segment import Segment
from textual import events
from textual.binding import Binding, BindingType
from textual.message import Message
from textual.strip import Strip

from sniff.analysis.packet_tree import Field
from sniff.tui.key_names import named
from sniff.tui.line_view import LineView

SHIFT = 16
"""Cells by which long lines scroll at once."""

Path = tuple[tuple[str, int], ...]
"""From the layer down to a field: name, and which of its siblings of that name it is."""


@dataclass(frozen=True, slots=True)
class _Line:
    field: Field
    path: Path

    @property
    def depth(self) -> int:
        return len(self.path) - 1


class FieldTree(LineView, inherit_bindings=False):
    """Moving in it picks a field; place and folds stay when the next frame has the same fields."""

    BINDINGS: ClassVar[list[BindingType]] = named(
        [
            Binding("up,k", "move(-1)", "line up", show=False),
            Binding("down,j", "move(1)", "line down", show=False),
            Binding("pageup", "page(-1)", "page up", show=False),
            Binding("pagedown", "page(1)", "page down", show=False),
            Binding("home,g", "move(-65536)", "first line", show=False),
            Binding("end,G", "move(65536)", "last line", show=False),
            Binding("enter", "fold", "fold", tooltip="fold or unfold the part under the cursor"),
            Binding("right,l", "right", "right", tooltip="scroll long lines to the right", show=False),
            Binding("left,h", "left", "left", tooltip="scroll back, then to the part that holds this one", show=False),
        ]
    )
    COMPONENT_CLASSES: ClassVar[set[str]] = {"field-tree--name", "field-tree--cursor", "field-tree--here"}

    class Picked(Message):
        """The user moved to a field."""

        def __init__(self, field: Field) -> None:
            super().__init__()
            self.field = field

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.fields: tuple[Field, ...] = ()
        self.turned: set[Path] = set()  # parts that are folded and were not at first, or the other way round
        self.cursor = 0
        self.shifted = 0  # cells by which all lines are scrolled to the left
        self._lines: list[_Line] = []
        self._wanted: Path = ()  # where the user was last; kept over frames that have no such field

    @property
    def picked(self) -> Field | None:
        """The field under the cursor."""
        return self._lines[self.cursor].field if self.cursor < len(self._lines) else None

    def show(self, fields: tuple[Field, ...]) -> Field | None:
        """Show the fields of another frame; gives the field that the cursor kept, None when it is not there."""
        self.fields = fields
        self._flatten()
        kept = self._line_of(self._wanted)
        self.cursor = kept or 0
        self._show_cursor()
        return None if kept is None else self._lines[kept].field

    def pick_octet(self, offset: int) -> Field | None:
        """Move to the smallest field that holds an octet, unfolding what holds it; None when no field does."""
        found = _smallest(self.fields, offset, ())
        if found is None:
            return None
        self.turned ^= {line.path for line in _above(self.fields, found.path) if self._is_folded(line)}
        self._flatten()
        self._wanted = found.path
        self.cursor = self._line_of(found.path) or 0
        self._show_cursor()
        return found.field

    def _flatten(self) -> None:
        self._lines = []
        self._unfold(self.fields, ())
        self.cursor = min(self.cursor, max(0, len(self._lines) - 1))
        self.set_length(len(self._lines))
        self.refresh()

    def _unfold(self, fields: tuple[Field, ...], above: Path) -> None:
        for line in _placed(fields, above):
            self._lines.append(line)
            if line.field.children and not self._is_folded(line):
                self._unfold(line.field.children, line.path)

    def _is_folded(self, line: _Line) -> bool:
        return line.field.folded != (line.path in self.turned)

    def _line_of(self, path: Path) -> int | None:
        return next((number for number, line in enumerate(self._lines) if line.path == path), None) if path else None

    # -- moving ------------------------------------------------------------------------------------------------

    def action_move(self, by: int) -> None:
        """Move by lines."""
        if not self._lines:
            return
        self.cursor = min(max(0, self.cursor + by), len(self._lines) - 1)
        line = self._lines[self.cursor]
        self._wanted = line.path
        self._show_cursor()
        self.post_message(self.Picked(line.field))

    def action_page(self, by: int) -> None:
        """Move by pages."""
        self.action_move(by * max(1, self.scrollable_content_region.height))

    def action_fold(self) -> None:
        """Fold or unfold the part under the cursor."""
        if self._lines and self._lines[self.cursor].field.children:
            self.turned ^= {self._lines[self.cursor].path}
            self._flatten()

    def action_right(self) -> None:
        """Scroll to what a narrow pane cuts off."""
        self.shifted += SHIFT
        self.refresh()

    def action_left(self) -> None:
        """Scroll back; where nothing is scrolled, to the part that holds this one."""
        if not self.shifted:
            self.action_parent()
        self.shifted = max(0, self.shifted - SHIFT)
        self.refresh()

    def action_parent(self) -> None:
        """To the part that holds this one."""
        if self._lines:
            above = self._line_of(self._lines[self.cursor].path[:-1])
            if above is not None:
                self.action_move(above - self.cursor)

    def on_click(self, event: events.Click) -> None:
        """Pick a line; at its arrow, fold it."""
        line = self.scroll_offset.y + event.y
        if line < len(self._lines):
            self.action_move(line - self.cursor)
            if event.x <= 2 * self._lines[line].depth + 1:
                self.action_fold()

    def on_resize(self) -> None:
        """Keep the cursor in sight."""
        self._show_cursor()

    def _show_cursor(self) -> None:
        top, height = self.scroll_offset.y, max(1, self.scrollable_content_region.height)
        if not top <= self.cursor < top + height:
            wanted = self.cursor if self.cursor < top else self.cursor - height + 1
            self.scroll_to(y=wanted, animate=False, force=True)
        self.refresh()

    # -- drawing -----------------------------------------------------------------------------------------------

    def render_line(self, y: int) -> Strip:
        """Arrow, name, value."""
        width, base = self.scrollable_content_region.width, self.style_below
        number = self.scroll_offset.y + y
        if number >= len(self._lines):
            return Strip.blank(width, base)
        line = self._lines[number]
        if number == self.cursor:
            base += self.get_component_rich_style(f"field-tree--{'cursor' if self.has_focus else 'here'}", partial=True)
        name = base + self.get_component_rich_style("field-tree--name", partial=True)
        arrow = " " if not line.field.children else "▶" if self._is_folded(line) else "▼"
        lead, value = Segment(f"{'  ' * line.depth}{arrow} ", base), f": {line.field.value}" if line.field.value else ""
        strip = Strip([lead, Segment(line.field.name, name), Segment(value, base)])
        if line.field.brief and not self.shifted and strip.cell_length > width:  # the value is what is looked for
            strip = Strip([lead, Segment(line.field.brief, name), Segment(value, base)])
        if self.shifted:
            strip = strip.crop(self.shifted, max(self.shifted, strip.cell_length))
        if strip.cell_length > width > 0:  # what is cut says so: → goes on
            return Strip.join([strip.crop(0, width - 1), Strip([Segment("…", base)])]).adjust_cell_length(width, base)
        return strip.adjust_cell_length(width, base)


def _placed(fields: tuple[Field, ...], above: Path) -> Iterator[_Line]:
    seen: Counter[str] = Counter()
    for field in fields:
        yield _Line(field, (*above, (field.name, seen[field.name])))
        seen[field.name] += 1


def _above(fields: tuple[Field, ...], path: Path) -> Iterator[_Line]:
    """The parts that hold a field, the outermost first."""
    for depth in range(1, len(path)):
        line = next(line for line in _placed(fields, path[: depth - 1]) if line.path == path[:depth])
        yield line
        fields = line.field.children


def _smallest(fields: tuple[Field, ...], offset: int, above: Path) -> _Line | None:
    best: _Line | None = None
    for line in _placed(fields, above):
        inner = _smallest(line.field.children, offset, line.path)
        found = inner or (line if offset in line.field else None)
        if found is not None and (best is None or _size(found.field) < _size(best.field)):
            best = found
    return best


def _size(field: Field) -> int:
    return 0 if field.begin is None or field.end is None else field.end - field.begin
