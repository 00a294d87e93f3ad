"""An archive made by the virtual bus: sites, buses, days; some buses have a fault on known days, the others none."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from sniff.analysis.judging import all_rules
from sniff.engine.session import LineEvent, Session
from sniff.fleet.answer import Answer
from sniff.fleet.bus_day import Archive
from sniff.recording.mcap_writer import create
from sniff.simulation.tap import TapModel
from tests.faults.case import Case, Said
from tests.faults.cases import CASES
from tests.faults.clean_cases import clean_cases

NS_PER_S = 1_000_000_000
FIRST_DAY = 1_772_323_200 * NS_PER_S
"""2026-03-01T00:00:00Z."""

SITES = ("north", "south", "harbour")

FAULTS = (
    "RTU station absent",
    "RTU answered twice",
    "ASCII answers lost",
    "N2 station absent",
    "MS/TP silent drive",
    "PROFIBUS station absent",
)
CLEAN = ("RTU clean", "ASCII clean", "N2 clean", "MS/TP clean", "PROFIBUS clean")


@dataclass(frozen=True, slots=True)
class Plan:
    """One bus: how it is when well, and which fault it has on which days (from 0; `fault` None: never)."""

    site: str
    bus: str
    well: Case
    fault: Case | None = None
    ill: range = range(0)

    def on(self, day: int) -> Case:
        """How it is on a day."""
        return self.fault if self.fault is not None and day in self.ill else self.well

    @property
    def ill_days(self) -> list[str]:
        """Days with the fault as the report writes them."""
        return [date(day) for day in self.ill]


def date(day: int) -> str:
    """The day's name in a report."""
    return f"2026-03-{day + 1:02}"


def case(name: str) -> Case:
    """A fault of the matrix by its name."""
    return next(one for one in CASES if one.name == name)


def clean(name: str, seconds: float) -> Case:
    """A clean bus, as the matrix calls it: "RTU clean, brisk, FTDI 16 ms"."""
    return next(one for one in clean_cases(seconds) if one.name == name)


def plans(count: int, faults: Iterable[str], days: int, seconds: float, kinds: Sequence[str] = CLEAN) -> list[Plan]:
    """So many buses of all `kinds` at three sites; the first have the faults, each from another day on, every third
    for one day only."""
    wrong = [case(name) for name in faults]
    made = []
    for number in range(count):
        site, bus = SITES[number % 3], f"trunk-{number:02}"
        fault = wrong[number] if number < len(wrong) else None
        kind = fault.name.split()[0] if fault is not None else None
        names = [name for name in kinds if kind is None or name == f"{kind} clean"] or ["RTU clean"]
        since = 1 + number % max(1, days - 1)
        until = since + 1 if number % 3 == 2 else days
        ill = range(since, until) if fault is not None else range(0)
        made.append(Plan(site, bus, clean(f"{names[number % len(names)]}, exact", seconds), fault, ill))
    return made


def write(folder: Path, plan: Plan, day: int, seconds: float, tap: TapModel | None = None) -> Path:
    """One day of a bus as a recording: some seconds of it, in the morning, through `tap` (default: as the case has)."""
    of_day = plan.on(day)
    session, items = of_day.hear(of_day.make(seed=100 * day + hash_of(plan.bus)), seconds, tap or of_day.tap)
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


def wrong_in(found: Answer, archive: Archive, planned: Iterable[Plan]) -> Iterator[str]:
    """What an answer says that is not so, or does not say: a sentence each. Exactly the ill buses must be named, each
    with its fault on exactly its days, and nobody beside whom the fault struck."""
    rules = all_rules()
    told = {(bus.site, bus.bus): bus for bus in found.buses}
    for plan in planned:
        bus = told.pop((plan.site, plan.bus), None)
        if bus is None:
            yield f"{plan.bus} is missing"
            continue
        name = f"{plan.bus} ({plan.fault.name if plan.fault is not None else plan.well.name})"
        for trouble in bus.troubles:
            innocent = plan.fault is None or not _may_say(plan.fault, trouble.finding.subject, trouble.finding.code)
            strange = [day for day in trouble.days if innocent or day not in plan.ill_days]
            if strange:
                yield f"{name}: {trouble.finding.code} {trouble.finding.subject} on {strange}: {trouble.finding.seen}"
        if plan.fault is None:
            yield from (f"{name}: {change}" for change in bus.changes)
            continue
        if not bus.troubles:
            yield f"{name}: nothing is said"
        for said in plan.fault.wanted:
            days = [
                day.day
                for day in sorted(archive.days.values(), key=lambda one: one.day)
                if (day.site, day.bus) == (plan.site, plan.bus)
                and any(said.fits(one, rules.get(one.code)) for one in day.findings)
            ]
            if days != plan.ill_days:
                yield f"{name}: {said} on {days}, not on {plan.ill_days}"
    yield from (f"{bus.name} does not exist" for bus in told.values())


def _may_say(fault: Case, subject: str, code: str) -> bool:
    return subject.split(",")[0] in fault.about or code in fault.also


def wrong_in_json(lines: str, planned: Iterable[Plan]) -> Iterator[str]:
    """The same of what the command printed, as far as it goes: which buses, which subjects, which days."""
    said: Mapping[str, Any] = {one["bus"]: one for one in map(json.loads, lines.splitlines()) if "bus" in one}
    for plan in planned:
        findings = said[plan.bus]["findings"]
        days = sorted({day for one in findings for day in one["days"]})
        if days != plan.ill_days:
            yield f"{plan.bus}: findings on {days}, not on {plan.ill_days}"
        wanted: tuple[Said, ...] = plan.fault.wanted if plan.fault is not None else ()
        subjects = {subject for one in wanted for subject in one.subjects}
        if plan.fault is not None and not subjects & {one["subject"].split(",")[0] for one in findings}:
            yield f"{plan.bus}: none of {subjects} is named"
