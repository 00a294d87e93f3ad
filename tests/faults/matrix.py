"""Runs cases of the matrix and prints them as a table: `python -m tests.faults.matrix`, or `make faults`.

Words choose cases by their names. Cases run on all cores; progress goes to standard error, the table to standard
output.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache

from tests.faults.case import Case
from tests.faults.cases import CASES, FURTHER_CASES
from tests.faults.clean_cases import clean_cases
from tests.faults.judged import Outcome, run

RECALL = 0.95
"""Least share of the runs with a fault in which it must be found."""


@dataclass(frozen=True, slots=True)
class Job:
    """One run: the case's place among `every_case(minutes)`, and the seed."""

    place: int
    seed: int
    minutes: float


@dataclass(frozen=True, slots=True)
class Done:
    """What came of a job, as far as it is told of, and how long it took, s."""

    job: Job
    missed: tuple[str, ...]
    accused: tuple[str, ...]
    mistaken: tuple[str, ...]
    graves: tuple[str, ...]
    unneeded: tuple[str, ...]
    notes: tuple[str, ...]
    sentences: tuple[str, ...]
    took: float


@cache
def every_case(minutes: float) -> tuple[Case, ...]:
    """All faults, then all clean buses, each heard for that many minutes."""
    return (*CASES, *FURTHER_CASES, *clean_cases(60 * minutes))


def work(job: Job) -> Done:
    """Run one job; called in a process of its own."""
    began = time.monotonic()
    case = every_case(job.minutes)[job.place]
    try:
        outcome = run(case, job.seed)
    except Exception as error:  # a rule that raises is one more thing to tell of, and the table must go on
        outcome = Outcome(case.name, job.seed, (), (), (), (f"raised {type(error).__name__}: {error}",))
    took = time.monotonic() - began
    return Done(
        job,
        outcome.missed,
        outcome.accused,
        outcome.mistaken,
        outcome.graves,
        outcome.unneeded,
        outcome.notes,
        outcome.sentences,
        took,
    )


def jobs_of(words: Sequence[str], minutes: float, seeds: int) -> list[Job]:
    """What there is to do."""
    return [
        Job(place, seed, minutes)
        for place, case in enumerate(every_case(minutes))
        if not words or any(word.lower() in case.name.lower() for word in words)
        for seed in range(1, min(seeds, case.seeds if case.expect else 1) + 1)
    ]


def done(jobs: Sequence[Job], processes: int) -> Iterator[Done]:
    """The results, in the order of the jobs."""
    if processes <= 1:
        yield from map(work, jobs)
        return
    with multiprocessing.get_context("spawn").Pool(processes) as pool:
        yield from pool.imap(work, jobs)


class Table:
    """Prints one line a case as soon as its last run is there, and adds up."""

    def __init__(self, jobs: Sequence[Job], tells: bool = False) -> None:
        self._tells = tells
        self._left = {job.place: sum(other.place == job.place for other in jobs) for job in jobs}
        self._of: dict[int, list[Done]] = {}
        self.faults = self.clean = self.runs = self.found = self.graves = 0
        self.accusations: list[str] = []
        self.about_bus: list[str] = []
        self.false_alarms: list[str] = []

    def add(self, result: Done) -> None:
        """Take the next result."""
        place = result.job.place
        results = self._of.setdefault(place, [])
        results.append(result)
        if len(results) == self._left[place]:
            self._print(every_case(result.job.minutes)[place], self._of.pop(place))

    def _print(self, case: Case, results: list[Done]) -> None:
        good = sum(not (one.missed or one.accused or one.mistaken) for one in results)
        accused = sorted({what for one in results for what in one.accused})
        mistaken = sorted({what for one in results for what in one.mistaken})
        missed = sorted({what for one in results for what in one.missed})
        if case.expect:
            self.faults += 1
            self.runs += len(results)
            self.found += sum(not one.missed for one in results)
            self.graves += sum(len(one.graves) for one in results)
            self.about_bus += [f"{case.name}: {what}" for what in sorted({w for one in results for w in one.unneeded})]
            self.accusations += [f"{case.name}: {what}" for what in (*accused, *mistaken)]
        else:
            self.clean += 1
            self.false_alarms += [f"{case.name}: {what}" for what in (*accused, *mistaken)]
        said = ", ".join(sorted({what for one in results for what in one.graves})) or "nothing"
        trouble = [f"missed {what}" for what in missed]
        trouble += [f"innocent accused: {what}" for what in accused] + [f"wrong: {what}" for what in mistaken]
        took = sum(one.took for one in results)
        print(f"{good}/{len(results)}  {case.name:<44} {took:6.1f} s  said {said}", flush=True)
        for what in trouble:
            print(f"       {what}", flush=True)
        notes = sorted({what for one in results for what in one.notes})
        if missed and notes:
            print(f"       (notes: {', '.join(notes)})", flush=True)
        if self._tells:
            for sentence in results[0].sentences:
                print(f"         {sentence}", flush=True)

    def close(self) -> int:
        """Print what it adds up to; give the exit code."""
        recall = self.found / self.runs if self.runs else 1.0
        print(f"\n{self.faults} cases with a fault, {self.runs} runs, recall {recall:.1%}")
        if self.runs:
            print(f"{self.graves / self.runs:.2f} findings at warning or above a run (one cause, one finding: 1.00)")
        print(f"{len(self.accusations)} accusations of innocents or wrong errors")
        for what in self.accusations:
            print(f"  {what}")
        print(f"{len(self.about_bus)} warnings about the bus where one station, or the capture, is to blame")
        for what in self.about_bus:
            print(f"  {what}")
        print(f"{self.clean} clean buses, {len(self.false_alarms)} false alarms")
        for what in self.false_alarms:
            print(f"  {what}")
        return int(recall < RECALL or bool(self.accusations) or bool(self.false_alarms))


def main(words: list[str]) -> int:
    """Print the whole table. Exit code 1 below 95 in 100, or with anybody accused wrongly."""
    parser = argparse.ArgumentParser(prog="python -m tests.faults.matrix", description=__doc__)
    parser.add_argument("words", nargs="*", help="parts of names of cases; all cases without any")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes (default: one a core)")
    parser.add_argument("--clean-minutes", type=float, default=60, help="how long clean buses are heard (default: 60)")
    parser.add_argument("--seeds", type=int, default=3, help="most runs of one case (default: 3)")
    parser.add_argument("--tell", action="store_true", help="print every finding of the first run in full")
    wanted = parser.parse_args(words)
    jobs = jobs_of(wanted.words, wanted.clean_minutes, wanted.seeds)
    table = Table(jobs, wanted.tell)
    for count, result in enumerate(done(jobs, min(wanted.jobs, len(jobs))), 1):
        sys.stderr.write(f"\r{count}/{len(jobs)} runs\033[K")
        sys.stderr.flush()
        table.add(result)
    sys.stderr.write("\r\033[K")
    return table.close()


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
