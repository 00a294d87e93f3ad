"""One bus on one day: the unit of everything that a fleet's report says; mergeable."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache, reduce
from pathlib import PurePath

from dissectors import registry
from dissectors.findings import Finding, Rule
from dissectors.line import LineSettings
from sniff.analysis.health import HealthReport, health_of
from sniff.analysis.judgement import Judgement
from sniff.analysis.judging import rules_over
from sniff.analysis.summary import Summary
from sniff.analysis.wording import station_word

NO_DATE = "no date"
"""The day of captures whose times only count from their begin."""

Key = tuple[str, str, str, str]
"""Site, bus, protocol, day."""


@dataclass(frozen=True, slots=True, order=True)
class Judged:
    """What the rules found in one capture or a stretch of it, which began at `first` (ns), from the file `source`."""

    first: int
    source: str
    judgement: Judgement = field(compare=False)


@dataclass(frozen=True, slots=True)
class BusDay:
    """One bus on one day of UTC, from one capture or several.

    `site`, `bus`, `port`, `protocol`: which; `day`: "2026-03-01". `summary`: counts, stations, response times; its load
    is only a total. `busy`: ns with octets on the line, `listened`: ns between first and last octet without holes, of
    all captures together that say when anything came; `first`, `last`: when that was. `latency`: ns that the slowest
    adapter may have held octets back. `sources`: the files. `notes`: what was wrong with them, in words. `judged`: of
    each capture, in any order.
    """

    site: str
    bus: str
    port: str
    protocol: str
    day: str
    line: str
    summary: Summary
    busy: int = 0
    listened: int = 0
    first: int | None = None
    last: int | None = None
    judged: tuple[Judged, ...] = ()
    latency: int = 0
    sources: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def key(self) -> Key:
        """Of what two of them are merged: one bus speaks one protocol, and one name may be given at two sites."""
        return self.site, self.bus, self.protocol, self.day

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Of the rules, put together from all captures in the order of time; what explains what is settled over all."""
        whole = reduce(Judgement.merge, (one.judgement for one in sorted(self.judged)), Judgement())
        return whole.findings(_rules(self.protocol))

    @property
    def load(self) -> float | None:
        """Bus load while somebody listened, 0 … 1; None where nobody knows for how long."""
        return min(1.0, self.busy / self.listened) if self.listened else None

    def health(self, findings: Iterable[Finding] | None = None) -> HealthReport:
        """How the bus and its stations fared. `findings`: this day's, where they are known already."""
        told = self.findings if findings is None else findings
        return health_of(self.summary, told, station_word(self.protocol))

    @property
    def heard(self) -> Hashable:
        """What only a copy has in common with it: when its last frame ended, to the microsecond, which is all that
        some formats keep, and how many good ones there are. Octets that are no frame some do not keep; when a frame
        began they tell by a rate that they may have lost.
        """
        good = self.summary.frames - self.summary.damaged
        last = max((node.last for node in self.summary.nodes if node.last is not None), default=None)
        if self.day == NO_DATE or self.first is None or last is None or not good:
            return self.sources
        return last // 1000, good

    @property
    def is_named_by_file(self) -> bool:
        """Whether nobody named the bus, so that a copy under another name is another bus."""
        return any(file_stem(path) == self.bus for path in self.sources)

    def and_copy(self, other: BusDay) -> BusDay:
        """It or its copy, counted once; the order does not matter."""
        low, high = sorted((self, other), key=lambda one: (one.is_named_by_file, -one.summary.octets, one.sources))
        if low.sources == high.sources:
            return low
        same = "octets" if low.summary.octets == high.summary.octets else "frames"
        paths = sorted((", ".join(low.sources), ", ".join(high.sources)))
        note = f"{' and '.join(paths)} hold the same {same}: counted once"
        return replace(low, notes=tuple(sorted({*self.notes, *other.notes, note})))

    def merge(self, other: BusDay) -> BusDay:
        """Both together; the order does not matter. Raises ValueError for two buses or two days."""
        if self.key != other.key:
            raise ValueError(f"{self.key} and {other.key} are two things")
        low, high = sorted((self, other), key=lambda one: one.sources)
        firsts = [one.first for one in (self, other) if one.first is not None]
        lasts = [one.last for one in (self, other) if one.last is not None]
        return replace(
            low,
            summary=low.summary.merge(high.summary),
            busy=self.busy + other.busy,
            listened=self.listened + other.listened,
            first=min(firsts, default=None),
            last=max(lasts, default=None),
            judged=low.judged + high.judged,
            latency=max(self.latency, other.latency),
            sources=tuple(sorted({*self.sources, *other.sources})),
            notes=tuple(sorted({*self.notes, *other.notes})),
        )


def file_stem(path: str) -> str:
    """What a bus is called that nobody named: by its file."""
    return PurePath(path).name.split(".")[0]


@cache
def _rules(protocol: str) -> Mapping[str, Rule]:
    try:
        return rules_over(registry.get(protocol))
    except registry.UnknownProtocol:
        return {}


def empty_summary(line: str) -> Summary:
    """A summary that keeps no seconds."""
    return Summary(LineSettings.parse(line), kept_seconds=0)


@dataclass(slots=True)
class Archive:
    """What all tasks of an archive gave; and what could not be read, path → why."""

    unreadable: dict[str, str] = field(default_factory=dict)
    _parts: dict[Key, dict[Hashable, BusDay]] = field(default_factory=dict)

    def add(self, day: BusDay) -> None:
        """Take what a task gave. A copy counts once: of a recording, with what was found in it, say."""
        parts = self._parts.setdefault(day.key, {})
        known = parts.get(day.heard)
        parts[day.heard] = day if known is None else known.and_copy(day)

    @property
    def days(self) -> dict[Key, BusDay]:
        """All bus-days, merged; a copy by whose format the name of its bus was lost is counted where it belongs."""
        kept = {key: dict(parts) for key, parts in self._parts.items()}
        alike: dict[Hashable, list[BusDay]] = {}
        for day in (day for parts in kept.values() for day in parts.values()):
            alike.setdefault((day.site, day.protocol, day.day, day.heard), []).append(day)
        for copies in alike.values():
            whole = reduce(BusDay.and_copy, sorted(copies, key=lambda one: (one.is_named_by_file, one.sources)))
            for lost in copies:
                if lost.key != whole.key and lost.is_named_by_file:
                    del kept[lost.key][lost.heard]
                    kept[whole.key][whole.heard] = whole
        return {key: reduce(BusDay.merge, parts.values()) for key, parts in kept.items() if parts}
