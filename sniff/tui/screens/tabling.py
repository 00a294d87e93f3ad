"""What the tables of points and of polls share: an order to be chosen, and words that a row must hold to be shown."""

from __future__ import annotations

from typing import ClassVar

from textual.binding import Binding, BindingType

from sniff.analysis.sanitizing import sanitized
from sniff.tui.prompt import Prompt
from sniff.tui.screens.searching import SearchScreen

FIND = "words"


class TableScreen(SearchScreen):
    """A screen around one table. `ORDERS`: by what its rows can be sorted, in words; `HINT`: an example to look for."""

    ORDERS: ClassVar[tuple[str, ...]] = ()
    HINT: ClassVar[str] = ""
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("slash", "find", "filter", tooltip="show only rows that hold all of some words"),
        Binding("s", "sort", "sort", tooltip="sort by the next column that sorts"),
        Binding("escape", "leave", "clear", tooltip="show all rows again", show=False),
    ]

    def __init__(self) -> None:
        super().__init__()
        self.order = 0
        self.words: tuple[str, ...] = ()

    @property
    def view(self) -> tuple[object, ...]:
        """What is chosen, to be compared with what was drawn."""
        return self.order, self.words

    def holds(self, *texts: str) -> bool:
        """Whether a row with these texts is shown."""
        whole = " ".join(texts).lower()
        return all(word in whole for word in self.words)

    @property
    def said(self) -> str:
        """How the table is sorted and what was looked for, in words."""
        order = f"sorted by {self.ORDERS[self.order]}"
        return f"{order} · only with {' '.join(map(sanitized, self.words))} (esc: all)" if self.words else order

    def action_find(self) -> None:
        """Ask for words."""
        self.query_one(Prompt).ask(FIND, " ".join(self.words), self.HINT, lambda text: "")

    def on_prompt_answered(self, message: Prompt.Answered) -> None:
        """Show only what holds them."""
        if message.purpose == FIND:
            message.stop()
            self.words = tuple(message.text.lower().split())
            self.draw()

    def action_leave(self) -> None:
        """Show all again."""
        self.words = ()
        self.draw()

    def action_sort(self) -> None:
        """Next order."""
        self.order = (self.order + 1) % len(self.ORDERS)
        self.draw()
