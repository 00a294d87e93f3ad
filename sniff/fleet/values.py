"""The answer for programs: one object a bus, a day and a station."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from dissectors.findings import Severity
from dissectors.histogram import Histogram
from sniff.fleet.answer import Answer, Bus, Day
from sniff.fleet.bus_day import Archive
from sniff.fleet.drift import Drift
from sniff.formats.parquet import Kind

COLUMNS: dict[str, Kind] = {
    "site": Kind.TEXT,
    "bus": Kind.TEXT,
    "protocol": Kind.TEXT,
    "day": Kind.TEXT,
    "station": Kind.INTEGER,
    "health": Kind.INTEGER,
    "load": Kind.NUMBER,
    "frames": Kind.INTEGER,
    "damaged": Kind.INTEGER,
    "requests": Kind.INTEGER,
    "unanswered": Kind.INTEGER,
    "response_p50_ms": Kind.NUMBER,
    "response_p95_ms": Kind.NUMBER,
    "response_max_ms": Kind.NUMBER,
    "findings": Kind.TEXT,
}
"""Of the table: a row for each bus and day (station empty) and for each station of it; findings that are warnings or
errors."""


def rows(archive: Archive) -> Iterator[tuple[Any, ...]]:
    """The table, ordered by site, bus, day, station."""
    for _, day in sorted(archive.days.items()):
        found, summary = [one for one in day.findings if one.severity >= Severity.WARNING], day.summary
        health = day.health(found)
        head = (day.site, day.bus, day.protocol, day.day)
        asked = sum(node.asked for node in summary.nodes)
        unanswered = sum(node.unanswered for node in summary.nodes)
        codes = sorted({finding.code for finding in found})
        yield (*head, None, health.bus.score, day.load, summary.frames, summary.damaged, asked, unanswered,
               *_times(summary.latency), " ".join(codes))  # fmt: skip
        for node in sorted(summary.nodes.present(), key=lambda one: one.address):
            score = health.stations.get(node.address)
            codes = sorted({one.code for one in found if one.about.station == node.address})
            yield (*head, node.address, score.score if score is not None else None, None, node.sent, node.damaged,
                   node.asked, node.unanswered, *_times(node.latency), " ".join(codes))  # fmt: skip


def as_values(found: Answer) -> Iterator[dict[str, Any]]:
    """One object a bus, then one a file that could not be read."""
    for bus in found.buses:
        yield _bus(bus)
    for path, why in found.unreadable.items():
        yield {"unreadable": path, "why": why}
    if found.gone:
        yield {"gone": list(found.gone)}


def _bus(bus: Bus) -> dict[str, Any]:
    return {
        "site": bus.site,
        "bus": bus.bus,
        "protocol": bus.protocol,
        "health": bus.health.score,
        "reasons": list(bus.health.reasons),
        "days": [_day(day) for day in bus.days],
        "findings": [
            {
                "code": one.finding.code,
                "severity": one.finding.severity.label,
                "subject": one.finding.subject,
                "seen": one.finding.seen,
                "means": one.finding.means,
                "next": one.finding.next,
                "count": one.finding.count,
                "days": list(one.days),
                "alike": one.alike,
                "since_last_run": one.fresh.value or None,
            }
            for one in bus.troubles
        ],
        "stations": [
            {
                "station": one.station,
                "change": one.change.value,
                "day": one.day,
                **(_drift(one.drift) if one.drift is not None else {}),
            }
            for one in bus.changes
        ],
        "response_drift": [{"station": one.station, **_drift(one)} for one in bus.drifts],
        "silent_days": list(bus.silent),
        "no_capture_since": bus.stopped,
        "missing_days": list(bus.missing),
        "notes": list(bus.notes),
        "adapter_latency_ms": _ms(bus.latency),
    }


def _drift(one: Drift) -> dict[str, Any]:
    return {
        "before_ms": _ms(one.before),
        "after_ms": _ms(one.after),
        "ms_in_30_days": round(30 * one.slope / 1e6, 3),
        "days": len(one.medians),
        "how_sure": one.sure.value,
        "chance": round(one.chance, 6),
    }


def _day(day: Day) -> dict[str, Any]:
    p50, p95, most = _times(day.response)
    return {
        "day": day.day,
        "health": day.health.score,
        "reasons": list(day.health.reasons),
        "load": None if day.load is None else round(day.load, 4),
        "frames": day.frames,
        "octets": day.octets,
        "damaged_share": round(day.damaged, 6),
        "unanswered_share": round(day.unanswered, 6),
        "response_p50_ms": p50,
        "response_p95_ms": p95,
        "response_max_ms": most,
        "stations": list(day.stations),
        "listened_s": round(day.listened / 1e9, 3) if day.load is not None else None,
    }


def _times(latency: Histogram) -> tuple[float | None, float | None, float | None]:
    return _ms(latency.quantile(0.5)), _ms(latency.quantile(0.95)), _ms(latency.most)


def _ms(value: int | None) -> float | None:
    return None if value is None else round(value / 1e6, 3)
