"""The rows and transactions of one bus that a face shows, held in memory as tables, bounded; what they add up to.

Written by one thread; readers call the methods from the same thread (the terminal UI pulls a snapshot ten times a
second). Nothing here touches the capture: pausing a view never does.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

import numpy as np

from dissectors.columns import Times
from dissectors.findings import Finding
from dissectors.frame import LineError
from dissectors.histogram import Histogram
from dissectors.line import NS_PER_S
from dissectors.manifest import Dissector
from dissectors.profiles import Devices
from sniff.analysis.load import Load
from sniff.analysis.nodes import NodeTable
from sniff.analysis.points import PointTable
from sniff.analysis.polls import Polls
from sniff.analysis.site_ear import SiteEar
from sniff.analysis.summary import Summary
from sniff.bus.ascending import Ascending
from sniff.bus.kept_rows import KeptRows
from sniff.bus.model import BusModel
from sniff.bus.prepared import Prepared, prepare
from sniff.bus.trouble import rows_in_trouble
from sniff.bus.unjudged import Unjudged
from sniff.engine.engine import Output
from sniff.engine.session import LineEvent, Session
from sniff.engine.table import Table

KEPT_ROWS = 1_000_000
"""Rows of a live bus kept for viewing; older ones are dropped from the view (never from a recording), with a count."""


class Store(KeptRows):
    """`errors`: numbers of rows that are damaged frames or noise, or that have a bad
    verdict; `error_total`: with those that were dropped; `failed`: how many of them began in each second. `marks`:
    octets by the line errors reported on them. `gaps`: silence between one row and the next, ns. `version` changes
    whenever anything changed, `heard` whenever more was heard. `ear`: what is kept to hold the bus against others.
    """

    def __init__(
        self,
        session: Session,
        dissector: Dissector,
        keep: int = KEPT_ROWS,
        devices: Devices | None = None,
        model: BusModel | None = None,
        judge_later: bool = False,
        ear: SiteEar | None = None,
    ) -> None:
        """`model`: of this bus, which somebody else feeds, and the `ear` with it; without one it has its own.
        `judge_later`: which takes rows only when `judge` is called; counts and load are up to date all the same."""
        super().__init__(BusModel(session, dissector, devices) if model is None else model)
        self.keep = keep
        self.ear = ear
        self._feeds_model = model is None
        self.errors = Ascending()
        self.failed: Counter[int] = Counter()
        self.line_events: list[LineEvent] = []
        self.error_total = 0
        self.marks: Counter[LineError] = Counter()
        self.gaps = Histogram()
        self.dropped_rows = 0
        self.version = 0
        self.heard = 0
        self._last_end: int | None = None  # of the newest row that was heard with the right settings; else None
        self._later = Unjudged() if judge_later else None
        self._summary = Summary(session.line) if judge_later else None

    # -- writing -----------------------------------------------------------------------------------------------

    def settle(self, session: Session, dissector: Dissector) -> None:
        """Go on with settings that were found; the rows so far are what their search heard."""
        if self._feeds_model:
            self.model.settle(session, dissector)
        self.version += 1
        self.heard += 1

    def add(self, output: Output) -> None:
        """Take what the engine gave."""
        self.add_outputs((output,))

    def add_outputs(self, outputs: Iterable[Output]) -> None:
        """Take what the engine gave, in order."""
        given = [output for output in outputs if output]
        if self._feeds_model and self._later is None:
            for output in given:
                self.model.add(output)
                if self.ear is not None:
                    self.ear.add(output)
        if given:
            self._take(Table.of_outputs(self.dissector.name, self.last_no + 1, given))

    def add_table(self, table: Table) -> None:
        """Take rows and transactions that follow."""
        if not table:
            return
        if self._feeds_model and self._later is None:
            self._judge(table)
        self._take(table)

    def add_prepared(self, prepared: Prepared) -> None:
        """Take a table that was looked at elsewhere."""
        if self._feeds_model and self._later is None:
            self._judge(prepared.table)
        self._take(prepared.table, prepared)

    def add_line_event(self, event: LineEvent) -> None:
        """Take something that happened to the line."""
        if self._later is not None:
            self._later.events.append((self.last_no, self.last_closed, event))
        elif self._feeds_model:
            self._judge_event(event)
        if self._summary is not None:
            self._summary.add_line_event(event)
        self.version += 1
        self.heard += 1
        self.line_events.append(event)

    def add_mark(self, event: LineEvent) -> None:
        """Take a mark made while one looks: it says nothing of the line, and no rule asks for it."""
        self.version += 1
        self.line_events.append(event)

    def _take(self, table: Table, prepared: Prepared | None = None) -> None:
        prepared = prepare(table) if prepared is None else prepared
        self.version += 1
        self.heard += 1
        if self._summary is not None:
            self._summary.add_table(table)
        self.kept.append(prepared.packed or table)
        self.marks += prepared.marks
        if prepared.begin is not None and self._last_end is not None:
            self.gaps.add(prepared.begin - self._last_end)
        if prepared.gaps.count:
            self.gaps = self.gaps.merge(prepared.gaps)
        if len(table):
            self._last_end = prepared.end
        first = self.last_no - len(table) + 1
        self._fail(first + prepared.bad, prepared.bad_begins)
        self._fail(*rows_in_trouble(table.transactions))
        if self._later is not None and len(self) > self.keep:  # what is soon let go is judged first
            self.judge(2 * len(table))
        if len(self) > self.keep * 1.1:
            self._drop(len(self) - self.keep)

    def _fail(self, numbers: Times, begins: Times) -> None:
        """Rows of these numbers, which began then, are trouble."""
        if not len(numbers):
            return
        if int(numbers.min()) < self.first_no:  # of rows that are gone: nobody knows whether they were trouble before
            kept = numbers >= self.first_no
            self.error_total += int(np.count_nonzero(~kept))
            numbers, begins = numbers[kept], begins[kept]
        new = self.errors.add(numbers)
        self.error_total += len(new)
        seconds, counts = np.unique(begins[new] // NS_PER_S, return_counts=True)
        for second, count in zip(seconds.tolist(), counts.tolist(), strict=True):
            self.failed[second] += count

    def _drop(self, count: int) -> None:
        before = self.first_no
        while self._later is not None and self._later.row < before + count - 1 and self.judge(count):
            pass
        self.kept.drop(count)
        self.dropped_rows += self.first_no - before
        self.errors.drop_below(self.first_no)
        row = self.by_no(self.first_no)
        if row is not None:
            for second in [second for second in self.failed if second < row.event.start // NS_PER_S]:
                del self.failed[second]

    # -- judging later -----------------------------------------------------------------------------------------

    @property
    def judged(self) -> int:
        """Number of the last row that the model has taken."""
        return self.last_no if self._later is None else self._later.row

    @property
    def all_judged(self) -> bool:
        """Whether the model has taken everything that was read."""
        later = self._later
        return later is None or (later.row >= self.last_no and later.closed >= self.last_closed and not later.events)

    def judge(self, rows: int) -> bool:
        """Let the model take up to so many rows; whether more are left."""
        later = self._later
        if later is None or self.all_judged:
            return False
        self.version += 1
        table = None
        if not later.events or (later.row, later.closed) < later.events[0][:2]:
            table = later.next(self.kept, rows)
        if table:
            self._judge(table)
        elif later.events:
            self._judge_event(later.events.popleft()[2])
        return not self.all_judged

    def _judge(self, table: Table) -> None:
        self.model.add_table(table)
        if self.ear is not None:
            self.ear.add_table(table)

    def _judge_event(self, event: LineEvent) -> None:
        self.model.add_line_event(event)
        if self.ear is not None:
            self.ear.add_line_event(event)

    def findings(self) -> tuple[Finding, ...]:
        """What was found so far; nothing as long as there was nothing to judge."""
        return () if self._later is not None and not (self._later.row or self.all_judged) else self.model.findings()

    # -- what they add up to ----------------------------------------------------------------------------------

    @property
    def summary(self) -> Summary:
        """What all that came adds up to, judged or not."""
        return self.model.summary if self._summary is None else self._summary

    @property
    def load(self) -> Load:
        """How busy it is."""
        return self.summary.load

    @property
    def nodes(self) -> NodeTable:
        """Who is on it."""
        return self.summary.nodes

    @property
    def points(self) -> PointTable:
        """The latest values."""
        return self.model.points

    @property
    def polls(self) -> Polls:
        """The master's programme."""
        return self.model.polls

    def next_error(self, no: int) -> int | None:
        """Number of the first error row after `no`, None when there is none."""
        return self.errors.after(no)

    def previous_error(self, no: int) -> int | None:
        """Number of the last error row before `no`, None when there is none."""
        return self.errors.before(no)
