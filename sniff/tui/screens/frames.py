"""Screen 1: every frame and all noise, with the fields and octets of the one under the cursor."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal
from textual.timer import Timer
from textual.widget import Widget

from dissectors.frame import Frame
from dissectors.tracker import Transaction
from sniff.analysis.packet_tree import Field, moved
from sniff.analysis.row_tree import tree_of
from sniff.analysis.sanitizing import sanitized
from sniff.engine.capture import CaptureError
from sniff.engine.engine import Row
from sniff.tui import goto
from sniff.tui.analyzer import analyzer
from sniff.tui.field_tree import FieldTree
from sniff.tui.filter_line import FilterLine
from sniff.tui.finding_rows import filter_of_octets, filter_of_row
from sniff.tui.frame_list import FrameList
from sniff.tui.hex_pane import HexPane
from sniff.tui.index import Known
from sniff.tui.linelist import LineList
from sniff.tui.marks import MarksScreen
from sniff.tui.prompt import Prompt
from sniff.tui.screens.listing import ListingScreen
from sniff.tui.times import date_and_clock

DETAIL_SECONDS = 0.05
"""How long the cursor must rest before fields and octets are shown: holding a key down stays fluent."""
FIRST_SECONDS = 0.01
"""The same for the first row: the first time that fields are taken apart takes a fifth of a second."""
FOLLOWING_SECONDS = 0.5
"""The same while the list follows a live bus: nobody reads ten frames a second."""


class FramesScreen(ListingScreen):
    """List, tree and hex dump, linked both ways."""

    TITLE = "Frames"
    CSS_PATH = "frames.tcss"
    HORIZONTAL_BREAKPOINTS: ClassVar[list[tuple[int, str]]] = [  # type: ignore[misc]  # textual's is no plain ClassVar
        (0, "-tiny"),
        (60, "-narrow"),
        (124, "-wide"),
    ]
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("x", "partner", "pair", tooltip="jump between request and response"),
        Binding(
            "m", "mark", "mark", tooltip="mark this row and write about it (kept in the recording, or beside a file)"
        ),
        Binding("M", "unmark", "unmark", tooltip="take the mark of this row away", show=False),
        Binding("apostrophe", "next_mark", "mark", tooltip="next marked row"),
        Binding("quotation_mark", "list_marks", "marks", tooltip="all marks; enter goes to one", show=False),
        Binding("colon", "go_to", "go to", tooltip="go to a row number or a time"),
        Binding("tab", "app.focus_next", "pane", tooltip="next pane: list, fields, octets", show=False),
        Binding("shift+tab", "app.focus_previous", "pane", tooltip="pane before", show=False),
        Binding("w", "save", "save", tooltip="save the rows that are shown: capture, table, JSON, text", show=False),
        Binding("equals_sign", "alike", "alike", tooltip="filter: what is like the thing under the cursor", show=False),
        Binding("z", "zoom", "zoom", tooltip="the pane as large as the screen, and back", show=False),
        Binding("y", "copy", "copy", tooltip="copy the octets that are shown as hex to the clipboard", show=False),
    ]

    def __init__(self) -> None:
        super().__init__()
        self._detail: tuple[Row, Transaction | None] | None = None  # what tree and hex show
        self._detail_timer: Timer | None = None
        self._marked = 0  # row that is written about
        self.zoomed: Widget | None = None  # the one pane that is shown, None while all are

    def compose_view(self) -> ComposeResult:
        """List above, fields and octets side by side below."""
        yield FilterLine()
        yield FrameList(self.store, self.viewing, id="main")
        with Horizontal(id="details"):
            yield FieldTree(id="fields")
            yield HexPane(id="octets")

    def test(self, number: int) -> bool:
        """The filter on a row."""
        return self.viewing.accepts_row(number)

    def known(self) -> Known | None:
        """What columns say of rows."""
        masks = self.viewing.masks
        return None if masks is None else masks.rows

    def rows_of(self, number: int) -> tuple[int, ...]:
        """The row itself."""
        return (number,)

    def bounds(self) -> tuple[int, int]:
        """Rows in memory, up to the freeze."""
        return self.store.first_no, self.viewing.last_row

    def place(self) -> int | None:
        """The row itself."""
        return self.viewing.row or None

    def touched(self, first: int, last: int) -> Sequence[int]:
        """Requests and responses."""
        numbers: list[int] = self.store.kept.rows_of_closings(first, last).tolist()
        return numbers

    def draw(self) -> None:
        """List first; details when the cursor rests."""
        super().draw()
        self._plan_detail()

    # -- list, tree and hex linked -----------------------------------------------------------------------------

    def on_line_list_moved(self, message: LineList.Moved) -> None:
        """Another row."""
        self._plan_detail()

    def on_line_list_chosen(self, message: LineList.Chosen) -> None:
        """Look into the row."""
        self._show_detail()
        self._zoom(None)
        self.query_one(FieldTree).focus()

    def on_field_tree_picked(self, message: FieldTree.Picked) -> None:
        """A field selects its octets."""
        field = message.field
        self.query_one(HexPane).select(field.begin, field.end, field.name)

    def on_hex_pane_picked(self, message: HexPane.Picked) -> None:
        """An octet selects its field."""
        field = self.query_one(FieldTree).pick_octet(message.offset)
        begin, end, name = (None, None, "") if field is None else (field.begin, field.end, field.name)
        self.query_one(HexPane).select(begin, end, name, cursor=message.offset)

    def _row(self) -> Row | None:
        """The row under the cursor; None when nothing is shown."""
        lines = self.lines
        return self.store.by_no(lines.cursor) if lines.cursor in lines.index else None

    def _state(self) -> tuple[Row, Transaction | None] | None:
        row = self._row()
        return None if row is None else (row, self.store.transaction(row))

    def _say_which(self) -> None:
        """Above tree and octets: whose they are, and "…" while the list that follows a bus is ahead of them."""
        shown, here = self._detail, self._row()
        said = ""
        if shown is not None:
            is_late = here is not None and here.no != shown[0].no
            said = f"row {shown[0].no} …, the list is ahead" if is_late else f"row {shown[0].no}"
        details = self.query_one("#details")
        if str(details.border_title or "") != said:
            details.border_title = said

    def _plan_detail(self) -> None:
        is_following = self.viewing.follow and not self.viewing.frozen
        if is_following:  # a moment is not worth to be drawn twice
            self._say_which()
        if self._state() == self._detail or self._detail_timer is not None:
            return
        delay = FOLLOWING_SECONDS if is_following else DETAIL_SECONDS
        if self._detail is None:  # beside the first row there must not stand nothing for long, but the list comes first
            delay = FIRST_SECONDS
        self._detail_timer = self.set_timer(delay, self._show_detail)

    def _show_detail(self) -> None:
        if self._detail_timer is not None:
            self._detail_timer.stop()
            self._detail_timer = None
        self._detail = self._state()
        self._say_which()
        octets, tree = self.query_one(HexPane), self.query_one(FieldTree)
        if self._detail is None:
            octets.show(None, b"", ())
            tree.show(())
            return
        row, transaction = self._detail
        octets.show(row.no, row.event.octets, row.event.marks)
        fields = tree_of(self.store.dissector, row, transaction, self._time_text(), self.store.meaning(row))
        kept = tree.show((*self._foreign_fields(row), *fields))
        if kept is not None:
            octets.select(kept.begin, kept.end, kept.name)

    def _time_text(self) -> Callable[[int], str] | None:
        return date_and_clock if self.store.session.has_times else None

    def _foreign_fields(self, row: Row) -> tuple[Field, ...]:
        """Fields of frames of a second protocol in a row of the first, at their octets where they are whole in it."""
        foreign = self.viewing.foreign
        found = () if foreign is None else foreign.of(row.no)
        made: list[Field] = []
        after = 0
        for one in found:
            assert foreign is not None
            at = row.event.octets.find(one.event.octets, after)
            made += [moved(field, at) for field in tree_of(foreign.second, one, None, self._time_text(), None)]
            after = max(after, at + len(one.event.octets))
        return tuple(made)

    # -- keys --------------------------------------------------------------------------------------------------

    def action_error(self, direction: int) -> None:
        """Next or previous row that is trouble and that is shown."""
        store, lines = self.store, self.lines
        no, is_hidden = lines.cursor, False
        for _ in range(100_000):  # a filter may hide errors
            found = store.next_error(no) if direction > 0 else store.previous_error(no)
            if found is None or found > self.viewing.last_row:
                break
            if found in lines.index:
                lines.go_to(found)
                return
            no, is_hidden = found, True
        self.say_none("no error after this row" if direction > 0 else "no error before this row", is_hidden)

    def action_partner(self) -> None:
        """From request to response and back."""
        row = self._row()
        partner = None if row is None else self.store.partner(row)
        if partner is None:
            transaction = None if row is None else self.store.transaction(row)
            self.notify("no partner" + (f": {transaction.verdict.words}" if transaction else ""), timeout=2)
        elif partner not in self.lines.index:
            self.notify(f"frame {partner} is hidden by the filter or no longer in memory", timeout=3)
        else:
            self.lines.go_to(partner)

    def action_mark(self) -> None:
        """Ask what to write about the row."""
        row = self._row()
        if row is not None:
            self._marked = row.no
            said = self.viewing.marks.get(row.no, "")
            self.query_one(Prompt).ask("mark", said, f"about row {row.no}: a few words, or none", lambda text: "")

    def action_unmark(self) -> None:
        """Take the mark of the row away."""
        row = self._row()
        if row is not None and row.no in self.viewing.marks:
            analyzer(self).mark_row(row.no, None)
        else:
            self.notify("this row is not marked", timeout=2)

    def action_list_marks(self) -> None:
        """All marks; enter goes to one."""
        if not self.viewing.marks:
            self.notify("no row is marked", timeout=2)
            return
        self.app.push_screen(MarksScreen(self.store, self.viewing.marks), self._go_to_mark)

    def _go_to_mark(self, no: int | None) -> None:
        if no is not None:
            self.lines.go_to(no)

    def action_next_mark(self) -> None:
        """Go to the next mark."""
        found = self.viewing.next_mark()
        if found is None:
            self.notify("no row is marked", timeout=2)
        else:
            self.lines.go_to(found)

    def action_go_to(self) -> None:
        """Ask where to go."""
        self.query_one(Prompt).ask("go to", "", "1200   10:32:05.5   +12.5", self._no_place)

    def _no_place(self, text: str) -> str:
        if text.strip():
            try:
                goto.find(self.store, text, self.viewing.last_row)
            except ValueError as error:
                return str(error)
        return ""

    def on_prompt_answered(self, message: Prompt.Answered) -> None:
        """Go there."""
        if message.purpose == "go to" and message.text.strip():
            message.stop()
            found = goto.find(self.store, message.text, self.viewing.last_row)
            if found is not None:
                self.lines.go_to(found)
        elif message.purpose == "mark":
            message.stop()
            analyzer(self).mark_row(self._marked, message.text.strip())
        elif message.purpose == "save":
            message.stop()
            self._save(message.text.strip())

    def action_save(self) -> None:
        """Ask where to save what is shown."""
        from sniff.tui.saving import why_not  # writers of captures: not before somebody writes

        self.query_one(Prompt).ask("save", "", "x.mcap  x.pcapng  x.cap.txt  x.csv  x.json  x.txt", why_not)

    def _save(self, path: str) -> None:
        from sniff.tui.saving import save

        index = self.lines.index
        try:
            count = save(self.store, (index[place] for place in range(len(index))), path)
        except (CaptureError, OSError) as error:
            self.notify(sanitized(error), severity="error", markup=False)
            return
        self.notify(f"{sanitized(path)}: {count} rows", markup=False)

    def action_alike(self) -> None:
        """Show what is alike: the octets of the field that is picked, else the kind and station of the row."""
        row = self._row()
        if row is None:
            return
        picked = self.query_one(FieldTree).picked if self.focused is not self.lines else None
        if picked is not None and picked.begin is not None and picked.end is not None:
            analyzer(self).filter(filter_of_octets(row.event.octets, picked.begin, picked.end))
        elif row.header is None:
            analyzer(self).filter("noise")
        else:
            place = row.placement or row.header
            station = place.destination if place.destination is not None else place.source
            analyzer(self).filter(filter_of_row(row.header.kind, station))

    def action_zoom(self) -> None:
        """One pane between header and keys, and back."""
        if self.zoomed is None and self.focused in self._panes():
            self._zoom(self.focused)
            self.notify("z or esc: back to all panes", timeout=3)
        else:
            self._zoom(None)

    def action_leave(self) -> None:
        """Back to all panes; then to the list; there: remove the filter."""
        if self.zoomed is not None:
            self._zoom(None)
        else:
            super().action_leave()

    def keys_after_prompt(self) -> Widget:
        """The list, or the one pane that is shown."""
        return self.zoomed or self.lines

    def _zoom(self, pane: Widget | None) -> None:
        self.zoomed = pane
        self.set_class(pane is not None, "-zoomed")
        self.set_class(pane is self.lines, "-list-alone")
        for each in self._panes():
            if pane is None:  # as the sheet says: a narrow screen has no room for the dump beside the fields
                each.styles.clear_rule("display")
            else:
                each.display = each is pane

    def _panes(self) -> tuple[Widget, ...]:
        return self.lines, self.query_one(FieldTree), self.query_one(HexPane)

    def action_copy(self) -> None:
        """Octets to the clipboard of the terminal (OSC 52)."""
        if not self.viewing.follow or self.viewing.frozen:  # then the cursor's row, however fast the keys came
            self._show_detail()
        if self._detail is not None:
            row, _ = self._detail
            self.app.copy_to_clipboard(row.event.octets.hex(" ").upper())
            kind = "frame" if isinstance(row.event, Frame) else "noise"
            self.notify(f"{kind} {row.no} copied as hex, if your terminal allows it", timeout=2)
