"""Triggers of a live bus: a filter that a settled frame fits, or a rule that found something new.

Fed what the bus gives, as tables; says when something fired and on what. A filter fires on each frame that fits, but
once a second at most; a rule when it finds something, and again when its count grew, once every ten seconds at most.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from dissectors.findings import Finding
from dissectors.line import NS_PER_S
from dissectors.manifest import Dissector
from sniff.analysis.judging import rules_over
from sniff.analysis.point_reader import PointReader
from sniff.bus.asked_rows import Fields, Meant, PointsTold, answers_told
from sniff.engine.column_join import ColumnJoin
from sniff.engine.engine import Output
from sniff.engine.table import Table
from sniff.filter import Filter, Scope, compile_filter
from sniff.filter.choosing import chosen

CODE = re.compile(r"[A-Z][A-Z0-9]\d{3}", re.ASCII)
FRAME_PAUSE = NS_PER_S
FINDING_PAUSE = 10 * NS_PER_S
"""ns between two that say the same."""
MOST_TOLD = 20_000
"""Rows whose values are remembered until they are settled."""


@dataclass(frozen=True, slots=True)
class Fired:
    """A trigger that fired: when what it fired on happened, ns; and what that was, in words."""

    time: int
    text: str


class Triggers:
    """`words`: filters, or codes of rules, several with commas. Raises ValueError for what is neither."""

    def __init__(self, words: Sequence[str], dissector: Dissector, scope: Scope | None = None) -> None:
        self._codes: set[str] = set()
        self._filters: list[tuple[str, Filter]] = []
        self._points: list[PointsTold] = []
        self._answers: list[Meant[Fields]] = []
        known = rules_over(dissector)
        for word in words:
            codes = [each.strip() for each in word.split(",")]
            if all(CODE.fullmatch(code) for code in codes):
                missing = next((code for code in codes if code not in known), None)
                if missing is not None:
                    raise ValueError(f"{missing}: no such rule; `sniff485 rule` lists them")
                self._codes.update(codes)
            else:
                self._filters.append((word, self._compiled(word, dissector, scope or Scope())))
        self._join = ColumnJoin()
        self._dissector = dissector
        self._fired_at: dict[str, int] = {}
        self._counts: dict[tuple[str, str], int] = {}

    def _compiled(self, word: str, dissector: Dissector, scope: Scope) -> Filter:
        """A filter that live frames can fit. Raises ValueError."""
        wanted = compile_filter(word, dissector, scope)
        if "finding" in wanted.names:
            raise ValueError(f"{word}: what is found is no part of a frame yet; the code alone fires, such as MB001")
        if wanted.by_request:
            self._answers.append(answers_told(dissector, wanted.by_request, MOST_TOLD))
            told = self._answers[-1]
            scope = replace(scope, answered=lambda row: told.of(row) or {})
            wanted = compile_filter(word, dissector, scope)
        if wanted.points:
            self._points.append(PointsTold(PointReader(dissector, scope.devices), wanted.points, MOST_TOLD))
            wanted = compile_filter(
                word, dissector, replace(scope, told=self._points[-1].of, telling=self._points[-1].telling)
            )
        return wanted

    def see(self, item: Table | Output) -> Iterator[Fired]:
        """Take what the engine gave."""
        if not self._filters:
            return
        table = item
        if isinstance(table, Output):
            table = Table.of_outputs(self._dissector.name, table.rows[0].no if table.rows else 0, [table])
        for points in self._points:
            points.add_table(table)
        for output in table.outputs() if self._answers else ():
            for answers in self._answers:
                answers.add(output)
        for some in self._join.add(table):
            for word, wanted in self._filters:
                for place in chosen(some, wanted).tolist():
                    end = int(some.table.frames.end[place])
                    if self._is_due(word, end, FRAME_PAUSE):
                        yield Fired(end, f"{word}: frame {some.table.first + place}")

    def judge(self, findings: Sequence[Finding]) -> Iterator[Fired]:
        """Take what the rules have found by now."""
        for finding in findings:
            if finding.code not in self._codes or finding.count <= self._counts.get(finding.key, 0):
                continue
            if self._is_due(f"{finding.code} {finding.subject}", finding.last, FINDING_PAUSE):
                self._counts[finding.key] = finding.count
                yield Fired(finding.last, f"{finding.code} {finding.subject}: {finding.seen}")

    def _is_due(self, what: str, time: int, pause: int) -> bool:
        before = self._fired_at.get(what)
        if before is not None and 0 <= time - before < pause:
            return False
        self._fired_at[what] = time
        return True
