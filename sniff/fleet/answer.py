"""The answer of an archive: its buses, the ill ones first, day by day, and what changed over the days. Pure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from datetime import date, timedelta
from enum import Enum
from itertools import pairwise

from dissectors.findings import Finding, Severity, merged
from dissectors.histogram import Histogram
from dissectors.tracker import Verdict
from sniff.analysis.health import Health
from sniff.analysis.nodes import Node
from sniff.fleet.bus_day import NO_DATE, Archive, BusDay
from sniff.fleet.drift import Drift, drift


class Fresh(Enum):
    """What became of a finding since the run before."""

    NEW = "new"
    STAYS = "stays"
    UNKNOWN = ""  # there was no run before


@dataclass(frozen=True, slots=True)
class Day:
    """One day of a bus in numbers. Times are ns, shares 0 … 1; `load`: None where nobody knows."""

    day: str
    health: Health
    load: float | None
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
    """A finding over all days of a bus. `days`: on which it was found, ascending. `alike`: further ones of its rule
    about the same station that it stands for (other requests, say), on the day with most."""

    finding: Finding
    days: tuple[str, ...]
    fresh: Fresh = Fresh.UNKNOWN
    alike: int = 0


class Change(Enum):
    """What happened to a station over the days."""

    CAME = "came"
    WENT = "went"
    SLOWER = "slower"
    FASTER = "faster"


@dataclass(frozen=True, slots=True)
class StationChange:
    """One of them. `day`: the first day with it, or the last; `drift`: of one that got slower or faster."""

    station: int
    change: Change
    day: str
    drift: Drift | None = None


@dataclass(frozen=True, slots=True)
class Bus:
    """One bus of a site over all days. `missing`: days between others of which there is no capture; `stopped`: the last
    day with one, where others go on. `drifts`: response times over the days, of every station that has enough."""

    site: str
    bus: str
    protocol: str
    noun: str
    days: tuple[Day, ...]
    health: Health
    troubles: tuple[Trouble, ...]
    changes: tuple[StationChange, ...]
    drifts: tuple[Drift, ...]
    missing: tuple[str, ...]
    stopped: str | None
    notes: tuple[str, ...]
    latency: int

    @property
    def name(self) -> str:
        """For people: "north/boiler-room"."""
        return f"{self.site}/{self.bus}" if self.site else self.bus

    @property
    def is_ill(self) -> bool:
        """Whether something is wrong with it, or with its recording."""
        return bool(self.troubles or self.silent or self.stopped)

    @property
    def silent(self) -> tuple[str, ...]:
        """Days on which somebody recorded and nothing was heard."""
        return tuple(day.day for day in self.days if day.is_silent)

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
    newest = max((day.day for day in archive.days.values() if day.day != NO_DATE), default=NO_DATE)
    buses = [_bus(sorted(days, key=lambda day: day.day), newest, known, noun or {}) for days in by_bus.values()]
    buses.sort(
        key=lambda bus: (not bus.is_ill, bus.health.score, -sum(len(one.days) for one in bus.troubles), bus.name)
    )
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


def _bus(days: list[BusDay], newest: str, known: set[str] | None, noun: Mapping[str, str]) -> Bus:
    last = days[-1]
    findings = [day.findings for day in days]
    told = tuple(_day(day, found) for day, found in zip(days, findings, strict=True))
    dated = [day.day for day in days if day.day != NO_DATE]
    missing = _missing(dated)
    latency = max(day.latency for day in days)
    drifts = _drifts(days)
    bus = Bus(
        last.site,
        last.bus,
        last.protocol,
        noun.get(last.protocol, "station"),
        told,
        min((day.health for day in reversed(told)), key=lambda health: health.score),
        (),
        tuple(sorted((*_changes(days), *_told_drifts(drifts, latency)), key=lambda one: one.station)),
        drifts,
        missing,
        _stopped(dated, newest),
        tuple(sorted({note for day in days for note in day.notes})),
        latency,
    )
    return replace(bus, troubles=tuple(_troubles(bus, findings, known)))


def _troubles(bus: Bus, findings: list[tuple[Finding, ...]], known: set[str] | None) -> Iterator[Trouble]:
    on: dict[tuple[str, str], Counter[str]] = {}
    for day, found in zip(bus.days, findings, strict=True):
        for one in found:
            if one.severity >= Severity.WARNING:  # on other days it may be a consequence, and is told with its cause
                on.setdefault(one.key, Counter())[day.day] += 1
    for finding in merged([one for one in found if one.key in on] for found in findings):
        fresh = Fresh.UNKNOWN if known is None else Fresh.STAYS if mark(bus, finding) in known else Fresh.NEW
        days = on[finding.key]
        yield Trouble(finding, tuple(days), fresh, max(days.values()) - 1)


def _day(day: BusDay, findings: tuple[Finding, ...]) -> Day:
    summary = day.summary
    asked = sum(node.asked for node in summary.nodes)
    unanswered = sum(node.unanswered for node in summary.nodes)
    return Day(
        day.day,
        day.health(findings).bus,
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


def _missing(days: list[str]) -> tuple[str, ...]:
    if not days:
        return ()
    first, last = date.fromisoformat(days[0]), date.fromisoformat(days[-1])
    there, found = set(days), []
    for number in range(1, min((last - first).days, 4000)):
        day = (first + timedelta(days=number)).isoformat()
        if day not in there:
            found.append(day)
    return tuple(found)


def _stopped(days: list[str], newest: str) -> str | None:
    """The last day, where others were recorded for longer after it than this one ever paused."""
    if len(days) < 2:
        return None
    numbers = [date.fromisoformat(day).toordinal() for day in days]
    pause = max(later - earlier for earlier, later in pairwise(numbers))
    return days[-1] if date.fromisoformat(newest).toordinal() - numbers[-1] > pause else None


def _changes(days: list[BusDay]) -> Iterator[StationChange]:
    """Stations that came and that went."""
    heard = [day for day in days if day.summary.octets]
    seen: dict[int, list[str]] = {}
    for day in heard:
        for node in day.summary.nodes:
            if _is_there(node):
                seen.setdefault(node.address, []).append(day.day)
    for station, on in seen.items():
        if on[0] != heard[0].day:
            yield StationChange(station, Change.CAME, on[0])
        if on[-1] != heard[-1].day:
            yield StationChange(station, Change.WENT, on[-1])


def _drifts(days: list[BusDay]) -> tuple[Drift, ...]:
    times: dict[int, list[tuple[str, Histogram]]] = {}
    for day in days:
        for node in day.summary.nodes:
            if day.day != NO_DATE and _is_there(node):
                times.setdefault(node.address, []).append((day.day, node.latency))
    found = (drift(station, of_days) for station, of_days in sorted(times.items()))
    return tuple(one for one in found if one is not None)


def _told_drifts(drifts: Iterable[Drift], latency: int) -> Iterator[StationChange]:
    for one in drifts:
        if one.is_told(latency):
            change = Change.SLOWER if one.after > one.before else Change.FASTER
            yield StationChange(one.station, change, one.since, one)
