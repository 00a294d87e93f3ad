"""All rules over one bus: those of its protocol and those of the line. Pure; the same live and offline."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import cast

from dissectors import registry
from dissectors.findings import Finding, Judge, Rule
from dissectors.line import Timing
from dissectors.registry import Dissector
from sniff.analysis.line_findings import LineFindings
from sniff.analysis.line_rules import LINE_RULES
from sniff.engine import Output
from sniff.session import LineEvent, Session


class Judging:
    """Fed what the engine gives; `findings` may be asked at any time."""

    def __init__(self, session: Session, dissector: Dissector) -> None:
        make = cast("Callable[[Timing], Judge] | None", dissector.extras.get("findings"))
        self.judge = make(session.timing) if make is not None else None
        self.line = LineFindings(session)

    def add(self, output: Output) -> None:
        """Take rows and closed transactions."""
        judge, line = self.judge, self.line
        for row in output.rows:
            line.see(row)
            if judge is not None:
                judge.see(row.no, row.event, row.header, row.placement)
        for transaction in output.transactions:
            line.settle(transaction)
            if judge is not None:
                judge.settle(transaction)

    def add_line_event(self, event: LineEvent) -> None:
        """Take something that happened to the line."""
        self.line.add_line_event(event)

    def findings(self) -> tuple[Finding, ...]:
        """All findings so far, the gravest first. Where hardly anything is a frame, the line speaks alone."""
        made = [*self.line.findings()]
        if self.judge is not None and not self.line.rubbish:
            made += self.judge.findings()
        return tuple(
            sorted(made, key=lambda finding: (-finding.severity, finding.first, finding.code, finding.subject))
        )


def rules_of(dissector: Dissector) -> Mapping[str, Rule]:
    """The catalogue of one protocol; empty where it has no rules."""
    return cast("Mapping[str, Rule]", dissector.extras.get("rules", {}))


def all_rules() -> dict[str, Rule]:
    """Every rule of every protocol and of the line, by code."""
    rules = dict(LINE_RULES)
    for name in registry.names():
        rules.update(rules_of(registry.get(name)))
    return rules
