"""Chunk → frames → headers → transactions; the same live and offline.

Pure: no I/O, no clock. One engine is one bus. What it gives is numbered from 1 in the order of the wire.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from dissectors.frame import Chunk, Event, Frame, Header
from dissectors.line import Timing
from dissectors.registry import Dissector
from dissectors.tracker import Placement, Transaction


@dataclass(frozen=True, slots=True)
class Row:
    """One event of the bus with what is known of it at once.

    `header` is None exactly for noise. The verdict comes with the transaction `placement.tx`, perhaps later.
    """

    no: int
    event: Event
    header: Header | None = None
    placement: Placement | None = None


@dataclass(frozen=True, slots=True)
class Output:
    """What one step of the engine gave: new rows, then the transactions that closed."""

    rows: tuple[Row, ...] = ()
    transactions: tuple[Transaction, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.rows or self.transactions)


NOTHING = Output()


class Engine:
    """Runs one protocol over one bus. `first` is the number of the first event."""

    def __init__(self, dissector: Dissector, timing: Timing, first: int = 1) -> None:
        self.dissector = dissector
        self.timing = timing
        self.framer = dissector.framer(timing)
        self.tracker = dissector.tracker(timing)
        self._next = first

    def feed(self, chunk: Chunk) -> Output:
        """Take one read."""
        return self._track(self.framer.feed(chunk))

    def advance(self, now: int) -> Output:
        """Say that no read returned up to `now` (ns)."""
        output = self._track(self.framer.advance(now))
        if self.framer.deadline() is not None:
            return output  # octets still held may be the answer that the tracker waits for
        closed = self.tracker.advance(now)
        return Output(output.rows, output.transactions + closed) if closed else output

    def close(self) -> Output:
        """End of capture."""
        output = self._track(self.framer.close())
        return Output(output.rows, output.transactions + self.tracker.close())

    def deadline(self) -> int | None:
        """When to call `advance` next (ns), or None."""
        return self.framer.deadline()

    def _track(self, events: Iterable[Event]) -> Output:
        rows: list[Row] = []
        closed: list[Transaction] = []
        for event in events:
            no = self._next
            self._next += 1
            header = self.dissector.peek(event) if isinstance(event, Frame) else None
            tracked = self.tracker.track(no, event, header)
            rows.append(Row(no, event, header, tracked.placement))
            closed.extend(tracked.closed)
        if not rows:
            return NOTHING
        return Output(tuple(rows), tuple(closed))
