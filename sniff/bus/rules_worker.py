"""The rules over the rows of a store, caught up in small pieces, so that no key waits for them."""

from __future__ import annotations

import time

from dissectors.findings import Finding
from sniff.analysis.judging import Judging
from sniff.bus.model import Store
from sniff.engine.engine import Output

SLICE_SECONDS = 0.012
SLICE_ROWS = 200


class Judged:
    """Runs over rows and closed transactions once, in the order of the wire; rows that the store dropped are missed."""

    def __init__(self, store: Store) -> None:
        self.store = store
        self._session = store.session
        self.judging = Judging(store.session, store.dissector, store.devices)
        self._row = 0  # number of the last row taken
        self._closed = 0  # number of the last closed transaction taken
        self._events = 0

    def left(self, last: int) -> int:
        """How many rows up to number `last` are still to be taken."""
        return max(0, last - max(self._row, self.store.first_no - 1))

    def work(self, last: int) -> bool:
        """Take rows up to number `last` for some milliseconds; whether more are left."""
        end = time.perf_counter() + SLICE_SECONDS
        while self.left(last) and time.perf_counter() < end:
            self.step(SLICE_ROWS, last)
        return self.left(last) > 0

    def step(self, count: int, last: int) -> None:
        """Take some rows, at most up to number `last`, and what closed with them."""
        store = self.store
        if store.session is not self._session:  # its settings were found: nothing was judged before
            self._session = store.session
            self.judging = Judging(store.session, store.dissector, store.devices)
            self._events = 0
        judging = self.judging
        self._row = max(self._row, store.first_no - 1)
        end = min(last, self._row + count)
        while self._row < end:
            self._row += 1
            row = store.by_no(self._row)
            if row is None:
                continue
            self._take_events(row.event.start)
            judging.add(Output((row,)))
            self._take_closed(self._row)
        if self._row >= store.last_no:
            self._take_events(None)
            self._take_closed(None)

    def findings(self) -> tuple[Finding, ...]:
        """What was found in the rows taken so far."""
        return self.judging.findings()

    def _take_closed(self, row: int | None) -> None:
        """Transactions in the order of closing, as far as their rows were taken."""
        store = self.store
        self._closed = max(self._closed, store.dropped_transactions)
        while self._closed < store.last_closed:
            transaction = store.closed_by_no(self._closed + 1)
            if transaction is not None:
                newest = max(transaction.request or 0, transaction.response or 0)
                if row is not None and newest > row:
                    return
                self.judging.add(Output((), (transaction,)))
            self._closed += 1

    def _take_events(self, until: int | None) -> None:
        events = self.store.line_events
        while self._events < len(events) and (until is None or events[self._events].time <= until):
            self.judging.add_line_event(events[self._events])
            self._events += 1
