"""Looking for text from the cursor on, the same on every screen that lists rows."""

from __future__ import annotations

from typing import ClassVar

from rich.text import Text
from textual.binding import Binding, BindingType

from sniff.tui.prompt import Prompt
from sniff.tui.screens.base import ViewScreen
from sniff.tui.tables import StationTable

LOOK_FOR = "look for"


class SearchScreen(ViewScreen):
    """A screen whose rows can be looked through; what is looked for is the same on all of them."""

    LOOKED_FOR: ClassVar[str] = "pump"
    """An example."""
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("n", "find_on(1)", "find", tooltip="next row with what is looked for; asks at first", show=False),
        Binding("N", "find_on(-1)", "find", tooltip="the row before with what is looked for", show=False),
        Binding("ctrl+f", "look_for", "look for", tooltip="ask for text (or octets of frames) to look for", show=False),
    ]

    def action_look_for(self) -> None:
        """Ask what to look for."""
        self.query_one(Prompt).ask(LOOK_FOR, self.viewing.search, self.LOOKED_FOR, lambda text: "")

    def on_prompt_answered(self, message: Prompt.Answered) -> None:
        """Look for it."""
        if message.purpose == LOOK_FOR and message.text.strip():
            message.stop()
            self.viewing.search = message.text.strip()
            self.action_find_on(1)

    def action_find_on(self, step: int) -> None:
        """The next or previous row that is shown and holds it."""
        if not self.viewing.search:
            self.action_look_for()
        else:
            self.find_on(self.viewing.search, step)

    def find_on(self, wanted: str, step: int) -> None:
        """Go to the next or previous row of the table that holds a text."""
        table = self.query_one("#main", StationTable)
        place = table.cursor_row + step
        while 0 <= place < table.row_count:
            cells = table.get_row_at(place)
            if (
                wanted.lower()
                in " ".join(cell.plain if isinstance(cell, Text) else str(cell) for cell in cells).lower()
            ):
                table.move_cursor(row=place, animate=False)
                return
            place += step
        self.say_not_found(wanted, step)

    def say_not_found(self, wanted: str, step: int) -> None:
        """Say that no other row holds it."""
        self.notify(f"{wanted!r} is in no row {'after' if step > 0 else 'before'} this one", timeout=2, markup=False)
