"""The list of closed transactions, in the order of closing, one line each."""

from __future__ import annotations

from rich.cells import cell_len

from dissectors.tracker import Transaction, Verdict
from sniff.analysis.sanitizing import sanitized
from sniff.bus.trouble import is_trouble
from sniff.engine.engine import Row
from sniff.tui.analyzer import analyzer
from sniff.tui.columns import Cell, Column, fit
from sniff.tui.store_list import StoreList
from sniff.tui.verdicts import latency_cell, verdict_cell

COLUMNS = (
    Column("tx", "tx", 6, right=True),
    Column("time", "time", 12, right=True),
    Column("station", "stn ", 4, right=True, needs=100),  # what stands in `kind` begins with it
    Column("kind", "what"),
    Column("verdict", "verdict", 12),
    Column("latency", "latency ms", 8, right=True),
    Column("attempt", "try", 3, right=True),
    Column("request", "request", 8, right=True, needs=128),
    Column("response", "response", 8, right=True, needs=128),
)


LINE = 80
"""Cells from which on question and answer may both be read."""
BESIDE = " · "


class TransactionList(StoreList):
    """Closed transactions by the number of their closing."""

    COLUMNS = COLUMNS
    NAME = "transactions"
    SCROLLED = "kind"

    def row_of(self, number: int) -> int | None:
        """Its request, or its response where no request was seen."""
        transaction = self.store.closed_by_no(number)
        return None if transaction is None else transaction.request or transaction.response

    def state(self, number: int) -> object:
        """A closed transaction does not change."""
        return self.viewing.time_mode

    def edge(self, number: int) -> Cell:
        """Cursor, and trouble."""
        transaction = self.store.closed_by_no(number)
        bad = transaction is not None and is_trouble(transaction)
        return Cell((">" if number == self.cursor else " ") + ("!" if bad else " "), "bad" if bad else "")

    def cells(self, number: int, line: int) -> dict[str, Cell]:
        """What is known of one transaction."""
        transaction = self.store.closed_by_no(number)
        if transaction is None:
            return {"kind": Cell("no longer in memory", "dim")}
        return {
            "tx": Cell(str(transaction.id), "dim"),
            "time": Cell(self._time(transaction, line)),
            "station": Cell("" if transaction.station is None else f"{transaction.station} "),
            "kind": Cell(self._what(transaction)),
            "verdict": verdict_cell(transaction, self.width_of("verdict"), attempts=False),
            "latency": latency_cell(transaction.latency, self.store.session.adapter.latency),
            "attempt": Cell(str(transaction.attempt), "doubt" if transaction.attempt > 1 else "dim"),
            "request": Cell("–" if transaction.request is None else str(transaction.request), "dim"),
            "response": Cell("–" if transaction.response is None else str(transaction.response), "dim"),
        }

    def _what(self, transaction: Transaction) -> str:
        """What its frames say; its kind where they are no longer in memory."""
        rows = [self.store.by_no(no) for no in (transaction.request, transaction.response) if no is not None]
        response = transaction.response
        if self.width_of("kind") < LINE and response is not None and self.store.told(response):
            rows.reverse()  # values first: both do not fit
        parts = self._told([row for row in rows if row is not None]) or [sanitized(transaction.kind)]
        error = sanitized(transaction.error or "")
        if error and not any(error in part for part in parts):
            parts.append(error)
        if transaction.of is not None and transaction.verdict in (Verdict.LATE, Verdict.ECHO, Verdict.ANSWERED_TWICE):
            parts.insert(0, f"of tx {transaction.of}")
        return BESIDE.join(parts)

    def _told(self, rows: list[Row]) -> list[str]:
        """What rows say side by side: all of it, or without the raw numbers what has room."""
        whole, room = [sanitized(self.store.text(row)) for row in rows], self.width_of("kind")
        if self.shifted or cell_len(BESIDE.join(whole)) <= room:
            return whole
        if len(rows) < 2 or room < LINE:
            return [sanitized(self.brief_text(row, room)) for row in rows]
        first, second = rows
        left = room - len(BESIDE)
        answer = _within(sanitized(self.store.meant_text(second, left // 2)), left // 2)
        left -= cell_len(answer)
        return [_within(sanitized(self.store.meant_text(first, left)), left), answer]

    def _time(self, transaction: Transaction, line: int) -> str:
        before = self.store.closed_by_no(self.index[line - 1]) if line else None
        return self.time_text(transaction.start, None if before is None else before.start)

    def empty_text(self) -> str:
        """Why nothing is shown."""
        if self.index.pending:
            return "searching …"
        if self.viewing.filter:
            return "no transaction passes the filter"
        return "no transaction has closed yet" if analyzer(self).status.live else "no transactions in this file"


def _within(text: str, room: int) -> str:
    """A text in at most so many cells."""
    return text if cell_len(text) <= room else fit(text, room).rstrip()
