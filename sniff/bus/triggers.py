"""Triggers of a live bus: a filter that a settled frame fits, or a rule that found something new.

Fed what the bus gives, as tables; says when something fired and on what. A filter fires on each frame that fits, but
once a second at most; a rule when it finds something, and again when its count grew, once every ten seconds at most.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from dissectors.findings import Finding
from dissectors.line import NS_PER_S
from dissectors.manifest import Dissector
from sniff.analysis.judging import rules_over
from sniff.engine.column_join import ColumnJoin
from sniff.engine.engine import Output
from sniff.engine.table import Table
from sniff.filter import Filter, Scope, compile_filter
from sniff.filter.choosing import chosen

CODE = re.compile(r"[A-Z][A-Z0-9]\d{3}", re.ASCII)
FRAME_PAUSE = NS_PER_S
FINDING_PAUSE = 10 * NS_PER_S
"""ns between two that say the same."""


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
        known = rules_over(dissector)
        for word in words:
            codes = [each.strip() for each in word.split(",")]
            if all(CODE.fullmatch(code) for code in codes):
                missing = next((code for code in codes if code not in known), None)
                if missing is not None:
                    raise ValueError(f"{missing}: no such rule; `sniff485 rule` lists them")
                self._codes.update(codes)
            else:
                self._filters.append((word, compile_filter(word, dissector, scope)))
        self._join = ColumnJoin()
        self._dissector = dissector
        self._fired_at: dict[str, int] = {}
        self._counts: dict[tuple[str, str], int] = {}

    @property
    def on_findings(self) -> bool:
        """Whether any of them is a rule."""
        return bool(self._codes)

    def see(self, item: Table | Output) -> Iterator[Fired]:
        """Take what the engine gave."""
        if not self._filters:
            return
        table = item
        if isinstance(table, Output):
            table = Table.of_outputs(self._dissector.name, table.rows[0].no if table.rows else 0, [table])
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
