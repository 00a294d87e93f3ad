"""An archive made by the virtual bus: sites, buses, days; some buses have a fault from a known day on."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from sniff.engine.session import LineEvent, Session
from sniff.recording.writer import create
from tests.faults.case import Case
from tests.faults.cases import CASES
from tests.faults.clean_cases import clean_cases

NS_PER_S = 1_000_000_000
FIRST_DAY = 1_772_323_200 * NS_PER_S
"""2026-03-01T00:00:00Z."""

FAULTS = (
    "RTU station absent",
    "RTU station with wrong address",
    "RTU bit errors everywhere",
    "RTU answered twice",
    "ASCII station absent",
    "ASCII answers lost",
)
CLEAN = ("RTU clean", "ASCII clean", "N2 clean", "MS/TP clean")


@dataclass(frozen=True, slots=True)
class Plan:
    """One bus: how it is when well, and which fault it has from which day on (None: never)."""

    site: str
    bus: str
    well: Case
    fault: Case | None = None
    since: int = 0


def case(name: str) -> Case:
    """A fault of the matrix by its name."""
    return next(one for one in CASES if one.name == name)


def clean(name: str, seconds: float) -> Case:
    """A clean bus, heard exactly."""
    return next(one for one in clean_cases(seconds) if one.name == f"{name}, exact")


def plans(count: int, faults: Iterable[str], days: int, seconds: float) -> list[Plan]:
    """So many buses of all protocols at three sites; the first have the faults, each from another day on."""
    wrong = [case(name) for name in faults]
    made = []
    for number in range(count):
        site, bus = ("north", "south", "harbour")[number % 3], f"trunk-{number:02}"
        fault = wrong[number] if number < len(wrong) else None
        kind = fault.name.split()[0] if fault is not None else None
        names = [name for name in CLEAN if kind is None or name.startswith(kind)] or ["RTU clean"]
        made.append(Plan(site, bus, clean(names[number % len(names)], seconds), fault, 1 + number % max(1, days - 1)))
    return made


def write(folder: Path, plan: Plan, day: int, seconds: float) -> Path:
    """One day of a bus as a recording: some seconds of it, in the morning."""
    of_day = plan.fault if plan.fault is not None and day >= plan.since else plan.well
    session, items = of_day.hear(of_day.make(seed=100 * day + hash_of(plan.bus)), seconds, of_day.tap)
    begin = FIRST_DAY + day * 86_400 * NS_PER_S + 8 * 3600 * NS_PER_S
    listed = list(items)
    shift = begin - (listed[0].time if listed else 0)
    path = folder / plan.site / plan.bus / f"day-{day + 1}.mcap"
    path.parent.mkdir(parents=True, exist_ok=True)
    with create(path, _named(session, plan, begin)) as out:
        for item in listed:
            moved: LineEvent | object = replace(item, time=item.time + shift)
            out.write(moved)  # type: ignore[arg-type]
    return path


def hash_of(name: str) -> int:
    """A small number for a name, the same in every process."""
    return sum(name.encode()) % 97


def _named(session: Session, plan: Plan, begin: int) -> Session:
    return replace(session, bus=plan.bus, port=f"/dev/{plan.bus}", started=begin)
