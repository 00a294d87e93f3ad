"""Health of a station and of a bus: 0 to 100 by a published formula, always with the reasons. Pure.

Points are taken off 100, never below 0:

    of a station                                              points                  at most
      requests that nothing followed in time                  200 × share of requests   100
      damaged frames from or to it, or damaged answers        300 × share                60
      late answers, second answers, answers after a repeat    100 × share of requests    30
      exceptions                                               50 × share of requests    20
    of a bus
      requests that nothing followed in time                  100 × share of requests    50
      damaged frames                                          300 × share of frames      60
      octets that are no frame                                200 × share of octets      30
      octets with line errors                                 200 × share of octets      30
      findings about the bus or its masters       20 an error, 5 a warning               40

So half of the requests lost, or every fifth frame damaged, is a station at 0 or 40. A station that was never asked and
sent nothing has no health. What one deduction counts, a finding explains.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from dissectors.findings import Finding, Severity
from dissectors.tracker import Verdict
from sniff.analysis.nodes import Node
from sniff.analysis.summary import Summary

BUS_SUBJECTS = frozenset(("bus", "master"))
_ERROR_POINTS, _WARNING_POINTS, _FINDINGS_MOST = 20, 5, 40


@dataclass(frozen=True, slots=True)
class Health:
    """`score`: 0 … 100. `reasons`: each deduction in words with its points; empty at 100."""

    score: int
    reasons: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"{self.score}" + (f" ({'; '.join(self.reasons)})" if self.reasons else "")


def station_health(node: Node) -> Health | None:
    """Health of one station; None where it was never asked and sent nothing."""
    if not node.seen:
        return None
    asked, frames = node.asked, node.sent + node.received
    verdicts = node.verdicts
    damaged = max(_share(verdicts[Verdict.DAMAGED_ANSWER], asked), _share(node.damaged, frames))
    again = verdicts[Verdict.LATE] + verdicts[Verdict.ANSWERED_TWICE] + verdicts[Verdict.RETRY]
    return _sum(
        (_share(node.unanswered, asked), 200, 100, "of its requests without answer"),
        (damaged, 300, 60, "of its frames damaged"),
        (_share(again, asked), 100, 30, "answered late, twice or after a repeat"),
        (_share(verdicts[Verdict.EXCEPTION], asked), 50, 20, "answered with an exception"),
    )


def bus_health(summary: Summary, findings: Iterable[Finding] = ()) -> Health:
    """Health of the whole bus; `findings` about stations do not count here."""
    asked = sum(node.asked for node in summary.nodes)
    unanswered = sum(node.unanswered for node in summary.nodes)
    health = _sum(
        (_share(unanswered, asked), 100, 50, "of all requests without answer"),
        (_share(summary.damaged, summary.frames), 300, 60, "of all frames damaged"),
        (_share(summary.noise, summary.octets), 200, 30, "of all octets are no frame"),
        (_share(sum(summary.marks.values()), summary.octets), 200, 30, "of all octets with line errors"),
    )
    about = [finding for finding in findings if finding.subject in BUS_SUBJECTS]
    errors = sum(finding.severity >= Severity.ERROR for finding in about)
    warnings = sum(finding.severity is Severity.WARNING for finding in about)
    points = min(_FINDINGS_MOST, _ERROR_POINTS * errors + _WARNING_POINTS * warnings)
    if not points:
        return health
    named = ", ".join(sorted({finding.code for finding in about if finding.severity >= Severity.WARNING}))
    return Health(max(0, health.score - points), (*health.reasons, f"findings {named} (−{points})"))


def _sum(*parts: tuple[float, int, int, str]) -> Health:
    score, reasons = 100.0, []
    for share, weight, most, words in parts:
        points = min(float(most), weight * share)
        if points > 0:
            score -= points
            reasons.append(
                f"{_percent(share)} {words} (−{points:.0f})" if points >= 0.5 else f"{_percent(share)} {words}"
            )
    rounded = max(0, round(score))
    return Health(min(rounded, 99) if reasons else rounded, tuple(reasons))


def _share(part: int, of: int) -> float:
    return min(1.0, part / of) if of else 0.0


def _percent(share: float) -> str:
    return f"{share:.0%}" if share >= 0.1 else f"{share:.1%}" if share >= 0.001 else "under 0.1%"
