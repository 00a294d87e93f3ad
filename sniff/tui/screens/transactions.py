"""Screen 2: what became of every request."""

from __future__ import annotations

from textual.app import ComposeResult

from sniff.bus.trouble import closings_in_trouble
from sniff.tui.analyzer import analyzer
from sniff.tui.filter_line import FilterLine
from sniff.tui.index import Known
from sniff.tui.linelist import LineList
from sniff.tui.screens.listing import ListingScreen
from sniff.tui.transaction_list import TransactionList


class TransactionsScreen(ListingScreen):
    """Closed transactions; enter shows the frames of one."""

    TITLE = "Transactions"
    THINGS = "transactions"

    def compose_view(self) -> ComposeResult:
        """The list."""
        yield FilterLine()
        yield TransactionList(self.store, self.viewing, id="main")

    def test(self, number: int) -> bool:
        """The filter on the frames of a transaction."""
        return self.viewing.accepts_closed(number)

    def known(self) -> Known | None:
        """What columns say of its frames."""
        masks = self.viewing.masks
        return None if masks is None else masks.closings

    def rows_of(self, number: int) -> tuple[int, ...]:
        """Request and response."""
        transaction = self.store.closed_by_no(number)
        both = () if transaction is None else (transaction.request, transaction.response)
        return tuple(no for no in both if no is not None)

    def bounds(self) -> tuple[int, int]:
        """Closed transactions in memory, up to the freeze."""
        return self.store.dropped_transactions + 1, self.viewing.last_closed

    def place(self) -> int | None:
        """The transaction of the row under the shared cursor."""
        row = self.store.by_no(self.viewing.row)
        return None if row is None or row.placement is None else self.store.closed_number(row.placement.tx)

    def on_line_list_chosen(self, message: LineList.Chosen) -> None:
        """Show its frames."""
        shown = self.lines.row_of(message.number)
        if shown is None or self.store.by_no(shown) is None:
            self.notify("its frames are no longer in memory", timeout=2)
        else:
            analyzer(self).show_row(shown)

    def action_error(self, direction: int) -> None:
        """Next or previous transaction that went wrong and that is shown."""
        lines, is_hidden = self.lines, False
        for number in closings_in_trouble(self.store.kept, lines.cursor, direction):
            if number in lines.index:
                lines.go_to(number)
                return
            is_hidden |= number <= self.viewing.last_closed
        self.say_none("no trouble after this one" if direction > 0 else "no trouble before this one", is_hidden)
