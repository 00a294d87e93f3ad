"""A capture read as `check` reads it: rows with their verdicts, findings, health. For the cases in this folder.

The inputs are others' (../shared/cases beside the checkout); tests that need them skip with a reason where the folder
is absent.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest

from dissectors.findings import Finding, Severity
from dissectors.tracker import Transaction, Verdict
from sniff.analysis.health import HealthReport, health_of
from sniff.analysis.judging import Judging
from sniff.analysis.summary import Summary
from sniff.bus.offline import outputs
from sniff.devices import noted_devices
from sniff.engine.engine import Output, Row
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import Session
from sniff.formats import read

CASES = Path(__file__).parents[2] / "../shared/cases"


def case(name: str) -> Path:
    """A file of the shared cases ("modbus/e1-reads-to-address-0.cap.txt"); skips the test where there is none."""
    path = CASES / name
    if not path.is_file():
        pytest.skip(f"the shared cases are not here ({name})")
    return path


@dataclass(frozen=True, slots=True)
class CaseReading:
    """What the program makes of a capture."""

    session: Session
    rows: tuple[Row, ...]
    transactions: tuple[Transaction, ...]
    findings: tuple[Finding, ...]
    health: HealthReport

    def verdicts(self) -> list[Verdict]:
        """Of all transactions, by id, that is in the order of their first frames."""
        return [transaction.verdict for transaction in sorted(self.transactions, key=lambda one: one.id)]

    def graves(self) -> set[tuple[str, str]]:
        """Code and subject of all findings at warning or above."""
        return {(one.code, one.subject) for one in self.findings if one.severity >= Severity.WARNING}

    def said(self, code: str) -> str:
        """All words of the findings of a code; empty where there is none."""
        return " ".join(f"{one.seen} {one.means} {one.next}" for one in self.findings if one.code == code)


def reading(path: Path) -> CaseReading:
    """Read, pair and judge a capture as the command line does."""
    capture = read(path)
    session = capture.session
    judging, summary = Judging(session, dissector_for(session), noted_devices(session)), Summary(session.line)
    rows: list[Row] = []
    transactions: list[Transaction] = []
    for item in outputs(capture.items(), session):
        if isinstance(item, Output):
            judging.add(item)
            summary.add(item)
            rows += item.rows
            transactions += item.transactions
        else:
            judging.add_line_event(item)
    findings = judging.findings()
    return CaseReading(session, tuple(rows), tuple(transactions), findings, health_of(summary, findings))
