"""The list of all frames and noise, one line each."""

from __future__ import annotations

from rich.cells import cell_len

from dissectors.frame import Event, FoundBy, Frame, LineError
from dissectors.tracker import Transaction, Verdict
from sniff.analysis.sanitizing import sanitized
from sniff.analysis.wording import describe
from sniff.engine.engine import Row
from sniff.tui.analyzer import analyzer
from sniff.tui.columns import Cell, Column
from sniff.tui.store_list import StoreList
from sniff.tui.verdicts import latency_cell, verdict_cell

COLUMNS = (
    Column("no", "no", 6, right=True),
    Column("time", "time", 12, right=True),
    Column("src", "src", 4, right=True, needs=94),
    Column("dst", "dst ", 5, right=True, needs=94),  # what stands behind it begins with a number too
    Column("text", "what", spills=True),
    Column("verdict", "verdict", 9),
    Column("latency", "latency ms", 8, right=True),
    Column("len", "len", 4, right=True, needs=98),
    Column("flags", "flag", 4),
)
USUAL = frozenset({Verdict.ANSWERED, Verdict.BROADCAST, Verdict.DATA})
FOUND_LETTERS = {FoundBy.SPLIT: "s", FoundBy.JOINED: "j"}


def mark_letter(error: LineError) -> str:
    """One letter for the line errors of one octet; "E" where the driver did not tell parity from framing."""
    if LineError.BREAK in error:
        return "B"
    if LineError.PARITY in error and LineError.FRAMING in error:
        return "E"
    if LineError.PARITY in error:
        return "P"
    if LineError.FRAMING in error:
        return "F"
    return "O" if LineError.OVERRUN in error else "?"


def flags(event: Event) -> str:
    """Letters for what is odd about a row; the help page explains them."""
    letters = dict.fromkeys(mark_letter(mark.error) for mark in event.marks)
    if not isinstance(event, Frame):
        return "~" + "".join(letters)
    found = FOUND_LETTERS.get(event.found, "")
    return ("" if event.ok else "!") + "".join(letters) + ("n" if event.skipped else "") + found


class FrameList(StoreList):
    """Rows of the store by number."""

    COLUMNS = COLUMNS
    NAME = "frames"

    def row_of(self, number: int) -> int | None:
        """The row itself."""
        return number

    def linked(self, number: int) -> tuple[int, ...]:
        """Request or response."""
        row = self.store.by_no(number)
        partner = None if row is None else self.store.partner(row)
        return () if partner is None else (partner,)

    def state(self, number: int) -> object:
        """Its verdict may come later; marks come and go; the partner of the cursor is marked."""
        row = self.store.by_no(number)
        transaction = None if row is None else self.store.transaction(row)
        return transaction, self.viewing.marks.get(number), self.viewing.time_mode, self.viewing.foreign

    def edge(self, number: int) -> Cell:
        """Cursor or partner, and the user's mark."""
        here = ">" if number == self.cursor else "=" if number in self.linked(self.cursor) else " "
        mark = "*" if number in self.viewing.marks else " "
        return Cell(here + mark, "linked" if here == "=" else "mark" if mark == "*" else "")

    def cells(self, number: int, line: int) -> dict[str, Cell]:
        """What is known of one row."""
        row = self.store.by_no(number)
        if row is None:
            return {"no": Cell(str(number), "dim"), "text": Cell("no longer in memory", "dim")}
        event = row.event
        transaction = self.store.transaction(row)
        style = "doubt" if not isinstance(event, Frame) else "" if event.ok else "bad"
        if self.viewing.colours and not style:
            style = self.viewing.colour_of(row, transaction)
        source, destination = self._addresses(row)
        text = sanitized(self._text(row))
        said = self.viewing.marks.get(number, "")
        text = f"[{sanitized(said)}] {text}" if said else text
        answers = transaction is not None and (transaction.response in (number, None))
        return {
            "no": Cell(str(number), "dim"),
            "time": Cell(self._time(row, line)),
            "src": Cell("" if source is None else str(source)),
            "dst": Cell("" if destination is None else f"{destination} "),
            "text": Cell(text, style),
            "verdict": self._verdict(transaction, text),
            "latency": latency_cell(
                transaction.latency if transaction is not None and answers else None, self.store.session.adapter.latency
            ),
            "len": Cell(str(len(event.octets)), "dim"),
            "flags": Cell(flags(event), style or "dim"),
        }

    def _text(self, row: Row) -> str:
        """What it says, or what frames of a second protocol in it say, with its name."""
        foreign = self.viewing.foreign
        found = () if foreign is None else foreign.of(row.no)
        if foreign is None or not found:
            return self.brief_text(row, self.width_of("text") + 1 + self.width_of("verdict"))
        return f"{foreign.second.name}: " + "; ".join(describe(foreign.second, one, None) for one in found)

    def _verdict(self, transaction: Transaction | None, text: str) -> Cell:
        """The verdict; the usual one gives way to a text that has no room, for what a frame says matters more."""
        usual = transaction is not None and transaction.verdict in USUAL and transaction.attempt == 1
        if usual and cell_len(text) > self.width_of("text"):
            return Cell("")
        return verdict_cell(transaction, self.width_of("verdict"))

    def _time(self, row: Row, line: int) -> str:
        before = self.store.by_no(self.index[line - 1]) if line else None
        return self.time_text(row.event.start, None if before is None else before.event.start)

    @staticmethod
    def _addresses(row: Row) -> tuple[int | None, int | None]:
        place = row.placement or row.header
        return (None, None) if place is None else (place.source, place.destination)

    def empty_text(self) -> str:
        """Why nothing is shown."""
        if self.index.pending:
            return "searching …"
        if self.viewing.filter and len(self.store):
            return "no frame passes the filter"
        return "no frames yet" if analyzer(self).status.live else "no frames in this file"
