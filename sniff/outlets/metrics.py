"""OpenMetrics of the buses that are listened to, as text. Pure.

Source: the OpenMetrics specification 1.0: counters end in _total, label values escape \\ and ", # EOF is last.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from dissectors.findings import Severity
from dissectors.histogram import Histogram
from dissectors.line import NS_PER_S
from sniff.analysis.points import Point
from sniff.analysis.sanitizing import sanitized
from sniff.bus.model import BusModel
from sniff.outlets.outlet import Outlet

CONTENT_TYPE = "application/openmetrics-text; version=1.0.0; charset=utf-8"
MOST_FINDINGS = 200
"""Series of findings a bus; more are counted in one number."""

MOST_VALUES = 2000
"""Points of a bus whose last value is told: those seen first. Single bits of a register are not among them."""


@dataclass(frozen=True, slots=True)
class BusNow:
    """A bus as it stands: its model, octets that were lost to the file, whether it is still heard, and when that is,
    ns."""

    model: BusModel
    lost: int = 0
    up: bool = True
    now: int | None = None


_FAMILIES = (
    ("sniff485_up", "gauge", "", "whether the bus is listened to"),
    ("sniff485_octets", "counter", "", "octets heard"),
    ("sniff485_frames", "counter", "", "frames heard"),
    ("sniff485_damaged_frames", "counter", "", "frames with a wrong check, cut or torn"),
    ("sniff485_noise_octets", "counter", "", "octets that are no frame"),
    ("sniff485_unrecorded_octets", "counter", "", "octets heard that are in no file"),
    ("sniff485_load_ratio", "gauge", "ratio", "share of the last ten seconds that the line was busy"),
    ("sniff485_health", "gauge", "", "0 to 100, by the formula in the documentation"),
    ("sniff485_station_health", "gauge", "", "the same of a station"),
    ("sniff485_requests", "counter", "", "requests to a station that expect an answer"),
    ("sniff485_unanswered_requests", "counter", "", "those that got none"),
    ("sniff485_response_seconds", "summary", "seconds", "response times of a station"),
    ("sniff485_finding", "gauge", "", "1 for what a rule has found, by severity"),
    ("sniff485_findings", "gauge", "", "findings by severity"),
    ("sniff485_value", "gauge", "", "last value of a point that is a number, in the unit of its label"),
    ("sniff485_value_timestamp_seconds", "gauge", "seconds", "when it was heard last, since the epoch"),
    ("sniff485_points", "gauge", "", "points of which values were heard"),
    ("sniff485_outlet_up", "gauge", "", "whether what an outlet is told gets through"),
    ("sniff485_outlet_sent", "counter", "", "messages that an outlet delivered"),
    ("sniff485_outlet_dropped", "counter", "", "messages that an outlet could not deliver in time"),
)


def exposition(buses: Sequence[BusNow], outlets: Sequence[Outlet] = ()) -> str:
    """The page of /metrics."""
    samples: dict[str, list[str]] = {name: [] for name, *_ in _FAMILIES}
    for bus in buses:
        for family, line in _samples(bus):
            samples[family].append(line)
    for outlet in outlets:
        label = _labels({"outlet": outlet.name})
        samples["sniff485_outlet_up"].append(f"sniff485_outlet_up{label} {int(outlet.connected)}")
        samples["sniff485_outlet_sent"].append(f"sniff485_outlet_sent_total{label} {outlet.sent}")
        samples["sniff485_outlet_dropped"].append(f"sniff485_outlet_dropped_total{label} {outlet.dropped}")
    lines = []
    for name, kind, unit, text in _FAMILIES:
        lines.append(f"# TYPE {name} {kind}")
        if unit:
            lines.append(f"# UNIT {name} {unit}")
        lines.append(f"# HELP {name} {text}")
        lines += samples[name]
    return "\n".join([*lines, "# EOF", ""])


def _samples(told: BusNow) -> Iterator[tuple[str, str]]:
    model, summary = told.model, told.model.summary
    bus = {"bus": model.session.bus, "protocol": model.session.protocol}

    def one(family: str, value: float, suffix: str = "", **labels: object) -> tuple[str, str]:
        return family, f"{family}{suffix}{_labels({**bus, **labels})} {value!r}"

    def total(family: str, value: int, **labels: object) -> tuple[str, str]:
        return family, f"{family}_total{_labels({**bus, **labels})} {value}"

    yield one("sniff485_up", int(told.up))
    yield total("sniff485_octets", summary.octets)
    yield total("sniff485_frames", summary.frames)
    yield total("sniff485_damaged_frames", summary.damaged)
    yield total("sniff485_noise_octets", summary.noise)
    yield total("sniff485_unrecorded_octets", told.lost)
    yield one("sniff485_load_ratio", summary.load.share(now=told.now))
    health = model.health()
    yield one("sniff485_health", health.bus.score)
    for station, each in sorted(health.stations.items()):
        yield one("sniff485_station_health", each.score, station=station)
    for node in sorted(summary.nodes.present(), key=lambda node: node.address):
        yield total("sniff485_requests", node.asked, station=node.address)
        yield total("sniff485_unanswered_requests", node.unanswered, station=node.address)
        for line in _summary(node.latency, {**bus, "station": node.address}):
            yield "sniff485_response_seconds", line
    findings = model.findings()
    for severity in Severity:
        count = sum(finding.severity is severity for finding in findings)
        yield one("sniff485_findings", count, severity=severity.label)
    for finding in [one for one in findings if one.severity >= Severity.WARNING][:MOST_FINDINGS]:
        labels = {"code": finding.code, "severity": finding.severity.label, "subject": finding.subject}
        yield one("sniff485_finding", 1, **labels)
    yield one("sniff485_points", len(model.points))
    for point in _told_points(model):
        sample = point.sample
        labels = {"device": sample.station, "point": sample.name}
        yield one("sniff485_value", float(sample.value.value), **labels, unit=sample.value.unit)
        yield one("sniff485_value_timestamp_seconds", sample.time / NS_PER_S, **labels)


def _told_points(model: BusModel) -> Iterator[Point]:
    """Points whose last value is a number, as many as are told."""
    numbers = (point for point in model.points if not point.sample.value.bit and point.sample.finite)
    yield from itertools.islice(numbers, MOST_VALUES)


def _summary(latency: Histogram, labels: dict[str, object]) -> Iterator[str]:
    if not latency.count:
        return
    name = "sniff485_response_seconds"
    for share in (0.5, 0.95, 0.99):
        value = latency.quantile(share)
        assert value is not None
        yield f"{name}{_labels({**labels, 'quantile': f'{share:g}'})} {value / NS_PER_S!r}"
    yield f"{name}_count{_labels(labels)} {latency.count}"
    yield f"{name}_sum{_labels(labels)} {latency.total / NS_PER_S!r}"


def _labels(labels: dict[str, object]) -> str:
    return "{" + ",".join(f'{name}="{_escaped(str(value))}"' for name, value in labels.items()) + "}"


def _escaped(text: str) -> str:
    """Label values come from captures and configurations: no control character leaves here."""
    return sanitized(text).replace("\\", "\\\\").replace('"', '\\"')
