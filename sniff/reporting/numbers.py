"""The numbers of a report, as plain values: the page is made of these alone; `to_json` gives the same.

Durations are ms, times seconds since the capture's start, shares 0 … 1, unless a name says otherwise. None: not known.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from dissectors.histogram import Histogram
from dissectors.line import MS, NS_PER_S

CLASSES = tuple(round(10_000 * 10 ** (step / 24)) for step in range(169))
"""Edges of the classes of a distribution, ns: 24 a decade from 10 µs to 100 s."""


@dataclass(frozen=True, slots=True)
class Score:
    """Health, 0 … 100, and why it is not more."""

    score: int
    reasons: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class EvidenceRow:
    """A row that a finding rests on: its number, when, and what it says."""

    no: int
    at: float | None
    text: str


@dataclass(frozen=True, slots=True)
class FindingRow:
    """One finding. `under`: whether the one before it that stands for itself explains it."""

    code: str
    severity: str
    title: str
    subject: str
    count: int
    first: float | None
    last: float | None
    seen: str
    means: str
    next: str
    evidence: tuple[EvidenceRow, ...]
    under: bool = False


@dataclass(frozen=True, slots=True)
class Distribution:
    """Durations, ms. `classes`: (upper edge, count) of every class between the first and the last with a count."""

    count: int
    least: float | None = None
    p50: float | None = None
    p95: float | None = None
    most: float | None = None
    classes: tuple[tuple[float, int], ...] = ()

    @classmethod
    def of(cls, histogram: Histogram) -> Distribution:
        """Read a histogram of ns."""
        if not histogram.count:
            return cls(0)
        counts = histogram.spread(CLASSES)
        used = [number for number, count in enumerate(counts) if count]
        edges = (*CLASSES, 2 * CLASSES[-1])
        return cls(
            count=histogram.count,
            least=_ms(histogram.least),
            p50=_ms(histogram.quantile(0.5)),
            p95=_ms(histogram.quantile(0.95)),
            most=_ms(histogram.most),
            classes=tuple((edges[number] / MS, counts[number]) for number in range(used[0], used[-1] + 1)),
        )


def _ms(value: int | None) -> float | None:
    return None if value is None else value / MS


@dataclass(frozen=True, slots=True)
class StationNumbers:
    """One station: frames from and to it, what became of requests to it, how long it took.

    `answered`: in time; `unanswered`: not even late.
    """

    address: int
    sent: int
    received: int
    asked: int
    answered: int
    exceptions: int
    unanswered: int
    damaged: int
    health: Score | None
    trouble: Mapping[str, int]
    response: Distribution


@dataclass(frozen=True, slots=True)
class TimePart:
    """One part of the time: bus load, None where nobody heard it, and counts of trouble; `noise` is octets."""

    at: float
    load: float | None
    damaged: int
    noise: int
    failed: int
    exceptions: int
    line_errors: int


@dataclass(frozen=True, slots=True)
class Happening:
    """Something that happened to the line, in words."""

    at: float | None
    kind: str
    text: str
    count: int


@dataclass(frozen=True, slots=True)
class RingNumbers:
    """The token ring: masters in the order of the token, a table, and what it comes to in sentences."""

    order: tuple[int, ...]
    headings: tuple[str, ...]
    rows: tuple[tuple[str | int | float | None, ...], ...]
    sentences: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Measurement:
    """With what it was measured, and what that cannot tell."""

    protocol: str
    line: str
    port: str
    bus: str
    program: str
    adapter: str
    driver: str
    latency_ms: float
    latency_from: str
    reports: tuple[str, ...] | None
    detail: str
    limits: tuple[str, ...]
    devices: str = ""


@dataclass(frozen=True, slots=True)
class ValueTrend:
    """How one value went: `at`: s since the capture's start, `values` in `unit`. `how`: what registers that nobody
    described are guessed to be, empty where it is known."""

    station: str
    name: str
    unit: str
    how: str
    at: tuple[float, ...]
    values: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class CaptureNumbers:
    """Everything about one capture. `first`, `last`: ISO 8601, None without octets; `part`: s of a part of the time."""

    source: str
    title: str
    verdict: str
    health: Score | None
    complete: bool
    completeness: str
    first: str | None
    last: str | None
    seconds: float | None
    octets: int
    noise_octets: int
    frames: int
    damaged: int
    load: float | None
    findings: tuple[FindingRow, ...]
    stations: tuple[StationNumbers, ...]
    polled_only: tuple[int, ...]
    kinds: Mapping[str, int]
    verdicts: Mapping[str, int]
    damages: Mapping[str, int]
    line_errors: Mapping[str, int]
    response: Distribution
    part: float
    timeline: tuple[TimePart, ...]
    happenings: tuple[Happening, ...]
    measurement: Measurement
    ring: RingNumbers | None = field(default=None)
    values: tuple[ValueTrend, ...] = ()
    happenings_left_out: int = 0

    def without_times(self) -> CaptureNumbers:
        """The same of a capture that does not say when anything came."""
        findings = tuple(
            replace(one, first=None, last=None, evidence=tuple(replace(row, at=None) for row in one.evidence))
            for one in self.findings
        )
        happenings = tuple(replace(one, at=None) for one in self.happenings)
        told = replace(self, findings=findings, happenings=happenings)
        return replace(told, first=None, last=None, seconds=None, load=None, part=0.0, timeline=(), values=())

    def to_json(self) -> dict[str, Any]:
        """Plain values, keys in the order of the fields; the keys are a promise."""
        return asdict(self)


def seconds_since(start: int, time: int) -> float:
    """ns on the capture's clock as seconds since its start, at least 0, as every command counts."""
    return max(0, time - start) / NS_PER_S
