"""What the rules of all protocols give: a finding says what was seen, what it is consistent with, what to check next.

A rule is catalogued once (`Rule`); a finding is one frozen value that names its rule by code. The codes carry the
protocol: MB… Modbus, N2… Metasys N2, MS… MS/TP, LN… the line itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

EVIDENCE_MAX = 16
"""Most frame numbers that a finding carries."""


class Severity(IntEnum):
    """How much it matters; ascending, so that `finding.severity >= Severity.WARNING` reads well."""

    INFO = 0  # worth knowing
    NOTE = 1  # unusual, works
    WARNING = 2  # costs time or will fail one day
    ERROR = 3  # fails now

    @property
    def label(self) -> str:
        """Lower-case name."""
        return self.name.lower()


@dataclass(frozen=True, slots=True)
class Rule:
    """One entry of a protocol's catalogue.

    `title`: some words for a list. `explanation`: plain text for `rule CODE`: what is measured, against which limit,
    from which source. `means`, `next`: the defaults of its findings.
    """

    code: str
    severity: Severity
    title: str
    explanation: str
    means: str = ""
    next: str = ""


@dataclass(frozen=True, slots=True)
class Finding:
    """What a rule found.

    `subject`: what it is about ("MAC 12", "12 → 27", "bus"). `first`, `last`: ns, when it was seen first and last.
    `count`: how often. `evidence`: frame numbers, at most EVIDENCE_MAX. `seen`: what was seen; `means`: what it is
    consistent with; `next`: what to check next. Plain sentences, no control characters.
    """

    code: str
    severity: Severity
    subject: str
    first: int
    last: int
    count: int
    evidence: tuple[int, ...]
    seen: str
    means: str
    next: str


def found(
    rule: Rule,
    subject: str,
    seen: str,
    *,
    first: int = 0,
    last: int = 0,
    count: int = 1,
    evidence: tuple[int, ...] = (),
    severity: Severity | None = None,
) -> Finding:
    """A finding of a rule, with the rule's own words for cause and next step; evidence is cut to EVIDENCE_MAX."""
    return Finding(
        code=rule.code,
        severity=rule.severity if severity is None else severity,
        subject=subject,
        first=first,
        last=max(first, last),
        count=count,
        evidence=evidence[:EVIDENCE_MAX],
        seen=seen,
        means=rule.means,
        next=rule.next,
    )
