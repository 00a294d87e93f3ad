"""The engine for many rows at once: blocks of reads in, tables out; the rows that `engine.py` gives one by one. Pure.

Where a protocol has no kernel, or where what is heard depends on settings that change, everything goes through the
reference engine and only comes out as a table.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from dissectors import registry
from dissectors.columns import Times
from dissectors.frame import Event, Frame
from dissectors.line import Timing
from dissectors.manifest import Dissector
from dissectors.tracker import Transaction
from sniff.engine.blocks import Block
from sniff.engine.engine import Engine, Output, Row, without_times
from sniff.engine.event_texts import settings_change
from sniff.engine.follow_settings import SessionEngine
from sniff.engine.framing import BulkFraming, Clean, Stretch
from sniff.engine.gathering import gathered
from sniff.engine.late_columns import LateColumns
from sniff.engine.placing import Placing, RowsAhead
from sniff.engine.read_source import ReadSource, stored_tables
from sniff.engine.session import LineEvent, Session
from sniff.engine.table import Table, joined
from sniff.engine.whole_capture import whole

FAR = 1 << 61
"""ns; times beyond it are not reckoned with in columns."""


MANY = 64
"""Rows of the reference from which on a table of them costs its observers less than one after the other."""


def tables(blocks: Iterable[Block | LineEvent], session: Session) -> Iterator[Table | LineEvent]:
    """What a capture holds, as tables, put together as `whole` does. Raises what `blocks` raises, and
    registry.UnknownProtocol."""
    yield from whole(BulkEngine(session), blocks)


def tables_of(capture: ReadSource, session: Session) -> Iterator[Table | LineEvent]:
    """The tables of a capture: those that it holds, where they are what would be found, else found anew. Raises as
    `tables` does."""
    held = stored_tables(capture, session)
    yield from tables(capture.blocks(), session) if held is None else held


class BulkEngine:
    """Blocks and line events of one capture in, tables out."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._leg = _Leg(registry.get(session.protocol), session.timing, 1, 0)
        self._reference = SessionEngine(session) if session.unknown else None
        self._latest = -FAR  # time of the newest read
        self._is_aside = False  # the reference reads times that run backwards, until they do so no more

    @property
    def session(self) -> Session:
        """The bus; after a search, with what was found."""
        return self._session if self._reference is None else self._reference.session

    def take_some(self, block: Block) -> list[Output | Table]:
        """Take reads that follow; few rows, which cost dearly as a table, one by one."""
        if self._reference is None and self._is_forward(block):
            self._latest = block.latest
            return self._leg.take_some(block)
        table = self.take(block)
        return [table] if table else []

    def take(self, item: Block | LineEvent) -> Table:
        """Take what follows."""
        if self._reference is None and isinstance(item, Block) and not self._is_forward(item):
            self._step_aside()
        if isinstance(item, Block):
            self._latest = max(self._latest, int(item.reads.times.max()))
        reference = self._reference
        if reference is not None:
            items = item.chunks() if isinstance(item, Block) else (item,)
            was_searching = reference.searching
            table = _of_outputs(reference, [reference.take(one) for one in items])
            if self._is_aside:
                self._come_back(reference, item)
            elif was_searching and not reference.searching:
                self._go_on(reference)
            return table
        return self._leg.take(item) if isinstance(item, Block) else self._happen(item)

    def advance(self, now: int) -> list[Output | Table]:
        """Say that no read returned up to `now` (ns)."""
        if self._reference is None:
            return self._leg.advance(now)
        output = self._reference.advance(now)
        return [output] if output else []

    def deadline(self) -> int | None:
        """When to call `advance` next (ns), or None."""
        return self._leg.deadline() if self._reference is None else self._reference.deadline()

    @property
    def searching(self) -> bool:
        """Whether settings are searched for."""
        return self._reference is not None and self._reference.searching

    @property
    def dissector(self) -> Dissector:
        """The protocol; a stand-in as long as nobody knows it."""
        return self._leg.dissector if self._reference is None else self._reference.dissector

    def close(self) -> Table:
        """End of the capture."""
        reference = self._reference
        return self._leg.close() if reference is None else _of_outputs(reference, [reference.close()])

    def _happen(self, event: LineEvent) -> Table:
        if event.kind.is_hole:  # what was asked before it and what is answered after it belong to nothing
            return self._restart()
        change, session = settings_change(event), self._session
        nothing = Table.of(session.protocol, self._leg.next, [], [])
        if change is None:
            return nothing
        same = change.line in (None, session.line) and change.protocol in (None, session.protocol)
        if not change.searching and (same or session.given):
            return nothing
        table, leg = self._restart(), self._leg
        self._reference = SessionEngine(session, first=leg.next, before_tx=leg.last_tx)  # rare: from here on one by one
        self._reference.take(event)
        return table

    def _is_forward(self, block: Block) -> bool:
        """Whether times do not run backwards, nor to the ends of what can be said in 64 bits: only so do reads, as
        columns, tell what they tell one by one."""
        times = block.reads.times
        return self._latest <= int(times[0]) and block.latest <= FAR and bool((times[1:] >= times[:-1]).all())

    def _step_aside(self) -> None:
        """Let the reference go on with all that is known."""
        self._reference = SessionEngine(self._session, first=self._leg.next, before_tx=self._leg.last_tx)
        self._reference.engine = self._leg.one_by_one()
        self._is_aside = True

    def _come_back(self, reference: SessionEngine, item: Block | LineEvent) -> None:
        """Go on in columns where all reads that are still known came in order and after all before them."""
        if isinstance(item, Block):
            if item.latest == self._latest:
                self._go_on(reference)
                self._is_aside = self._reference is not None
        elif item.kind.is_hole:
            self._latest = -FAR  # what was before it is nothing to who begins anew
        elif settings_change(item) is not None:  # rare: from here on one by one
            self._is_aside = False

    def _go_on(self, reference: SessionEngine) -> None:
        """From here on many rows at once again, where all that is known can be handed over."""
        leg = _Leg.after(reference.engine)
        if leg is not None and leg.timing == reference.session.timing:
            self._session, self._leg, self._reference = reference.session, leg, None

    def _restart(self) -> Table:
        table, before = self._leg.close(), self._leg
        self._latest = -FAR
        self._leg = _Leg(before.dissector, before.timing, before.next, before.last_tx)
        return table


def _of_outputs(engine: SessionEngine, outputs: list[Output]) -> Table:
    first = next((output.rows[0].no for output in outputs if output.rows), engine.engine.next)
    return Table.of_outputs(engine.dissector.name, first, outputs)


class _Leg:
    """A stretch of a capture with one protocol and one line setting, without holes."""

    def __init__(self, dissector: Dissector, timing: Timing, first: int, before_tx: int) -> None:
        self.dissector = dissector
        self.timing = timing
        self.next = first
        self.last_tx = before_tx
        self._before_tx = before_tx
        self._framing = BulkFraming(dissector, timing)
        self._late = LateColumns(timing)
        self._tracker = dissector.tracker(timing)

    @classmethod
    def after(cls, engine: Engine) -> _Leg | None:
        """Go on where another engine has taken reads one by one; None where their times ran backwards."""
        times = [read.time for read in engine.late.kept]
        if times != sorted(times) or any(abs(time) > FAR for time in times):
            return None
        leg = cls(engine.dissector, engine.timing, engine.next, engine.last_tx)
        leg._before_tx = engine.before_tx
        before = times[-1] if times else None
        leg._framing = BulkFraming(engine.dissector, engine.timing, engine.framer, before, engine.held)
        leg._late = LateColumns.after(engine.late, engine.timing)
        leg._tracker = engine.tracker
        return leg

    def one_by_one(self) -> Engine:
        """The engine that goes on from here with reads one by one."""
        engine = Engine(self.dissector, self.timing, self.next, self._before_tx)
        engine.last_tx = self.last_tx
        engine.framer, engine.held = self._framing.framer, self._framing.held
        engine.late, engine.tracker = self._late.one_by_one(self.timing), self._tracker
        return engine

    def take_some(self, block: Block) -> list[Output | Table]:
        """Take reads; few rows that the reference has read come one by one."""
        self._late.see(block.reads)
        stretches = self._framing.take(block)
        if not any(isinstance(one, Clean) for one in stretches):
            events = [event for one in stretches if not isinstance(one, Clean) for event in one]
            return self._outputs(events) if len(events) < MANY else [self._events(events)]
        return [self._placed_at_once(stretches)]

    def take(self, block: Block) -> Table:
        """Take reads."""
        self._late.see(block.reads)
        stretches = self._framing.take(block)
        if any(isinstance(one, Clean) for one in stretches):
            return self._placed_at_once(stretches)
        return self._events([event for one in stretches if not isinstance(one, Clean) for event in one])

    def advance(self, now: int) -> list[Output | Table]:
        """Say that no read returned up to `now`."""
        outputs = self._outputs(self._framing.advance(now))
        if self._framing.deadline() is None:  # else octets still held may be the answer that the tracker waits for
            closed = self._numbered(self._tracker.advance(now))
            outputs += [Output((), tuple(closed))] if closed else []
        return outputs

    def deadline(self) -> int | None:
        """When to call `advance` next, or None."""
        return self._framing.deadline()

    def close(self) -> Table:
        """Give everything that is held."""
        made = [self._events(one) for one in self._framing.close() if not isinstance(one, Clean)]
        closed = self._numbered(self._tracker.close())
        return joined(self.dissector.name, self.next, [*made, Table.of(self.dissector.name, self.next, [], closed)])

    def _placed_at_once(self, stretches: list[Stretch]) -> Table:
        """Rows of a kernel and between them: paired by columns as far as that is certain, by the tracker elsewhere."""
        whole = gathered(self.dissector, self.next, stretches, self._late)
        table, given, make = whole.table, whole.given, self.dissector.pairing
        if make is None:
            return self._placed(list(table.rows()))
        pairing = make(self._tracker, whole.to_pair, table.octets, self.timing, table.slack)
        placing, rows, place = Placing(table), RowsAhead(table), 0
        while place < len(table):
            row = given.get(place)
            run = pairing.run(place, table.first + place) if row is None or place not in table.odd else None
            if run is None:
                placing.add(place, *self._track(row or rows.at(place)))
                place += 1
            else:
                placing.add_run(run, self._before_tx)
                place = run.end
        made = placing.table() if self.timing.has_times else placing.table().without_times()
        self.next += len(made)
        self.last_tx = max(self.last_tx, int(made.placed.tx.max(initial=0)))
        return made

    def _events(self, events: list[Event]) -> Table:
        """Rows of the reference framer."""
        return self._placed(self._rows(events))

    def _rows(self, events: list[Event]) -> list[Row]:
        rows = []
        ends: Times = np.array([event.end for event in events if isinstance(event, Frame)], np.int64)
        slacks = iter(self._late.slack(ends).tolist())
        for no, event in enumerate(events, self.next):
            if isinstance(event, Frame):
                slack = next(slacks)
                event = replace(event, slack=slack) if slack > event.slack else event
                rows.append(Row(no, event, self.dissector.peek(event)))
            else:
                rows.append(Row(no, event))
        return rows

    def _placed(self, rows: list[Row]) -> Table:
        """The same rows where the tracker places them, with what they close."""
        placed: list[Row] = []
        closed: list[Transaction] = []
        closed_by: list[int] = []
        for place, row in enumerate(rows):
            made, ended = self._track(row)
            placed.append(made)
            closed += ended
            closed_by += [place] * len(ended)
        first, self.next = self.next, self.next + len(rows)
        return Table.of(self.dissector.name, first, placed, closed, closed_by)

    def _outputs(self, events: list[Event]) -> list[Output | Table]:
        """The same row by row."""
        outputs: list[Output | Table] = []
        for row in self._rows(events) if events else ():
            made, closed = self._track(row)
            outputs.append(Output((made,), tuple(closed)))
        self.next += len(outputs)
        return outputs

    def _track(self, row: Row) -> tuple[Row, list[Transaction]]:
        """The row with its place, and what it closed."""
        tracked = self._tracker.track(row.no, row.event, row.header)
        event, placement = row.event, tracked.placement
        if tracked.assembly is not None and isinstance(event, Frame):
            event = replace(event, assembly=tracked.assembly)
        if placement is not None:
            if self._before_tx:
                placement = replace(placement, tx=placement.tx + self._before_tx)
            self.last_tx = max(self.last_tx, placement.tx)
        return Row(row.no, event, row.header, placement), self._numbered(tracked.closed)

    def _numbered(self, closed: tuple[Transaction, ...]) -> list[Transaction]:
        """Transactions with their numbers on the whole bus."""
        before = self._before_tx
        if not self.timing.has_times:
            closed = without_times(closed)
        if not before:
            return list(closed)
        return [replace(one, id=one.id + before, of=None if one.of is None else one.of + before) for one in closed]
