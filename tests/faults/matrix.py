"""Runs cases of the matrix and prints them as a table: `python -m tests.faults.matrix`, or `make faults`."""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass

from dissectors.findings import Finding, Severity
from sniff.analysis.judging import Judging
from sniff.engine import Output
from sniff.profile_files import noted_devices
from sniff.reading import dissector_for, outputs
from tests.faults.cases import CASES, Case, clean_cases, unsteady_cases

SEEDS = (1, 2, 3, 4, 5)


@dataclass(frozen=True, slots=True)
class Outcome:
    """One run of one case. `missed`: what should have been said; `false`: what should not, at warning or above."""

    case: Case
    seed: int
    findings: tuple[Finding, ...]
    missed: tuple[str, ...]
    false: tuple[str, ...]

    @property
    def right(self) -> bool:
        return not self.missed and not self.false


def run(case: Case, seed: int = 1) -> Outcome:
    """Simulate, listen, judge."""
    plan = case.make(seed=seed)
    session, items = case.hear(plan, case.seconds, case.tap)
    judging = Judging(session, dissector_for(session), noted_devices(session))
    for item in outputs(items, session):
        if isinstance(item, Output):
            judging.add(item)
        else:
            judging.add_line_event(item)
    findings = judging.findings()
    said = {(finding.code, finding.subject.split(",")[0]) for finding in findings}
    missed = tuple(f"{code} {subject}" for code, subject in case.expect if (code, subject) not in said)
    allowed = case.about if case.expect else frozenset(("adapter",))
    graves = {*case.also, *(code for code, _ in case.expect)}  # what is called an error must be what is wrong
    false = tuple(
        f"{finding.code} {finding.subject}"
        for finding in findings
        if finding.code in case.never
        or (
            finding.severity >= Severity.WARNING
            and (
                finding.subject.split(",")[0] not in allowed
                or (finding.severity is Severity.ERROR and finding.code not in graves)
            )
        )
    )
    return Outcome(case, seed, findings, missed, false)


def main(words: list[str]) -> int:
    """Print the whole table; `words` choose cases by name. Exit code 1 below 95 in 100, or with a false alarm."""
    cases = [*CASES, *unsteady_cases(), *clean_cases(3600)]
    chosen = [case for case in cases if not words or any(word.lower() in case.name.lower() for word in words)]
    right = total = clean = 0
    for case in chosen:
        began = time.monotonic()
        seeds = SEEDS if case.expect else SEEDS[:1]
        outcomes = [run(case, seed) for seed in seeds]
        good = sum(outcome.right for outcome in outcomes)
        if case.expect:
            right, total = right + good, total + len(outcomes)
        else:
            clean += good < len(outcomes)
        wanted = ", ".join(f"{code} {subject}" for code, subject in case.expect) or "nothing"
        trouble = sorted(
            {f"missed {what}" for o in outcomes for what in o.missed}
            | {f"false {w}" for o in outcomes for w in o.false}
        )
        took = time.monotonic() - began
        print(f"{good}/{len(outcomes)}  {case.name:<34} {wanted:<32} {took:5.1f} s  {'; '.join(trouble)}", flush=True)
    if total:
        print(f"\n{right} of {total} runs right ({right / total:.1%})")
    print(f"{clean} clean buses with a false alarm")
    return int(clean > 0 or right < 0.95 * total)


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
