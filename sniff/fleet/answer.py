"""The answer of an archive: its buses, the worst first, day by day, and what changed over the days. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from datetime import date, timedelta
from enum import Enum

from dissectors.findings import Finding, Severity, merged
from dissectors.histogram import Histogram
from dissectors.tracker import Verdict
from sniff.analysis.health import Health
from sniff.analysis.nodes import Node
from sniff.fleet.bus_day import NO_DATE, Archive, BusDay

DRIFTED = 1.25
"""A station's median response time has drifted when it grew, or shrank, by this factor …"""

DRIFT_DAYS = 3
"""… from the first of so many days to the last …"""

DRIFT_ANSWERS = 50
"""… with so many answers in each half of them, by more than the adapters may have added."""


class Fresh(Enum):
    """What became of a finding since the run before."""

    NEW = "new"
    STAYS = "stays"
    UNKNOWN = ""  # there was no run before


@dataclass(frozen=True, slots=True)
class Day:
    """One day of a bus in numbers. Times are ns, shares 0 … 1."""

    day: str
    health: Health
    load: float
    frames: int
    octets: int
    damaged: float
    unanswered: float
    response: Histogram
    stations: tuple[int, ...]
    listened: int

    @property
    def is_silent(self) -> bool:
        """Whether nothing was heard although somebody recorded."""
        return not self.octets


@dataclass(frozen=True, slots=True)
class Trouble:
    """A finding over all days of a bus. `days`: on which it was found, ascending."""

    finding: Finding
    days: tuple[str, ...]
    fresh: Fresh = Fresh.UNKNOWN


class Change(Enum):
    """What happened to a station over the days."""

    CAME = "came"
    WENT = "went"
    SLOWER = "slower"
    FASTER = "faster"


@dataclass(frozen=True, slots=True)
class StationChange:
    """One of them. `day`: the first day with it, or the last; `before`, `after`: median response times, ns."""

    station: int
    change: Change
    day: str
    before: int | None = None
    after: int | None = None


@dataclass(frozen=True, slots=True)
class Bus:
    """One bus of a site over all days. `missing`: days between others of which there is no capture."""

    site: str
    bus: str
    protocol: str
    noun: str
    days: tuple[Day, ...]
    health: Health
    troubles: tuple[Trouble, ...]
    changes: tuple[StationChange, ...]
    missing: tuple[str, ...]
    notes: tuple[str, ...]
    latency: int

    @property
    def name(self) -> str:
        """For people: "north/boiler-room"."""
        return f"{self.site}/{self.bus}" if self.site else self.bus

    @property
    def worst(self) -> Day:
        """The day with the lowest health, the latest of equal ones."""
        return min(reversed(self.days), key=lambda day: day.health.score)

    @property
    def is_silent(self) -> bool:
        """Whether nothing was heard on any day."""
        return all(day.is_silent for day in self.days)


@dataclass(frozen=True, slots=True)
class Answer:
    """The whole archive. `gone`: findings that the run before named and this one does not."""

    buses: tuple[Bus, ...]
    unreadable: Mapping[str, str] = field(default_factory=dict)
    gone: tuple[str, ...] = ()


def answer(archive: Archive, before: Iterable[str] | None = None, noun: Mapping[str, str] | None = None) -> Answer:
    """Put everything together. `before`: marks of what an earlier run named; `noun`: what a protocol's people call a
    station."""
    known = None if before is None else set(before)
    by_bus: dict[tuple[str, str, str], list[BusDay]] = {}
    for day in archive.days.values():
        by_bus.setdefault((day.site, day.bus, day.protocol), []).append(day)
    buses = [_bus(sorted(days, key=lambda day: day.day), known, noun or {}) for days in by_bus.values()]
    buses.sort(key=lambda bus: (bus.health.score, -sum(len(one.days) for one in bus.troubles), bus.name))
    found = Answer(tuple(buses), dict(sorted(archive.unreadable.items())))
    if known is None:
        return found
    return Answer(found.buses, found.unreadable, tuple(sorted(known - marks(found))))


def marks(found: Answer) -> set[str]:
    """What a run names, for the next run to compare with."""
    return {mark(bus, trouble.finding) for bus in found.buses for trouble in bus.troubles}


def mark(bus: Bus, finding: Finding) -> str:
    """Bus, rule and subject of a finding as one word."""
    return f"{bus.name}: {finding.code} {finding.subject}"


def _bus(days: list[BusDay], known: set[str] | None, noun: Mapping[str, str]) -> Bus:
    newest = days[-1]
    told = tuple(_day(day) for day in days)
    bus = Bus(
        newest.site,
        newest.bus,
        newest.protocol,
        noun.get(newest.protocol, "station"),
        told,
        min((day.health for day in reversed(told)), key=lambda health: health.score),
        (),
        _changes(days),
        _missing([day.day for day in days]),
        tuple(sorted({note for day in days for note in day.notes})),
        max(day.latency for day in days),
    )
    return _with_troubles(bus, days, known)


def _with_troubles(bus: Bus, days: list[BusDay], known: set[str] | None) -> Bus:
    troubles = []
    for finding in merged(day.findings for day in days):
        if finding.severity < Severity.WARNING:
            continue
        on = tuple(day.day for day in days if any(one.key == finding.key for one in day.findings))
        fresh = Fresh.UNKNOWN if known is None else Fresh.STAYS if mark(bus, finding) in known else Fresh.NEW
        troubles.append(Trouble(finding, on, fresh))
    return replace(bus, troubles=tuple(troubles))


def _day(day: BusDay) -> Day:
    summary = day.summary
    asked = sum(node.asked for node in summary.nodes)
    unanswered = sum(node.unanswered for node in summary.nodes)
    return Day(
        day.day,
        day.health().bus,
        day.load,
        summary.frames,
        summary.octets,
        summary.damaged / summary.frames if summary.frames else 0.0,
        unanswered / asked if asked else 0.0,
        summary.latency,
        tuple(sorted(node.address for node in summary.nodes if _is_there(node))),
        day.listened,
    )


def _is_there(node: Node) -> bool:
    """Whether a station said something: damage can name one that there is not."""
    return node.heard >= 2 or any(node.verdicts[verdict] for verdict in (Verdict.ANSWERED, Verdict.EXCEPTION))


def _missing(told: list[str]) -> tuple[str, ...]:
    days = [day for day in told if day != NO_DATE]
    if not days:
        return ()
    first, last = date.fromisoformat(days[0]), date.fromisoformat(days[-1])
    there, found = set(days), []
    for number in range(1, min((last - first).days, 4000)):
        day = (first + timedelta(days=number)).isoformat()
        if day not in there:
            found.append(day)
    return tuple(found)


def _changes(days: list[BusDay]) -> tuple[StationChange, ...]:
    """Stations that came, that went, and whose response times drifted."""
    heard = [day for day in days if day.summary.octets]
    if len(heard) < 2:
        return ()
    by_station: dict[int, list[tuple[str, Node]]] = {}
    for day in heard:
        for node in day.summary.nodes:
            if _is_there(node):
                by_station.setdefault(node.address, []).append((day.day, node))
    found = []
    for station, seen in sorted(by_station.items()):
        first, last = seen[0][0], seen[-1][0]
        if first != heard[0].day:
            found.append(StationChange(station, Change.CAME, first))
        if last != heard[-1].day:
            found.append(StationChange(station, Change.WENT, last))
        drift = _drift(station, seen, max(day.latency for day in heard))
        if drift is not None:
            found.append(drift)
    return tuple(found)


def _drift(station: int, seen: list[tuple[str, Node]], latency: int) -> StationChange | None:
    if len(seen) < DRIFT_DAYS:
        return None
    half = len(seen) // 2
    early, late = _together(seen[:half]), _together(seen[-half:])
    before, after = early.quantile(0.5), late.quantile(0.5)
    if min(early.count, late.count) < DRIFT_ANSWERS or before is None or after is None:
        return None
    if abs(after - before) <= latency or not (after > DRIFTED * before or before > DRIFTED * after):
        return None
    return StationChange(station, Change.SLOWER if after > before else Change.FASTER, seen[half][0], before, after)


def _together(seen: list[tuple[str, Node]]) -> Histogram:
    whole = Histogram()
    for _, node in seen:
        whole = whole.merge(node.latency)
    return whole
