"""Makes `captures/findings`: for each case of the matrix the shortest run that shows its findings.

python -m tests.faults.make_captures captures/findings && pytest --sniff-update captures
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from dissectors.findings import Finding
from sniff.analysis.judging import Judging
from sniff.engine import Output
from sniff.formats import create
from sniff.reading import dissector_for, outputs
from sniff.session import Item, Session
from tests.faults.cases import CASES, Case

SECONDS = (1, 2, 3, 5, 8, 12, 20, 30, 45, 60)
STARTED = 1_772_359_200 * 1_000_000_000
LARGEST = 150_000
"""Octets of a capture file: a larger one is left to the matrix."""


def findings_of(items: Iterable[Item], session: Session) -> tuple[Finding, ...]:
    judging = Judging(session, dissector_for(session))
    for item in outputs(items, session):
        if isinstance(item, Output):
            judging.add(item)
        else:
            judging.add_line_event(item)
    return judging.findings()


def shortest(case: Case) -> tuple[Session, list[Item]] | None:
    """The session and the items of the shortest stretch from the start that shows all that is expected."""
    session, heard = case.hear(case.make(seed=1), case.seconds, case.tap)
    everything = list(heard)
    if not everything:
        return None
    first = everything[0].time
    for seconds in SECONDS:
        limit = first + seconds * 1_000_000_000
        items = [item for item in everything if item.time <= limit]
        said = {(finding.code, finding.subject.split(",")[0]) for finding in findings_of(items, session)}
        if said.issuperset(case.expect):
            return session, items
    return None


def make(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for case in CASES:
        found = shortest(case)
        name = re.sub(r"[^a-z0-9]+", "-", case.name.lower()).strip("-")
        if found is None:
            print(f"{name}: not shown within {SECONDS[-1]} s")
            continue
        session, items = found
        path = folder / f"{name}.cap.txt"
        shift = STARTED - session.started
        with create(path, replace(session, started=STARTED, notes={})) as writer:
            for item in items:
                writer.write(replace(item, time=item.time + shift))
        size = path.stat().st_size
        if size > LARGEST:
            path.unlink()
        print(f"{name}: {size} octets{' (too large, left out)' if size > LARGEST else ''}", flush=True)


if __name__ == "__main__":
    make(Path(sys.argv[1]))
