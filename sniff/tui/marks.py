"""The list of marks, over the screen below it; enter goes to one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import DataTable

from dissectors.findings import counted
from sniff.analysis.sanitizing import sanitized
from sniff.bus.rows import Store
from sniff.tui.tables import StationTable
from sniff.tui.times import clock


class MarksScreen(ModalScreen[int | None]):
    """Gives the number of the row that was chosen, None where none was."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,q,quotation_mark", "dismiss(None)", "close", show=False),
    ]

    def __init__(self, store: Store, marks: Mapping[int, str]) -> None:
        super().__init__()
        self._store = store
        self._marks = marks

    def compose(self) -> ComposeResult:
        """A table."""
        with Vertical() as page:
            page.border_title = Text(counted(len(self._marks), "mark"))
            page.border_subtitle = Text("enter goes there, esc closes")
            yield StationTable(cursor_type="row", zebra_stripes=True)

    def on_mount(self) -> None:
        """A line a mark."""
        table = self.query_one(StationTable)
        table.cell_padding = 1
        for title in ("row", "time", "written", "what"):
            table.add_column(title, key=title)
        for no, said in sorted(self._marks.items()):
            row = self._store.by_no(no)
            at, what = ("", "no longer in memory") if row is None else (clock(row.event.start), self._store.text(row))
            table.add_row(Text(str(no)), Text(at), Text(sanitized(said)), Text(sanitized(what)), key=str(no))
        table.focus()

    def on_data_table_row_selected(self, event: DataTable.RowSelected) -> None:
        """Enter or click."""
        event.stop()
        self.dismiss(int(str(event.row_key.value)))
