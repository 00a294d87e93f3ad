"""One run of one case: simulate, listen, judge, and compare what was said with what is true."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from dissectors.findings import Finding, Severity
from sniff.analysis.judging import Judging, rules_over
from sniff.devices import noted_devices
from sniff.engine.blocks import blocks_of
from sniff.engine.bulk import tables
from sniff.engine.follow_settings import dissector_for
from sniff.engine.observer import observe_tables
from sniff.engine.session import Item, Session
from sniff.formats import with_first_reads
from tests.faults.case import Case, subject_of


@dataclass(frozen=True, slots=True)
class Outcome:
    """One run of one case.

    `missed`: what should have been said. `accused`: findings at warning or above about somebody innocent.
    `mistaken`: errors about whoever may be named that are not what is wrong, and codes that must never come.
    `unneeded`: warnings about the bus where it is somebody else's fault: told, but no accusation of anybody.
    """

    name: str
    seed: int
    findings: tuple[Finding, ...]
    missed: tuple[str, ...]
    accused: tuple[str, ...]
    mistaken: tuple[str, ...]
    unneeded: tuple[str, ...] = ()

    @property
    def false(self) -> tuple[str, ...]:
        """Everything that should not have been said."""
        return self.accused + self.mistaken

    @property
    def right(self) -> bool:
        return not self.missed and not self.false

    @property
    def graves(self) -> tuple[str, ...]:
        """What was said at warning or above."""
        return tuple(f"{f.code} {f.subject}" for f in self.findings if f.severity >= Severity.WARNING)

    @property
    def notes(self) -> tuple[str, ...]:
        """What was said as a note."""
        return tuple(f"{f.code} {f.subject}" for f in self.findings if f.severity is Severity.NOTE)

    @property
    def sentences(self) -> tuple[str, ...]:
        """Every finding in full."""
        return tuple(f"{f.severity.label} {f.code} {f.subject}: {f.seen} [{f.means}]" for f in self.findings)


def findings_of(session: Session, items: Iterable[Item]) -> tuple[Finding, ...]:
    """What all rules together say of a capture: by the way that `check` takes."""
    judging = Judging(session, dissector_for(session), noted_devices(session))
    observe_tables(tables(blocks_of(iter(items)), session), judging)
    return judging.findings()


def run(case: Case, seed: int = 1) -> Outcome:
    """Simulate, listen, judge."""
    session, heard = case.hear(case.make(seed=seed), case.seconds, case.tap)
    items = list(heard)
    session = with_first_reads(session, items)  # as whoever opens a file of it does
    findings = findings_of(session, items)
    rules = rules_over(dissector_for(session))
    missed = tuple(
        str(said) for said in case.wanted if not any(said.fits(one, rules.get(one.code)) for one in findings)
    )
    meant = {id(one) for one in findings for said in case.wanted if said.fits(one, rules.get(one.code))}
    allowed = case.about if case.expect else frozenset(("adapter",))
    accused, mistaken = [], []
    for one in findings:
        named = f"{one.code} {one.subject}"
        if one.severity >= Severity.WARNING and subject_of(one) not in allowed:
            accused.append(named)
        elif one.code in case.never or (
            one.severity is Severity.ERROR and id(one) not in meant and one.code not in case.also
        ):  # what is called an error must be what is wrong
            mistaken.append(named)
    shared = "bus" in case.struck or any("bus" in said.subjects for said in case.wanted)
    unneeded = () if shared or not case.expect else tuple(_bus_warnings(findings))
    return Outcome(case.name, seed, findings, missed, tuple(accused), tuple(mistaken), unneeded)


def _bus_warnings(findings: Iterable[Finding]) -> Iterable[str]:
    return (f"{one.code} bus" for one in findings if one.severity >= Severity.WARNING and one.subject == "bus")
