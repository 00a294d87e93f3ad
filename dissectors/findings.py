"""Findings, as the rules of all protocols give them: what was seen, what it is consistent with, what to check next.

A rule is catalogued once (`Rule`); a finding is one frozen value that names its rule by code. The codes carry the
protocol: MB… Modbus, N2… Metasys N2, MS… MS/TP, LN… the line itself.

A protocol brings its rules as `Dissector.judge`, a function Timing → `Judge`, and their catalogue as
`Dissector.rules`, a mapping code → `Rule`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import IntEnum
from itertools import islice
from typing import Protocol

from dissectors import busiest
from dissectors.device_facts import ExceptionWords as ExceptionWords
from dissectors.device_facts import KnowsResponseTimes as KnowsResponseTimes
from dissectors.device_facts import KnowsStations as KnowsStations
from dissectors.device_facts import KnowsUnexecuted as KnowsUnexecuted
from dissectors.device_facts import WordsExceptions as WordsExceptions
from dissectors.frame import Event, Header
from dissectors.subject import Subject, as_subject
from dissectors.tracker import Placement, Transaction

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
    from which source. `means`, `next`: the defaults of its findings. `explains`: codes, or begins of codes, of what is
    most likely a mere consequence of what this rule finds, at warning or above; `explains_there`: only where it stands
    in the same frames and is no more. `told_by`: the same of what tells the same trouble better: where one of those
    stands, of the same subject, this rule's finding is a note under it; what
    this rule finds of the bus stands under that of one station only where it is the only one that is struck. `lasts`:
    it is found as long as it is so, and no longer (`Finding.lasts`).
    """

    code: str
    severity: Severity
    title: str
    explanation: str
    means: str = ""
    next: str = ""
    explains: tuple[str, ...] = ()
    explains_there: tuple[str, ...] = ()
    told_by: tuple[str, ...] = ()
    lasts: bool = False


@dataclass(frozen=True, slots=True)
class Finding:
    """What a rule found.

    `subject`: what it is about in words ("MAC 12", "12 → 27", "bus"); `about`: the same as a value. `first`, `last`:
    ns, when it was seen first and last. `count`: how often. `evidence`: frame numbers, at most EVIDENCE_MAX. `seen`:
    what was seen; `means`: what it is consistent with; `next`: what to check next. Plain sentences, no control
    characters. `cause`: code and subject of the finding that most likely explains this one; a face shows this one
    under it. `stated`: the value behind the words, where whoever found it had one. `stations`: of what is found about
    the bus, the stations that it concerns; empty: everybody. `is_once`: it is said once of a capture and its count is
    no number of times. `is_told_apart`: its own words name a cause that no other finding tells, so that it stands for
    itself (`Rule.told_by`). `lasts`: it stands as long as it is found, however long ago it was seen last.
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
    cause: tuple[str, str] | None = None
    stated: Subject | None = None
    stations: tuple[int, ...] = ()
    is_once: bool = False
    is_told_apart: bool = False
    lasts: bool = False

    @property
    def about(self) -> Subject:
        """What it is about."""
        return self.stated if self.stated is not None else as_subject(self.subject)

    @property
    def key(self) -> tuple[str, str]:
        """What another finding's `cause` calls it by."""
        return self.code, self.subject

    def merge(self, other: Finding) -> Finding:
        """What one rule found about one subject in two captures of a bus: counts add up, times span both.

        Words and evidence are those of the graver one, of this one where both are as grave: frames are numbered by
        capture, and of many it must not matter which are put together first. It concerns the stations of both. Raises
        ValueError for findings of two things.
        """
        if (self.code, self.subject) != (other.code, other.subject):
            raise ValueError(f"{self.code} {self.subject} and {other.code} {other.subject} are two things")
        told = max(self, other, key=lambda finding: finding.severity)
        count = self.count + other.count
        stations = self.stations
        if stations != other.stations:  # where either concerns everybody, both do
            stations = tuple(sorted({*stations, *other.stations})) if stations and other.stations else ()
        first, last = min(self.first, other.first), max(self.last, other.last)
        return replace(told, count=count, first=first, last=last, stations=stations)


def merged(parts: Iterable[Iterable[Finding]]) -> tuple[Finding, ...]:
    """The findings of several captures of a bus as those of one, the gravest first, then the most frequent."""
    found: dict[tuple[str, str], Finding] = {}
    for part in parts:
        for finding in part:
            key = finding.code, finding.subject
            found[key] = found[key].merge(finding) if key in found else finding
    return tuple(sorted(found.values(), key=lambda one: (-one.severity, -one.count, one.code, one.subject)))


class Judge(Protocol):
    """The rules of one protocol at work on one bus. Total: any events, any times; memory is bounded.

    `see` and `settle` are called in the order of the wire, for all rows and all transactions that closed. The same
    calls give the same findings. Nothing is judged that `Timing.latency` does not allow to be known.
    """

    def see(self, no: int, event: Event, header: Header | None, placement: Placement | None) -> None:
        """Take the next row: its number, event, header and placement (both None for noise)."""
        ...

    def settle(self, transaction: Transaction) -> None:
        """Take a transaction that closed."""
        ...

    def findings(self) -> tuple[Finding, ...]:
        """All findings so far; may be asked at any time."""
        ...


@dataclass(slots=True)
class Tally:
    """How often, when (ns) and in which frames one thing was seen; the first EVIDENCE_MAX frames are kept. `quarters`:
    how many in each quarter of an hour."""

    count: int = 0
    first: int = 0
    last: int = 0
    evidence: list[int] = field(default_factory=list)
    quarters: busiest.Quarters = field(default_factory=dict)

    def add(self, time: int, *frames: int | None) -> None:
        """Count one more at `time`."""
        self.first = min(self.first, time) if self.count else time
        self.last = max(self.last, time) if self.count else time
        self.count += 1
        busiest.count(self.quarters, time)
        if len(self.evidence) < EVIDENCE_MAX:
            self.evidence.extend(no for no in frames if no is not None and no not in self.evidence)

    def add_many(self, times: Sequence[int], frames: Iterable[int]) -> None:
        """Count one more at each of `times`, with frames of their own; of these only the first few are asked for."""
        if not times:
            return
        self.first = min(self.first, *times) if self.count else min(times)
        self.last = max(self.last, *times) if self.count else max(times)
        self.count += len(times)
        for time in times:
            busiest.count(self.quarters, time)
        for no in islice(frames, max(0, EVIDENCE_MAX - len(self.evidence))):
            self.evidence.append(no)

    def found(self, rule: Rule, subject: str | Subject, seen: str, severity: Severity | None = None) -> Finding:
        """The finding that this adds up to."""
        return found(
            rule,
            subject,
            seen,
            first=self.first,
            last=self.last,
            count=self.count,
            evidence=tuple(sorted(self.evidence)),
            severity=severity,
        )


def together(tallies: Iterable[Tally]) -> Tally:
    """Several tallies as one; of their frames the first EVIDENCE_MAX."""
    seen = [one for one in tallies if one.count]
    if not seen:
        return Tally()
    frames = sorted({no for one in seen for no in one.evidence})
    first, last = min(one.first for one in seen), max(one.last for one in seen)
    quarters = busiest.summed(one.quarters for one in seen)
    return Tally(sum(one.count for one in seen), first, last, frames[:EVIDENCE_MAX], quarters)


def with_consequences(findings: Iterable[Finding], rules: Mapping[str, Rule]) -> tuple[Finding, ...]:
    """The same findings; those that a graver or as grave one explains (`Rule.explains`) are notes that name it.

    Only a warning or an error explains, and never what is itself a consequence. What is found about a station explains
    what is said of that station and of things in it, of the bus and of the master; what is found about the bus
    explains it of everybody.
    """
    made = list(findings)
    # what is wrong with one station explains more of it than what is wrong with the bus
    order = sorted(range(len(made)), key=lambda at: (-made[at].severity, made[at].about.reaches_all))
    of_station: dict[int | None, list[int]] = {}
    for at, finding in enumerate(made):
        of_station.setdefault(finding.about.station, []).append(at)
    for at in order:
        cause = made[at]
        if cause.cause is not None or cause.severity < Severity.WARNING or cause.code not in rules:
            continue
        codes, there = rules[cause.code].explains, rules[cause.code].explains_there
        any_of = (*codes, *there)
        for other, finding in enumerate(made):
            if other == at or finding.cause is not None or not finding.code.startswith(any_of):
                continue
            is_there = finding.count <= cause.count and not set(cause.evidence).isdisjoint(finding.evidence)
            if not _is_explained(finding, cause, any_of if is_there else codes):
                continue
            own = (made[one] for one in of_station[finding.about.station])
            if not _has_nearer(finding, cause, own, rules):
                made[other] = as_consequence(finding, cause, rules)
    return from_the_root(_told_once(made, rules), rules)


def _has_nearer(finding: Finding, cause: Finding, own: Iterable[Finding], rules: Mapping[str, Rule]) -> bool:
    """Whether what is found of one station, and may come of what is found of another, may come of its own trouble.
    `own`: all that is found of that station."""
    station = finding.about.station
    if station is None or cause.about.station in (None, station):
        return False
    return any(
        one.severity >= max(Severity.WARNING, finding.severity)
        and one is not finding
        and one.cause is None
        and one.code in rules
        and finding.code.startswith(rules[one.code].explains or ("-",))
        for one in own
    )


def from_the_root(findings: Iterable[Finding], rules: Mapping[str, Rule]) -> tuple[Finding, ...]:
    """The same findings; one whose cause turned out to be a consequence itself comes of what that one comes of."""
    made = tuple(findings)
    by_key = {one.key: one for one in made}
    return tuple(_from_the_root(one, by_key, rules) for one in made)


def _from_the_root(finding: Finding, by_key: Mapping[tuple[str, str], Finding], rules: Mapping[str, Rule]) -> Finding:
    passed = {finding.key}
    cause = by_key.get(finding.cause) if finding.cause is not None else None
    while cause is not None and cause.cause is not None and cause.key not in passed:
        passed.add(cause.key)
        cause = by_key.get(cause.cause)
    is_further = cause is not None and cause.key not in passed and cause.key != finding.cause
    return as_consequence(finding, cause, rules) if cause is not None and is_further else finding


def _told_once(findings: list[Finding], rules: Mapping[str, Rule]) -> tuple[Finding, ...]:
    """The same findings; those whose trouble another one tells that stands for itself (`Rule.told_by`) name it."""
    standing = [one for one in findings if one.cause is None and one.severity >= Severity.NOTE]
    made: list[Finding] = []
    for finding in findings:
        is_open = finding.cause is None and not finding.is_told_apart and finding.code in rules
        codes = rules[finding.code].told_by if is_open else ()
        tell = [one for one in standing if codes and one.code.startswith(codes) and one.severity >= finding.severity]
        same = [one for one in tell if one.about == finding.about or one.stations == (finding.about.station,)]
        if not same and finding.about.is_whole_bus and len({one.subject for one in tell}) == 1:
            same = tell
        made.append(_told_under(finding, same[0], rules) if same else finding)
    return tuple(made)


def _told_under(finding: Finding, told: Finding, rules: Mapping[str, Rule]) -> Finding:
    under = as_consequence(finding, told, rules)
    title = rules[told.code].title if told.code in rules else ""
    return replace(under, means=f"most likely the same trouble as {told.code} ({told.subject}: {title})")


def _is_explained(finding: Finding, cause: Finding, codes: tuple[str, ...]) -> bool:
    if not finding.code.startswith(codes) or finding.severity > cause.severity:
        return False
    about, of_cause = finding.about, cause.about
    if cause.stations and about.station is not None:
        return about.station in cause.stations
    return about.is_whole_bus or of_cause.reaches_all or about.is_of(of_cause)


def as_consequence(finding: Finding, cause: Finding, rules: Mapping[str, Rule]) -> Finding:
    """The same finding as a note that names what most likely explains it."""
    return replace(
        finding,
        severity=min(finding.severity, Severity.NOTE),
        means=f"most likely a consequence of {cause.code} ({cause.subject}: {rules[cause.code].title})",
        next=f"settle {cause.code} first, then see whether this is still there",
        cause=(cause.code, cause.subject),
    )


def under_causes(findings: Iterable[Finding]) -> tuple[tuple[Finding, bool], ...]:
    """The findings in their order, each with whether it stands under the one before it that explains it.

    Consequences follow their cause; one whose cause is not among them stands for itself.
    """
    made = list(findings)
    standing = {one.key for one in made if one.cause is None}
    told: dict[tuple[str, str], list[Finding]] = {}
    for one in made:
        if one.cause is not None and one.cause in standing:
            told.setdefault(one.cause, []).append(one)
    ordered: list[tuple[Finding, bool]] = []
    for one in made:
        if one.cause not in standing:
            ordered.append((one, False))
            ordered += [(under, True) for under in told.pop(one.key, ())]
    return tuple(ordered)


def times(count: int) -> str:
    """How often, in words: "once", "twice", "12 times"."""
    return {1: "once", 2: "twice"}.get(count, f"{count} times")


def counted(count: int, thing: str, several: str | None = None) -> str:
    """A number of things: "1 answer", "12 answers"; `several`: the plural, where it is not made with an s."""
    return f"{count} {thing if count == 1 else several or thing + 's'}"


def found(
    rule: Rule,
    subject: str | Subject,
    seen: str,
    *,
    first: int = 0,
    last: int = 0,
    count: int | None = None,
    evidence: tuple[int, ...] = (),
    severity: Severity | None = None,
) -> Finding:
    """A finding of a rule, with the rule's own words for cause and next step; evidence is cut to EVIDENCE_MAX.

    `subject`: a `Subject`, or the words that are its `str()`. `count`: None for what is said once of a capture.
    """
    return Finding(
        code=rule.code,
        severity=rule.severity if severity is None else severity,
        subject=str(subject),
        first=first,
        last=max(first, last),
        count=1 if count is None else count,
        is_once=count is None,
        evidence=evidence[:EVIDENCE_MAX],
        seen=seen,
        means=rule.means,
        next=rule.next,
        stated=subject if isinstance(subject, Subject) else None,
        lasts=rule.lasts,
    )
