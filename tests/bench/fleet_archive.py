"""A site's archive made by the virtual bus: 40 buses of all protocols, five days, twelve of them with known faults that
begin, and some that end, on known days. Made, judged by the command, and compared.

    python -m tests.bench.fleet_archive [--folder DIR] [--seconds 120] [--workers N] [--html FILE]

Prints what is wrong in the report (nothing, if all is well), and the CPU seconds of making and of judging. With
`--folder` the archive stays there, and is taken as it is when it is there already.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from sniff.fleet.answer import answer
from sniff.fleet.archive import files_below, tasks_of
from sniff.fleet.bus_day import Archive
from sniff.fleet.index import NAME, Index
from tests.faults.case import Case
from tests.faults.clean_cases import CLEAN, clean_cases
from tests.sniff.fleet.made_archive import SITES, Plan, case, clean, write, wrong_in, wrong_in_json

BUSES, DAYS = 40, 5

FAULTS: dict[str, range] = {
    "RTU station absent": range(1, 5),
    "RTU bit errors of one station": range(2, 3),
    "RTU two masters": range(3, 5),
    "ASCII answers lost": range(2, 5),
    "ASCII answered twice": range(1, 2),
    "N2 station absent": range(4, 5),
    "N2 bit errors of one station": range(1, 3),
    "MS/TP silent drive": range(2, 5),
    "MS/TP lost token": range(3, 5),
    "PROFIBUS station absent": range(1, 4),
    "PROFIBUS answers lost": range(4, 5),
    "PROFIBUS address twice": range(2, 5),
}
"""Fault → on which of the five days."""


def plans(seconds: float) -> list[Plan]:
    """The forty buses."""
    made = []
    for number, (name, ill) in enumerate(FAULTS.items()):
        well = clean(f"{name.split()[0]} clean, exact", seconds)
        made.append(Plan(SITES[number % 3], f"ill-{number:02}", well, case(name), ill))
    well_ones = _well_ones(seconds)
    for number in range(len(made), BUSES):
        made.append(Plan(SITES[number % 3], f"well-{number:02}", next(well_ones)))
    return made


def _well_ones(seconds: float) -> Iterator[Case]:
    """All kinds of clean buses, each through another adapter, then once more through the next."""
    made = {one.name: one for one in clean_cases(seconds)}
    for again in range(3):
        for place, kind in enumerate(CLEAN):
            yield made[f"{kind.name}, {kind.adapters[(place + again) % len(kind.adapters)].name}"]


def main() -> int:
    """See above."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--seconds", type=float, default=120)
    parser.add_argument("--workers", default="2")
    parser.add_argument("--html")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = args.folder or Path(temporary)
        planned = plans(args.seconds)
        began = time.process_time()
        for plan in planned:
            for day in range(DAYS):
                if not (folder / plan.site / plan.bus / f"day-{day + 1}.mcap").exists():
                    write(folder, plan, day, args.seconds)
        print(f"made in {time.process_time() - began:.0f} s of a core")
        return _judged(folder, planned, args)


def _judged(folder: Path, planned: list[Plan], args: argparse.Namespace) -> int:
    (folder / NAME).unlink(missing_ok=True)
    command = [sys.executable, "-m", "sniff", "fleet", str(folder), "--json", "--workers", args.workers]
    command += ["--html", args.html, "-f"] if args.html else []
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=False)
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(f"judged in {spent.ru_utime + spent.ru_stime:.0f} s of cores, exit code {done.returncode}")
    archive, index = Archive(), Index(folder / NAME)
    for _, days in index.known(tasks_of(files_below([str(folder)]))[0]):
        for day in days or ():
            archive.add(day)
    wrong = [*wrong_in(answer(archive), archive, planned), *wrong_in_json(done.stdout, planned)]
    for sentence in wrong:
        print(sentence)
    print(f"{len(planned)} buses × {DAYS} days: {len(wrong)} sentences wrong or missing")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
