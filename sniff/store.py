"""What the faces show: rows and transactions of one bus, held in memory, bounded, with running statistics.

Written by one thread; readers call the methods from the same thread (the terminal UI pulls a snapshot ten times a
second). Nothing here touches the capture: pausing a view never does.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right

from dissectors.registry import Dissector
from dissectors.tracker import Transaction, Verdict
from sniff.analysis.load import Load
from sniff.analysis.nodes import NodeTable
from sniff.analysis.wording import describe, is_error
from sniff.engine import Output, Row
from sniff.session import LineEvent, Session

KEPT_ROWS = 1_000_000
"""Rows kept for viewing; older ones are dropped from the view (never from a recording), with a count."""


class Store:
    """Rows in order of the wire; `rows[i].no == first_no + i` always holds."""

    def __init__(self, session: Session, dissector: Dissector, keep: int = KEPT_ROWS) -> None:
        self.session = session
        self.dissector = dissector
        self.keep = keep
        self.rows: list[Row] = []
        self.transactions: dict[int, Transaction] = {}
        self.closed: list[int] = []  # transaction ids in the order of closing
        self.errors: list[int] = []  # numbers of rows that are damaged frames or noise, or that have a bad verdict
        self.line_events: list[LineEvent] = []
        self.nodes = NodeTable()
        self.load = Load(session.line)
        self.dropped_rows = 0
        self.version = 0  # changes whenever anything changed

    # -- writing -----------------------------------------------------------------------------------------------

    def add(self, output: Output) -> None:
        """Take what the engine gave."""
        if not output:
            return
        self.version += 1
        for row in output.rows:
            self.rows.append(row)
            self.load.add(row)
            self.nodes.add_row(row)
            if is_error(row):
                self.errors.append(row.no)
        for transaction in output.transactions:
            self._close(transaction)
        if len(self.rows) > self.keep * 1.1:
            self._drop(len(self.rows) - self.keep)

    def add_line_event(self, event: LineEvent) -> None:
        """Take something that happened to the line."""
        self.version += 1
        self.line_events.append(event)

    def _close(self, transaction: Transaction) -> None:
        self.transactions[transaction.id] = transaction
        self.closed.append(transaction.id)
        self.nodes.add_transaction(transaction)
        if transaction.verdict in BAD_VERDICTS:
            no = transaction.request if transaction.request is not None else transaction.response
            position = bisect_left(self.errors, no or 0)
            if no is not None and self.errors[position : position + 1] != [no]:
                self.errors.insert(position, no)

    def _drop(self, count: int) -> None:
        del self.rows[:count]
        self.dropped_rows += count
        first = self.first_no
        del self.errors[: bisect_left(self.errors, first)]
        alive = {row.placement.tx for row in self.rows if row.placement is not None}
        self.transactions = {key: value for key, value in self.transactions.items() if key in alive}
        self.closed = [key for key in self.closed if key in alive]

    # -- reading -----------------------------------------------------------------------------------------------

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def first_no(self) -> int:
        """Number of the oldest row kept (1 when there is none)."""
        return self.rows[0].no if self.rows else 1

    def by_no(self, no: int) -> Row | None:
        """The row of that number, None when it was dropped or never was."""
        index = no - self.first_no
        return self.rows[index] if 0 <= index < len(self.rows) else None

    def transaction(self, row: Row) -> Transaction | None:
        """The closed transaction that a row belongs to; None while open, and for noise."""
        return None if row.placement is None else self.transactions.get(row.placement.tx)

    def partner(self, row: Row) -> int | None:
        """Number of the response to a request, of the request to a response; None when there is none."""
        transaction = self.transaction(row)
        if transaction is None:
            return None
        if transaction.request == row.no:
            return transaction.response
        return transaction.request

    def text(self, row: Row) -> str:
        """One line that says what a row is."""
        return describe(self.dissector, row)

    def next_error(self, no: int) -> int | None:
        """Number of the first error row after `no`, None when there is none."""
        position = bisect_right(self.errors, no)
        return self.errors[position] if position < len(self.errors) else None

    def previous_error(self, no: int) -> int | None:
        """Number of the last error row before `no`, None when there is none."""
        position = bisect_left(self.errors, no)
        return self.errors[position - 1] if position else None


BAD_VERDICTS = frozenset(
    {
        Verdict.EXCEPTION,
        Verdict.NO_RESPONSE,
        Verdict.LATE,
        Verdict.ECHO,
        Verdict.UNSOLICITED,
        Verdict.ANSWERED_TWICE,
        Verdict.DAMAGED_ANSWER,
        Verdict.DAMAGED_REQUEST,
    }
)
