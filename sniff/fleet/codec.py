"""Bus-days as plain JSON and back, for the index: nothing that is read from a file may run."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import fields
from typing import Any

from dissectors.findings import Finding, Severity
from dissectors.histogram import Histogram
from dissectors.subject import About, Subject
from dissectors.tracker import Verdict
from sniff.analysis.judgement import Heard, Judgement
from sniff.analysis.nodes import Node
from sniff.analysis.summary import Summary
from sniff.engine.session import LineEventKind
from sniff.fleet.bus_day import BusDay, Judged, empty_summary

_COUNTS = ("frames", "damaged", "noise", "octets", "searched")
_NAMED = ("kinds", "damages", "found", "marks")
_NODE = ("sent", "received", "damaged", "heard", "first", "last", "passed", "unused")
_PLAIN = ("site", "bus", "port", "protocol", "day", "line", "busy", "listened", "first", "last", "latency")


def encode(days: list[BusDay]) -> str:
    """JSON text."""
    return json.dumps([_day(one) for one in days], separators=(",", ":"), sort_keys=True)


def decode(text: str) -> list[BusDay]:
    """The same back. Raises ValueError, KeyError, TypeError or AttributeError for what `encode` did not make."""
    return [_day_of(one) for one in json.loads(text)]


def _day(day: BusDay) -> dict[str, Any]:
    plain = {name: getattr(day, name) for name in _PLAIN}
    return plain | {
        "summary": _summary(day.summary),
        "judged": [_judged(one) for one in sorted(day.judged)],
        "sources": day.sources,
        "notes": day.notes,
    }


def _day_of(value: dict[str, Any]) -> BusDay:
    return BusDay(
        **{name: value[name] for name in _PLAIN},
        summary=_summary_of(value["summary"], value["line"]),
        judged=tuple(_judged_of(one) for one in value["judged"]),
        sources=tuple(value["sources"]),
        notes=tuple(value["notes"]),
    )


def _summary(summary: Summary) -> dict[str, Any]:
    plain = {name: getattr(summary, name) for name in _COUNTS}
    return (
        plain
        | {name: dict(getattr(summary, name)) for name in _NAMED}
        | {
            "verdicts": {verdict.value: count for verdict, count in summary.verdicts.items()},
            "events": {kind.value: count for kind, count in summary.events.items()},
            "latency": _histogram(summary.latency),
            "nodes": {str(node.address): _node(node) for node in summary.nodes},
        }
    )


def _summary_of(value: dict[str, Any], line: str) -> Summary:
    summary = empty_summary(line)
    for name in _COUNTS:
        setattr(summary, name, value[name])
    for name in _NAMED:
        setattr(summary, name, Counter(value[name]))
    summary.verdicts = Counter({Verdict(name): count for name, count in value["verdicts"].items()})
    summary.events = Counter({LineEventKind(name): count for name, count in value["events"].items()})
    summary.latency = _histogram_of(value["latency"])
    for address, node in value["nodes"].items():
        summary.nodes.nodes[int(address)] = _node_of(int(address), node)
    return summary


def _node(node: Node) -> dict[str, Any]:
    return {name: getattr(node, name) for name in _NODE} | {
        "verdicts": {verdict.value: count for verdict, count in node.verdicts.items()},
        "kinds": dict(node.kinds),
        "errors": dict(node.errors),
        "latency": _histogram(node.latency),
    }


def _node_of(address: int, value: dict[str, Any]) -> Node:
    return Node(
        address,
        **{name: value[name] for name in _NODE},
        verdicts=Counter({Verdict(name): count for name, count in value["verdicts"].items()}),
        kinds=Counter(value["kinds"]),
        errors=Counter(value["errors"]),
        latency=_histogram_of(value["latency"]),
    )


def _histogram(one: Histogram) -> list[Any]:
    buckets = [[bucket, count, one.tops[bucket]] for bucket, count in sorted(one.buckets.items())]
    return [buckets, one.total, one.least, one.most]


def _histogram_of(value: list[Any]) -> Histogram:
    buckets, total, least, most = value
    return Histogram(
        Counter({bucket: count for bucket, count, _ in buckets}),
        {bucket: top for bucket, _, top in buckets},
        sum(count for _, count, _ in buckets),
        total,
        least,
        most,
    )


_HEARD = tuple(field.name for field in fields(Heard))
_PARTS = ("host", "overall", "line", "bus")


def _judged(one: Judged) -> dict[str, Any]:
    heard = one.judgement.heard
    return {
        "first": one.first,
        "source": one.source,
        "heard": [getattr(heard, name) for name in _HEARD],
        "found": [[_finding(each) for each in getattr(one.judgement, part)] for part in _PARTS],
    }


def _judged_of(value: dict[str, Any]) -> Judged:
    heard = Heard(**dict(zip(_HEARD, value["heard"], strict=True)))
    found = (tuple(map(_finding_of, part)) for part in value["found"])
    return Judged(value["first"], value["source"], Judgement(heard, **dict(zip(_PARTS, found, strict=True))))


_FINDING = ("code", "subject", "first", "last", "count", "seen", "means", "next")


def _finding(finding: Finding) -> dict[str, Any]:
    return {name: getattr(finding, name) for name in _FINDING} | {
        "severity": finding.severity.label,
        "evidence": finding.evidence,
        "cause": finding.cause,
        "stations": finding.stations,
        "is_once": finding.is_once,
        "is_told_apart": finding.is_told_apart,
        "lasts": finding.lasts,
        "stated": _subject(finding.stated),
    }


def _finding_of(value: dict[str, Any]) -> Finding:
    return Finding(
        **{name: value[name] for name in _FINDING},
        severity=Severity[value["severity"].upper()],
        evidence=tuple(value["evidence"]),
        cause=tuple(value["cause"]) if value["cause"] else None,
        stations=tuple(value["stations"]),
        is_once=value["is_once"],
        is_told_apart=value["is_told_apart"],
        lasts=value["lasts"],
        stated=_subject_of(value["stated"]),
    )


_SUBJECT = ("station", "partner", "noun", "part", "name")


def _subject(subject: Subject | None) -> dict[str, Any] | None:
    if subject is None:
        return None
    return {name: getattr(subject, name) for name in _SUBJECT} | {"kind": subject.kind.value}


def _subject_of(value: dict[str, Any] | None) -> Subject | None:
    if value is None:
        return None
    return Subject(About(value["kind"]), **{name: value[name] for name in _SUBJECT})
