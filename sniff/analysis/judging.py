"""All rules over one bus: of its protocol, of the line, of device profiles. Pure; the same live and offline."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from dissectors import registry
from dissectors.findings import Finding, KnowsResponseTimes, KnowsStations, KnowsUnexecuted, Rule, WordsExceptions
from dissectors.frame import Noise, Place, Reason
from dissectors.manifest import Dissector
from dissectors.profiles import Devices
from dissectors.row_columns import JudgesColumns, in_turn
from dissectors.token_ring import RingWindow, WatchesRing
from dissectors.tracker import Transaction, Verdict
from sniff.analysis.bulk_line_findings import BulkLineFindings
from sniff.analysis.judgement import Judgement
from sniff.analysis.line_rules import LINE_RULES
from sniff.analysis.profile_rules import PROFILE_RULES
from sniff.analysis.site_rules import SITE_RULES
from sniff.engine.engine import Output, Row
from sniff.engine.event_texts import settings_change
from sniff.engine.session import LineEvent, LineEventKind, Session

if TYPE_CHECKING:
    from dissectors.columns import Masks, TransactionColumns
    from sniff.analysis.bulk_profile_findings import BulkProfileFindings
    from sniff.engine.table import Table

_DOUBTFUL = frozenset(
    (Verdict.NO_RESPONSE, Verdict.UNSOLICITED, Verdict.LATE, Verdict.DAMAGED_ANSWER, Verdict.DAMAGED_REQUEST)
)


class LineJudging:
    """The line's part of `Judging`, which needs nothing of the rest: fed the same."""

    def __init__(self, session: Session, dissector: Dissector | None = None) -> None:
        self.findings = BulkLineFindings(session, dissector)
        self._searching = False

    def add(self, output: Output) -> None:
        """Take rows and closed transactions."""
        for row, closed in output.in_order():
            if row is not None and row.searched is None:
                self.findings.see(row)
            elif row is not None:  # a request may be among it whose answer comes next
                self.findings.pass_by(row)
            for transaction in closed:
                self.findings.settle(transaction)

    def add_table(self, table: Table) -> None:
        """Take many rows: the same as one after the other."""
        if is_strange(table):
            for output in table.outputs():
                self.add(output)
        else:
            self.findings.add_table(table)

    def add_line_event(self, event: LineEvent) -> None:
        """Take something that happened to the line."""
        change = settings_change(event)
        if change is not None:
            self._searching = (self._searching or change.searching) and not change.found
        if not self._searching or event.kind is not LineEventKind.ERRORS:  # wrong settings make them
            self.findings.add_line_event(event)


class Judging:
    """Fed what the engine gives; `findings` may be asked at any time. What merges of it is its `judgement`.

    `of_line`: the line's part; None while somebody else feeds it.
    """

    def __init__(self, session: Session, dissector: Dissector, devices: Devices | None = None) -> None:
        self.judge = dissector.judge(session.timing) if dissector.judge is not None else None
        self.of_line: LineJudging | None = LineJudging(session, dissector)
        self._rules = rules_over(dissector)
        self.devices = _of_devices(session, dissector, devices) if devices else None
        if devices and isinstance(self.judge, WordsExceptions):
            family = dissector.profile_family
            self.judge.word_exceptions(lambda station, code: devices.exception(station, family, code))
        if devices and isinstance(self.judge, KnowsStations):
            family = dissector.profile_family
            self.judge.know_stations(lambda station: devices.says_numbers(station, family))
        if devices and isinstance(self.judge, KnowsResponseTimes):
            family, baud = dissector.profile_family, session.timing.line.baud
            self.judge.know_response_times(lambda station: devices.response_at(station, family, baud))
        if devices and isinstance(self.judge, KnowsUnexecuted):
            family = dissector.profile_family
            self.judge.know_unexecuted(lambda station, kind, space: devices.ignores(station, family, kind, space))
        self._hole: int | None = None  # when octets were lost, by the newest line event that says so
        self._first_after: int | None = None  # number of the first row that ends after it

    @property
    def line(self) -> BulkLineFindings:
        """What the line's part found; nobody else may be feeding it."""
        assert self.of_line is not None
        return self.of_line.findings

    def add(self, output: Output) -> None:
        """Take rows and closed transactions. What was heard with wrong settings says nothing about the bus."""
        if self.of_line is not None:
            self.of_line.add(output)
        self._add(output)

    def _add(self, output: Output) -> None:
        """All but what is the line's."""
        for row, closed in output.in_order():
            if row is not None:
                self._see(row)
            for transaction in closed:
                self._settle(transaction)

    def _see(self, row: Row) -> None:
        judge = self.judge
        if row.searched is not None:
            self._hole, self._first_after = row.event.end, None
            return
        if self._hole is not None and self._first_after is None and row.event.end >= self._hole:
            self._first_after = row.no
            if judge is not None:  # something was there that nobody heard: no silence
                gap = Noise(b"", row.event.start, row.event.start, Place.BETWEEN, Reason.NO_FRAME)
                judge.see(row.no, gap, None, None)
        if judge is not None:
            judge.see(row.no, row.event, row.header, row.placement)
        if self.devices is not None:
            self.devices.see(row.no, row.event, row.header, row.placement)

    def _settle(self, transaction: Transaction) -> None:
        if self._is_torn(transaction):
            return
        if self.judge is not None:
            self.judge.settle(transaction)
        if self.devices is not None:
            self.devices.settle(transaction)

    def add_table(self, table: Table) -> None:
        """Take many rows: the same as one after the other."""
        if self.of_line is not None:
            self.of_line.add_table(table)
        if is_strange(table):
            for output in table.outputs():
                self._add(output)
            return
        if self._hole is not None and self._first_after is None:
            self._across_hole(table, self._hole)
        else:
            self._take(table)

    def _across_hole(self, table: Table, hole: int) -> None:
        """Take rows among which may be the first that ends after a hole."""
        after = table.frames.end >= hole
        place = int(after.argmax()) if after.any() else len(table)
        if place or not len(table):
            self._take(table.part(0, place))
        if place < len(table):
            for output in table.part(place, place + 1).outputs():
                self._add(output)
        if place + 1 < len(table):
            self._take(table.part(place + 1, len(table)))

    def _take(self, table: Table) -> None:
        """Take rows none of which is the first after a hole."""
        judge, devices = self.judge, self.devices
        if self._hole is not None:
            torn = self._are_torn(table.transactions, self._hole)
            table = table.without(torn) if torn.any() else table
        if isinstance(judge, JudgesColumns):
            judge.take(table)
        elif judge is not None:
            in_turn(judge, table)
        if devices is not None:
            devices.take(table)

    def add_line_event(self, event: LineEvent) -> None:
        """Take something that happened to the line."""
        if self.of_line is not None:
            self.of_line.add_line_event(event)
        if event.kind.is_hole:
            self._hole, self._first_after = event.time, None

    def ring(self) -> Any:
        """The token ring so far, a value of the protocol's own; None where no token is passed."""
        return self.judge.ring() if isinstance(self.judge, WatchesRing) else None

    def ring_window(self) -> RingWindow | None:
        """What is new in it since this was called the last time; the first time is not told of. None where no token is
        passed."""
        return self.judge.window() if isinstance(self.judge, WatchesRing) else None

    def _is_torn(self, transaction: Transaction) -> bool:
        """Whether octets were lost inside it, so that what is missing says nothing about the bus."""
        if self._hole is None or transaction.verdict not in _DOUBTFUL:
            return False
        if transaction.start <= self._hole:
            return True
        numbers = [no for no in (transaction.request, transaction.response) if no is not None]
        return self._first_after is None or min(numbers, default=0) <= self._first_after + 1

    def _are_torn(self, closed: TransactionColumns, hole: int) -> Masks:
        """The same for many."""
        import numpy as np

        from dissectors.columns import NONE, VERDICTS

        doubtful: Masks = np.isin(closed.verdict, [VERDICTS.index(verdict) for verdict in _DOUBTFUL])
        if self._first_after is None:
            return doubtful
        both = (closed.request != NONE) & (closed.response != NONE)
        least = np.where(both, np.minimum(closed.request, closed.response), np.maximum(closed.request, closed.response))
        torn: Masks = doubtful & ((closed.start <= hole) | (least <= self._first_after + 1))
        return torn

    def findings(self) -> tuple[Finding, ...]:
        """All findings so far, the gravest first. Where hardly anything is a frame, the line speaks alone."""
        return self.judgement().findings(self._rules)

    def judgement(self) -> Judgement:
        """What was found so far, as a value that merges with that of the part that follows."""
        judged = self.line.judgement()
        made = (*(self.judge.findings() if self.judge is not None else ()),)
        made += self.devices.findings() if self.devices is not None else ()
        return replace(judged, bus=made)


def _of_devices(session: Session, dissector: Dissector, devices: Devices) -> BulkProfileFindings:
    from sniff.analysis.bulk_profile_findings import BulkProfileFindings  # with what reads and says values

    return BulkProfileFindings(session.timing, dissector, devices)


def is_strange(table: Table) -> bool:
    """Whether rows of a table have to be taken one by one: what a search heard, times that columns cannot hold."""
    return any(row.searched is not None for row in table.odd.values()) or not table.has_true_times


def rules_of(dissector: Dissector) -> Mapping[str, Rule]:
    """The catalogue of one protocol; empty where it has no rules."""
    return dissector.rules


def rules_over(dissector: Dissector) -> dict[str, Rule]:
    """Every rule that a bus of this protocol is judged by: its own, those of the line, those of device profiles."""
    return {**LINE_RULES, **PROFILE_RULES, **rules_of(dissector)}


def all_rules() -> dict[str, Rule]:
    """Every rule of every protocol, of the line, of device profiles and of sites, by code."""
    rules = {**LINE_RULES, **PROFILE_RULES, **SITE_RULES}
    for name in registry.names():
        rules.update(rules_of(registry.get(name)))
    return rules
