"""The rows and transactions of one bus that a face shows, held in memory, bounded; what they add up to is its model's.

Written by one thread; readers call the methods from the same thread (the terminal UI pulls a snapshot ten times a
second). Nothing here touches the capture: pausing a view never does.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections import Counter

from dissectors.frame import Frame, LineError
from dissectors.histogram import Histogram
from dissectors.manifest import Dissector
from dissectors.profiles import Devices
from dissectors.tracker import Transaction, Verdict
from sniff.analysis.load import Load
from sniff.analysis.nodes import NodeTable
from sniff.analysis.points import PointTable, words
from sniff.analysis.wording import describe, is_error
from sniff.bus.model import BusModel
from sniff.engine.engine import Output, Row
from sniff.engine.session import LineEvent, Session

KEPT_ROWS = 1_000_000
"""Rows kept for viewing; older ones are dropped from the view (never from a recording), with a count."""

CLOSING_DISORDER = 256
"""How far a transaction may close out of the order of opening and still be found by its id."""


class Store:
    """Rows in order of the wire; `rows[i].no == first_no + i` always holds."""

    def __init__(
        self,
        session: Session,
        dissector: Dissector,
        keep: int = KEPT_ROWS,
        devices: Devices | None = None,
        model: BusModel | None = None,
    ) -> None:
        """`model`: of this bus, which somebody else feeds; without one it has its own."""
        self.keep = keep
        self._feeds_model = model is None
        self.model = BusModel(session, dissector, devices) if model is None else model
        self.rows: list[Row] = []
        self.transactions: dict[int, Transaction] = {}
        self.closed: list[int] = []  # transaction ids in the order of closing
        self.errors: list[int] = []  # numbers of rows that are damaged frames or noise, or that have a bad verdict
        self.line_events: list[LineEvent] = []
        self.error_total = 0  # like `errors`, with those that were dropped
        self.marks: Counter[LineError] = Counter()  # octets by the line errors reported on them
        self.gaps = Histogram()  # silence between one row and the next, ns
        self.dropped_rows = 0
        self.dropped_transactions = 0
        self.version = 0  # changes whenever anything changed

    # -- writing -----------------------------------------------------------------------------------------------

    def settle(self, session: Session, dissector: Dissector) -> None:
        """Go on with settings that were found; the rows so far are what their search heard."""
        if self._feeds_model:
            self.model.settle(session, dissector)
        self.version += 1

    def add(self, output: Output) -> None:
        """Take what the engine gave."""
        if not output:
            return
        if self._feeds_model:
            self.model.add(output)
        self.version += 1
        for row in output.rows:
            if row.searched is not None:
                self.rows.append(row)
                continue
            if self.rows and self.rows[-1].searched is None:
                self.gaps.add(row.event.start - self.rows[-1].event.end)
            self.rows.append(row)
            for mark in row.event.marks:
                self.marks[mark.error] += 1
            if is_error(row):
                self.errors.append(row.no)
                self.error_total += 1
        for transaction in output.transactions:
            self._close(transaction)
        if len(self.rows) > self.keep * 1.1:
            self._drop(len(self.rows) - self.keep)

    def add_line_event(self, event: LineEvent) -> None:
        """Take something that happened to the line."""
        if self._feeds_model:
            self.model.add_line_event(event)
        self.version += 1
        self.line_events.append(event)

    def _close(self, transaction: Transaction) -> None:
        self.transactions[transaction.id] = transaction
        self.closed.append(transaction.id)
        if transaction.verdict in BAD_VERDICTS:
            no = transaction.request if transaction.request is not None else transaction.response
            position = bisect_left(self.errors, no or 0)
            if no is not None and self.errors[position : position + 1] != [no]:
                self.errors.insert(position, no)
                self.error_total += 1

    def _drop(self, count: int) -> None:
        del self.rows[:count]
        self.dropped_rows += count
        first = self.first_no
        del self.errors[: bisect_left(self.errors, first)]
        gone = 0
        for key in self.closed:
            transaction = self.transactions.get(key)
            if transaction is not None and max(transaction.request or 0, transaction.response or 0) >= first:
                break
            self.transactions.pop(key, None)
            gone += 1
        del self.closed[:gone]
        self.dropped_transactions += gone

    # -- reading -----------------------------------------------------------------------------------------------

    @property
    def session(self) -> Session:
        """Of the bus."""
        return self.model.session

    @property
    def dissector(self) -> Dissector:
        """Its protocol."""
        return self.model.dissector

    @property
    def devices(self) -> Devices:
        """Profiles by station."""
        return self.model.devices

    @property
    def load(self) -> Load:
        """How busy it is."""
        return self.model.summary.load

    @property
    def nodes(self) -> NodeTable:
        """Who is on it."""
        return self.model.summary.nodes

    @property
    def points(self) -> PointTable:
        """The latest values."""
        return self.model.points

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def first_no(self) -> int:
        """Number of the oldest row kept (1 when there is none)."""
        return self.rows[0].no if self.rows else 1

    @property
    def last_no(self) -> int:
        """Number of the newest row (0 when there never was one)."""
        return self.rows[-1].no if self.rows else 0

    def closed_by_no(self, no: int) -> Transaction | None:
        """The transaction that closed as number `no` (from 1, without holes), None when dropped or not yet."""
        index = no - 1 - self.dropped_transactions
        return self.transactions.get(self.closed[index]) if 0 <= index < len(self.closed) else None

    def closed_number(self, transaction: int) -> int | None:
        """The number under which a transaction closed, by its id; None when dropped or open.

        Transactions close nearly in the order of opening, so it is looked for near the place where that would put it.
        """
        near = bisect_left(self.closed, transaction)
        for index in range(max(0, near - CLOSING_DISORDER), min(len(self.closed), near + CLOSING_DISORDER)):
            if self.closed[index] == transaction:
                return index + 1 + self.dropped_transactions
        return None

    @property
    def last_closed(self) -> int:
        """How many transactions have closed, with those dropped."""
        return self.dropped_transactions + len(self.closed)

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
        """One line that says what a row is, and what that means to its device."""
        text = describe(self.dissector, row)
        if not self.devices:
            return text
        asked = self._request_of(row)
        said = words(self.dissector, self.devices, row, asked)
        return f"{text} — {said}" if said else text

    def _request_of(self, row: Row) -> Frame | None:
        transaction = self.transaction(row)
        asked = self.by_no(transaction.request) if transaction is not None and transaction.request else None
        return asked.event if asked is not None and isinstance(asked.event, Frame) else None

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
