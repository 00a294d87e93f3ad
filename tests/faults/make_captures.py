"""Makes `captures/findings`: for each case of the matrix the shortest run that shows its findings.

python -m tests.faults.make_captures captures/findings && pytest --sniff-update captures

Further words choose cases by name, those of FURTHER_CASES too. The same code gives the same files.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from sniff.analysis.judging import rules_over
from sniff.bus.capture_writer import create
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import DEVICES_NOTE, Item, Session
from tests.faults.case import Case
from tests.faults.cases import CASES, FURTHER_CASES
from tests.faults.judged import findings_of

SECONDS = (1, 2, 3, 5, 8, 12, 20, 30, 45, 60, 120, 300, 660)
STARTED = 1_772_359_200 * 1_000_000_000
LARGEST = 160_000
"""Octets of a capture file: a larger one is left to the matrix."""


def shortest(case: Case) -> tuple[Session, list[Item]] | None:
    """The session and the items of the shortest stretch from the start that shows all that is expected."""
    session, heard = case.hear(case.make(seed=1), case.seconds, case.tap)
    everything = list(heard)
    rules = rules_over(dissector_for(session))
    first = everything[0].time if everything else 0
    for seconds in SECONDS:
        limit = first + seconds * 1_000_000_000
        items = [item for item in everything if item.time <= limit]
        findings = findings_of(session, items)
        if all(any(said.fits(one, rules.get(one.code)) for one in findings) for said in case.wanted):
            return session, items
    return None


def file_name(case: Case) -> str:
    """Name of the capture of a case."""
    return re.sub(r"[^a-z0-9]+", "-", case.name.lower()).strip("-") + ".cap.txt"


def make(folder: Path, words: Sequence[str] = ()) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for case in (*CASES, *FURTHER_CASES) if words else CASES:
        if words and not any(word.lower() in case.name.lower() for word in words):
            continue
        found = shortest(case)
        path = folder / file_name(case)
        if found is None:
            print(f"{path.name}: not shown within {SECONDS[-1]} s")
            continue
        session, items = found
        shift = STARTED - session.started
        devices = {key: value for key, value in session.notes.items() if key == DEVICES_NOTE}
        with create(path, replace(session, started=STARTED, notes=devices)) as writer:
            for item in items:
                writer.write(replace(item, time=item.time + shift))
        size = path.stat().st_size
        if size > LARGEST:
            path.unlink()
        print(f"{path.name}: {size} octets{' (too large, left out)' if size > LARGEST else ''}", flush=True)


if __name__ == "__main__":
    make(Path(sys.argv[1]), sys.argv[2:])
