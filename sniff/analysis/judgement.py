"""The judgement of a bus or of a part of it: a value that is put together with that of the part that follows.

The evidence of rules depends on what was learnt from the begin (timeouts, who is on the bus, the rhythm of the master),
so the findings are what merges, not the evidence. Of one rule about one subject, be it one finding or several,

    the count is the sum of the counts, and of what is said once of a capture ("line errors reported: …") it stays one;
    the first and the last time span all parts; severity, words and evidence are those of the graver part.

What explains what is settled anew over all parts, and so is whether hardly anything was a frame. A rule that needs
more than any part shows (a share, a rhythm, three of a kind) finds in the whole what no part finds; what a part does
not know (a request before it, an answer after it) the whole may excuse: cut where the bus is quiet.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from dissectors.findings import Finding, Rule, Severity, merged, with_consequences
from sniff.analysis.sanitizing import sanitized

RUBBISH = "LN003"  # the code of "hardly anything is a frame"
RUBBISH_LEAST = 60  # octets before "hardly anything is a frame" is said
RUBBISH_TOLD = 40  # the same where it is known what they are
PROVED_FRAMES = 20
"""So many good frames, with 1 in 10 octets in them, prove the settings: what else there is has another cause."""


@dataclass(frozen=True, slots=True)
class Heard:
    """What was on the line. `octets`, and those `in_frames` that are good; `rows`, and the `good` frames among them.

    `outside`: rows were heard that say nothing of the bus, during a search for settings. `is_told`: it is known what
    the octets are that are no frames. `lacks_bits`: no octet has its upper bits, and so frames are damaged.
    """

    octets: int = 0
    in_frames: int = 0
    rows: int = 0
    good: int = 0
    outside: bool = False
    is_told: bool = False
    lacks_bits: bool = False

    def merge(self, later: Heard) -> Heard:
        """Both together."""
        return Heard(
            self.octets + later.octets,
            self.in_frames + later.in_frames,
            self.rows + later.rows,
            self.good + later.good,
            self.outside or later.outside,
            self.is_told or later.is_told,
            (self.lacks_bits or not self.rows) and (later.lacks_bits or not later.rows),
        )

    @property
    def is_nothing(self) -> bool:
        """Whether not one octet was heard."""
        return not self.octets and not self.outside

    @property
    def are_settings_proved(self) -> bool:
        """Whether so much is good that the settings are right."""
        return self.good >= PROVED_FRAMES and 10 * self.in_frames >= self.octets

    @property
    def is_strange(self) -> bool:
        """Whether hardly anything is a frame, however little was heard."""
        few = 10 * self.in_frames < 3 * self.octets and 10 * self.good < 3 * self.rows
        return few and self.octets >= RUBBISH_TOLD and not self.are_settings_proved

    @property
    def is_rubbish(self) -> bool:
        """Whether hardly anything is a frame, so that nothing else can be judged."""
        return self.lacks_bits or (self.is_strange and (self.octets >= RUBBISH_LEAST or self.is_told))


@dataclass(frozen=True, slots=True)
class Judgement:
    """Findings as each rule made them. `host`: of the adapter and this machine; `overall`: that nothing, or hardly a
    frame, was heard; `line`: of the line otherwise; `bus`: of the protocol's rules and of device profiles."""

    heard: Heard = Heard()
    host: tuple[Finding, ...] = ()
    overall: tuple[Finding, ...] = ()
    line: tuple[Finding, ...] = ()
    bus: tuple[Finding, ...] = ()

    def merge(self, later: Judgement) -> Judgement:
        """Both together, as a new value."""
        if not self.heard.rows and later.heard.rows:
            return replace(later, heard=self.heard.merge(later.heard), host=_beside(self.host, later.host))
        if not later.heard.rows and self.heard.rows:
            return replace(self, heard=self.heard.merge(later.heard), host=_beside(later.host, self.host))
        return Judgement(
            self.heard.merge(later.heard),
            _together(self.host, later.host),
            _together(self.overall, later.overall),
            _together(self.line, later.line),
            _together(self.bus, later.bus),
        )

    def findings(self, rules: Mapping[str, Rule]) -> tuple[Finding, ...]:
        """All findings, the gravest first. Where hardly anything is a frame, the line speaks alone, and what explains
        that. `rules`: every rule that the bus is judged by."""
        speaks_alone = self.heard.is_rubbish
        made = (*self.host, *(self.overall if speaks_alone or self.heard.is_nothing else self.line))
        made += tuple(one for one in self.bus if not speaks_alone or _explains_rubbish(one, rules))
        return tuple(
            sorted(
                map(_harmless, with_consequences(made, rules)),
                key=lambda finding: (-finding.severity, finding.first, finding.code, finding.subject),
            )
        )


def _explains_rubbish(finding: Finding, rules: Mapping[str, Rule]) -> bool:
    """Whether a finding tells why hardly anything is a frame: all are, but for one and the same thing."""
    rule = rules.get(finding.code)
    return rule is not None and RUBBISH in rule.explains and finding.severity >= Severity.WARNING


def _beside(unheard: tuple[Finding, ...], heard: tuple[Finding, ...]) -> tuple[Finding, ...]:
    """What was found of the adapter where no row was heard, and where some were: the time of the part says nothing."""
    known = {one.key for one in heard}
    return _together(tuple(one for one in unheard if not (one.is_once and one.key in known)), heard)


def _together(parts: tuple[Finding, ...], later: tuple[Finding, ...]) -> tuple[Finding, ...]:
    if not parts or not later:
        return parts or later
    return tuple(replace(one, count=1) if one.is_once else one for one in merged((parts, later)))


def _harmless(finding: Finding) -> Finding:
    """The same finding; what its words quote from a file or an adapter may be hostile."""
    return replace(
        finding,
        subject=sanitized(finding.subject),
        seen=sanitized(finding.seen),
        means=sanitized(finding.means),
        next=sanitized(finding.next),
        cause=None if finding.cause is None else (finding.cause[0], sanitized(finding.cause[1])),
    )
