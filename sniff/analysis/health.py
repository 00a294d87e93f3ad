"""Health of a station and of a bus: 0 to 100 by a published formula, always with the reasons. Pure.

Points are taken off 100, never below 0:

    of a station                                              points                     at most
      requests without answer                                 200 × share of requests      100
      frames from it damaged, or answers                      300 × share                   60
      late answers, second answers, answers after a repeat    100 × share of requests       30
      exceptions                                               50 × share of requests       20
      findings about it                                       30 an error, 10 a warning     60
    of a bus
      requests without answer                                 100 × share of requests       50
      damaged frames                                          300 × share of frames         60
      octets that are no frame                                200 × share of octets         30
      octets with line errors                                 200 × share of octets         30
      findings about the bus or its masters                   30 an error, 10 a warning     60
      and it is never better than half way between 100 and the worst station that an error or warning is about

What is damaged or missing is nobody's as far as holes in the capture explain it, octets that were lost on their way
into it: as many damaged frames, damaged answers and missing answers as there are holes count for nothing, of all
senders in the same share.

So half of the requests lost, or every fifth frame damaged, is a station at 0 or 40, and a bus with a dead station has
50 at best. A station that was never asked and sent nothing has no health, nor has an address that was asked LOOKED_FOR
times at most, never answered, and that no error or warning is about: somebody looked whether anybody is there.
README.md has the formula for users.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from dissectors.findings import Finding, Severity
from dissectors.tracker import Verdict
from sniff.analysis.nodes import Node
from sniff.analysis.summary import Summary
from sniff.engine.session import LineEventKind

LOOKED_FOR = 3
"""So many requests to an address that never answers are a look whether anybody is there."""

ERROR_POINTS, WARNING_POINTS, FINDINGS_MOST = 30, 10, 60


@dataclass(frozen=True, slots=True)
class Health:
    """`score`: 0 … 100. `reasons`: each deduction in words with its points; empty at 100."""

    score: int
    reasons: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"{self.score}" + (f" ({'; '.join(self.reasons)})" if self.reasons else "")


@dataclass(frozen=True, slots=True)
class _Beyond:
    """Which share of what was counted is more than the holes of the capture explain, 0 … 1."""

    frames: float = 1.0
    answers: float = 1.0
    unanswered: float = 1.0

    @classmethod
    def of(cls, summary: Summary, nodes: Iterable[Node]) -> _Beyond:
        """The same for all senders: a hole has no favourite."""
        holes = sum(count for kind, count in summary.events.items() if kind.is_hole)
        holes -= min(summary.events[LineEventKind.UNPLUGGED], summary.events[LineEventKind.REPLUGGED])  # one hole
        counts = summary.damaged, summary.verdicts[Verdict.DAMAGED_ANSWER], sum(node.unanswered for node in nodes)
        return cls(*(max(0, count - holes) / count if count else 1.0 for count in counts))


@dataclass(frozen=True, slots=True)
class HealthReport:
    """The health of a bus and of each station on it that has one, by address."""

    bus: Health
    stations: Mapping[int, Health] = field(default_factory=dict)


def health_of(summary: Summary, findings: Iterable[Finding] = (), noun: str = "station") -> HealthReport:
    """Health of the bus and of its stations; `findings`: all that are about this bus; `noun`: what its people call a
    station, whatever the device is that a finding speaks of."""
    grave = [finding for finding in findings if finding.severity >= Severity.WARNING]
    about: dict[int, list[Finding]] = {}
    for finding in grave:
        address = station_of(finding)
        if address is not None:
            about.setdefault(address, []).append(finding)
    there = [node for node in summary.nodes if _is_there(node, about)]
    beyond = _Beyond.of(summary, there)
    stations = {
        node.address: health
        for node in summary.nodes.present()
        if _is_there(node, about) and (health := station_health(node, about.get(node.address, ()), beyond)) is not None
    }
    bus = _bus_health(summary, there, beyond, [finding for finding in grave if finding.about.is_whole_bus])
    worst = min((address for address in about if address in stations), key=lambda a: stations[a].score, default=None)
    if worst is not None and (limit := (100 + stations[worst].score) // 2) < bus.score:
        reason = f"{noun} {worst} is at {stations[worst].score}, so the bus is at {limit} at best"
        bus = Health(limit, (*bus.reasons, reason))
    return HealthReport(bus, stations)


def bus_health(summary: Summary) -> Health:
    """Health of the bus alone, of which nobody has found anything."""
    there = [node for node in summary.nodes if _is_there(node, {})]
    return _bus_health(summary, there, _Beyond.of(summary, there), ())


def station_of(finding: Finding) -> int | None:
    """The station that a finding is about: of "0 → 27" it is 27."""
    return finding.about.station


def station_health(node: Node, findings: Iterable[Finding] = (), beyond: _Beyond = _Beyond()) -> Health | None:
    """Health of one station, with the findings about it; None where it was never asked and sent nothing."""
    if not node.seen:
        return None
    asked, verdicts = node.asked, node.verdicts
    answers = beyond.answers * _share(verdicts[Verdict.DAMAGED_ANSWER], asked)
    of_frames = beyond.frames * _share(node.damaged, node.sent)
    again = verdicts[Verdict.LATE] + verdicts[Verdict.ANSWERED_TWICE] + verdicts[Verdict.RETRY]
    return _sum(
        findings,
        (beyond.unanswered * _share(node.unanswered, asked), 200, 100, "of its requests without answer"),
        (max(answers, of_frames), 300, 60, f"of its {'answers' if answers > of_frames else 'frames'} damaged"),
        (_share(again, asked), 100, 30, "answered late, twice or after a repeat"),
        (_share(verdicts[Verdict.EXCEPTION], asked), 50, 20, "answered with an exception"),
    )


def _is_there(node: Node, about: Mapping[int, object]) -> bool:
    """Whether an address is somebody's: it was heard, or is missed (asked often, or something grave is about it)."""
    return node.sent > 0 or node.address in about or node.asked > LOOKED_FOR


def _bus_health(summary: Summary, nodes: Iterable[Node], beyond: _Beyond, findings: Iterable[Finding]) -> Health:
    nodes = list(nodes)
    asked, unanswered = sum(node.asked for node in nodes), sum(node.unanswered for node in nodes)
    return _sum(
        findings,
        (beyond.unanswered * _share(unanswered, asked), 100, 50, "of all requests without answer"),
        (beyond.frames * _share(summary.damaged, summary.frames), 300, 60, "of all frames damaged"),
        (_share(summary.noise, summary.octets), 200, 30, "of all octets are no frame"),
        (_share(sum(summary.marks.values()), summary.octets), 200, 30, "of all octets with line errors"),
    )


def _sum(findings: Iterable[Finding], *parts: tuple[float, int, int, str]) -> Health:
    score, reasons = 100.0, []
    for share, weight, most, words in parts:
        points = min(float(most), weight * share)
        if points > 0:
            score -= points
            reasons.append(
                f"{_percent(share)} {words} (−{points:.0f})" if points >= 0.5 else f"{_percent(share)} {words}"
            )
    graves = [finding for finding in findings if finding.severity >= Severity.WARNING]
    if graves:
        errors = sum(finding.severity is Severity.ERROR for finding in graves)
        taken = min(FINDINGS_MOST, ERROR_POINTS * errors + WARNING_POINTS * (len(graves) - errors))
        score -= taken
        named = ", ".join(sorted({finding.code for finding in graves}))
        reasons.append(f"finding{'s' if ', ' in named else ''} {named} (−{taken})")
    rounded = max(0, round(score))
    return Health(min(rounded, 99) if reasons else rounded, tuple(reasons))


def _share(part: int, of: int) -> float:
    return min(1.0, part / of) if of else 0.0


def _percent(share: float) -> str:
    return f"{share:.0%}" if share >= 0.1 else f"{share:.1%}" if share >= 0.001 else "under 0.1%"
