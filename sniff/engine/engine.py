"""Chunk → frames → headers → transactions; the same live and offline.

Pure: no I/O, no clock. One engine is one bus. What it gives is numbered from 1 in the order of the wire.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace

from dissectors.frame import Chunk, Event, Frame, Header
from dissectors.line import LineSettings, Timing
from dissectors.manifest import Dissector
from dissectors.quick_values import quickly_made
from dissectors.tracker import Placement, Tracker, Transaction, Unpaired
from sniff.engine.late_reads import LateReads


@quickly_made
@dataclass(frozen=True, slots=True)
class Row:
    """One event of the bus with what is known of it at once.

    `header` is None exactly for noise. The verdict comes with the transaction `placement.tx`, perhaps later.
    `searched`: the settings with which the octets were heard while the right ones were searched for: they say
    nothing about the bus, `event` only carries them; None for everything else.
    """

    no: int
    event: Event
    header: Header | None = None
    placement: Placement | None = None
    searched: LineSettings | None = None


@quickly_made
@dataclass(frozen=True, slots=True)
class Output:
    """What one step of the engine gave: new rows, then the transactions that closed.

    `closed_by`: the place among `rows` of the row that closed each of the first transactions; the others closed after
    the last row.
    """

    rows: tuple[Row, ...] = ()
    transactions: tuple[Transaction, ...] = ()
    closed_by: tuple[int, ...] = field(default=(), compare=False)

    def __bool__(self) -> bool:
        return bool(self.rows or self.transactions)

    def in_order(self) -> Iterator[tuple[Row | None, tuple[Transaction, ...]]]:
        """Each row with the transactions that it closed; those that no row closed come last, with None."""
        at = 0
        for place, row in enumerate(self.rows):
            begin = at
            while at < len(self.closed_by) and self.closed_by[at] <= place:
                at += 1
            yield row, self.transactions[begin:at]
        if at < len(self.transactions):
            yield None, self.transactions[at:]

    def one_by_one(self) -> Iterator[Output]:
        """The same in steps of a row each: of many exchanges in one read each is over before the next one is asked."""
        for row, closed in self.in_order():
            yield Output(() if row is None else (row,), closed)


NOTHING = Output()


def together(outputs: Iterable[Output]) -> Output:
    """Outputs that follow one another, as one; `closed_by` may be -1 for what closed before any row."""
    rows: list[Row] = []
    closed: list[Transaction] = []
    closed_by: list[int] = []
    for output in outputs:
        closed_by += [len(rows) + place for place in output.closed_by]
        rows += output.rows
        closed += output.transactions
        closed_by += [len(rows) - 1] * (len(closed) - len(closed_by))
    return Output(tuple(rows), tuple(closed), tuple(closed_by))


def without_times(closed: Iterable[Transaction]) -> tuple[Transaction, ...]:
    """Transactions of a capture that does not say when anything came: how long an answer took, nobody knows."""
    return tuple(one if one.latency is None else replace(one, latency=None) for one in closed)


class Engine:
    """Runs one protocol over one bus.

    `next`: the number of the event to come, from `first` on. `last_tx`: of the transactions so far, all later than
    `before_tx`. `late`: what the times of reads say.
    """

    def __init__(
        self, dissector: Dissector, timing: Timing, first: int = 1, before_tx: int = 0, pairing: bool = True
    ) -> None:
        """`pairing`: else no row has a placement and there are no transactions."""
        self.dissector = dissector
        self.timing = timing
        self.next = first
        self.last_tx = before_tx
        self.before_tx = before_tx
        self.late = LateReads(timing)
        self.framer = dissector.framer(timing)
        self.held = 0
        self.tracker: Tracker = dissector.tracker(timing) if pairing else Unpaired()

    def feed(self, chunk: Chunk) -> Output:
        """Take one read."""
        self.late.see(chunk)
        self.held += len(chunk.octets)
        return self._track(self.framer.feed(chunk))

    def advance(self, now: int) -> Output:
        """Say that no read returned up to `now` (ns)."""
        output = self._track(self.framer.advance(now))
        if self.framer.deadline() is not None:
            return output  # octets still held may be the answer that the tracker waits for
        closed = self._renumbered(self.tracker.advance(now))
        return replace(output, transactions=output.transactions + closed) if closed else output

    def close(self) -> Output:
        """End of capture."""
        output = self._track(self.framer.close())
        return replace(output, transactions=output.transactions + self._renumbered(self.tracker.close()))

    def deadline(self) -> int | None:
        """When to call `advance` next (ns), or None."""
        return self.framer.deadline()

    def _track(self, events: Sequence[Event]) -> Output:
        if not events:
            return NOTHING
        rows: list[Row] = []
        closed: list[Transaction] = []
        closed_by: list[int] = []
        peek, track, late = self.dissector.peek, self.tracker.track, self.late
        for event in events:
            self.held -= len(event.octets)
            if isinstance(event, Frame):
                event = late.with_slack(event)
            no = self.next
            self.next += 1
            header = peek(event) if isinstance(event, Frame) else None
            tracked = track(no, event, header)
            placement = tracked.placement
            if tracked.assembly is not None and isinstance(event, Frame):
                event = replace(event, assembly=tracked.assembly)
            if placement is not None:
                if self.before_tx:
                    placement = replace(placement, tx=placement.tx + self.before_tx)
                if placement.tx > self.last_tx:
                    self.last_tx = placement.tx
            rows.append(Row(no, event, header, placement))
            if tracked.closed:
                closed += self._renumbered(tracked.closed)
                closed_by += [len(rows) - 1] * len(tracked.closed)
        return Output(tuple(rows), tuple(closed), tuple(closed_by))

    def _renumbered(self, closed: tuple[Transaction, ...]) -> tuple[Transaction, ...]:
        """Transactions with their numbers on the whole bus, where another engine has numbered before this one."""
        before = self.before_tx
        if not self.timing.has_times:
            closed = without_times(closed)
        if not before:
            return closed
        return tuple(replace(one, id=one.id + before, of=None if one.of is None else one.of + before) for one in closed)
