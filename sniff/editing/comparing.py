"""Two captures of a bus side by side: what is new, what is gone, what is slower. Pure."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from dissectors.findings import Finding, Severity, counted
from dissectors.profiles.decoding import number
from dissectors.tracker import Verdict
from dissectors.words import milliseconds, percent
from sniff.analysis.nodes import Node
from sniff.analysis.point_reader import ALL
from sniff.analysis.points import Point
from sniff.analysis.summary import Summary

NOTICEABLE = 0.02
"""A share has changed when it moved by as much; a time when it moved by a tenth and more than the adapters allow."""

MEDIAN_LEAST, TAIL_LEAST = 3, 20
"""Answers on both sides from which on their p50 and their p95 are compared: the longest of two is no p95."""

COMPARED_VERDICTS = (Verdict.NO_RESPONSE, Verdict.EXCEPTION, Verdict.DAMAGED_ANSWER, Verdict.LATE, Verdict.RETRY)


@dataclass(frozen=True, slots=True)
class Side:
    """One capture: what was counted and found in it. `latency`: ns that its adapter may hold octets back.

    `points`: the values of its stations, as `PointTable` gives them. `protocol`: its title; `line`: its settings; empty
    where nobody knows them. `has_times`: whether it says when anything came.
    """

    name: str
    counts: Summary
    findings: tuple[Finding, ...]
    latency: int
    points: tuple[Point, ...] = ()
    protocol: str = ""
    line: str = ""
    has_times: bool = True
    noun: str = "station"  # what the people of its protocol call one


@dataclass(frozen=True, slots=True)
class Difference:
    """One thing that differs. `subject`: "station 3", "bus"; `before`, `after`: in words, with units."""

    subject: str
    what: str
    before: str
    after: str


def differences(before: Side, after: Side) -> Iterator[Difference]:
    """What differs, the bus first, then station by station, then the findings."""
    yield from _bus(before, after)
    old = {node.address: node for node in before.counts.nodes.present()}
    new = {node.address: node for node in after.counts.nodes.present()}
    doubt = before.latency + after.latency
    for address in sorted(old.keys() | new.keys()):
        subject = f"{after.noun} {address}"
        if address not in old or address not in new:
            yield Difference(subject, "presence", _presence(old.get(address)), _presence(new.get(address)))
        else:
            yield from _node(subject, old[address], new[address], doubt)
    yield from _values(before, after)
    yield from _findings(before, after)


def _bus(before: Side, after: Side) -> Iterator[Difference]:
    for name, was, now in (("protocol", before.protocol, after.protocol), ("line settings", before.line, after.line)):
        if was and now and was != now:
            yield Difference("bus", name, was, now)
    loads = (
        ((before.counts.load.overall(), after.counts.load.overall()),) if before.has_times and after.has_times else ()
    )
    shares = (
        *(("load", *both) for both in loads),
        ("damaged frames", _share(before.counts.damaged, before.counts.frames),
         _share(after.counts.damaged, after.counts.frames)),
        ("noise octets", _share(before.counts.noise, before.counts.octets),
         _share(after.counts.noise, after.counts.octets)),
    )  # fmt: skip
    for what, old, new in shares:
        if abs(old - new) >= NOTICEABLE or (old == 0) != (new == 0):
            yield Difference("bus", what, percent(old), percent(new))


def _node(subject: str, old: Node, new: Node, doubt: int) -> Iterator[Difference]:
    for verdict in COMPARED_VERDICTS:
        was, now = _share(old.verdicts[verdict], old.asked), _share(new.verdicts[verdict], new.asked)
        if abs(was - now) >= NOTICEABLE or (was == 0) != (now == 0):
            yield Difference(subject, verdict.words, f"{percent(was)} of {old.asked}", f"{percent(now)} of {new.asked}")
    for name, share, least in (("response p50", 0.5, MEDIAN_LEAST), ("response p95", 0.95, TAIL_LEAST)):
        if min(old.latency.count, new.latency.count) < least:
            continue  # of so few the next ones would differ as much
        was_time, now_time = old.latency.quantile(share), new.latency.quantile(share)
        if was_time is None or now_time is None:
            continue
        if abs(was_time - now_time) > max(doubt, was_time // 10):
            yield Difference(subject, name, milliseconds(was_time), milliseconds(now_time))
    for kind in sorted(old.kinds.keys() ^ new.kinds.keys()):
        yield Difference(subject, kind, _times(old.kinds[kind]), _times(new.kinds[kind]))


def _times(count: int) -> str:
    return "never" if not count else "once" if count == 1 else f"{count} times"


def _values(before: Side, after: Side) -> Iterator[Difference]:
    """Points that both have and whose values have nothing in common; what goes up and down as ever is no difference.

    Bits are told by the words of their register.
    """
    new = {_key(point): point for point in after.points}
    for point in before.points:
        other = new.get(_key(point))
        if other is None or point.sample.value.bit or _overlap(point, other):
            continue
        station = point.sample.station
        subject = station if station == ALL else f"{after.noun} {station}"
        yield Difference(subject, point.sample.name, _range(point), _range(other))


def _key(point: Point) -> tuple[str, str, bool]:
    """What was written and what was read under one name are compared each with its like."""
    return point.sample.station, point.sample.name, point.is_command


def _overlap(old: Point, new: Point) -> bool:
    if not old.history or not new.history:
        return old.sample.value.text == new.sample.value.text
    was, now = [value for _, value in old.history], [value for _, value in new.history]
    return min(was) <= max(now) and min(now) <= max(was)


def _range(point: Point) -> str:
    """The latest value in words, and between which it was if it moved."""
    value = point.sample.value
    seen = [number for _, number in point.history]
    if not seen or value.words or min(seen) == max(seen):
        return value.text
    return f"{number(min(seen), value.entry)} … {number(max(seen), value.entry, value.unit)}"


def _findings(before: Side, after: Side) -> Iterator[Difference]:
    old = {(finding.code, finding.subject): finding for finding in before.findings}
    new = {(finding.code, finding.subject): finding for finding in after.findings}
    for key in sorted(old.keys() ^ new.keys()):
        found = old.get(key) or new[key]
        if found.severity >= Severity.NOTE:
            gone, came = (found.seen, "not found") if key in old else ("not found", found.seen)
            yield Difference(found.subject, found.code, gone, came)


def _presence(node: Node | None) -> str:
    return (
        "absent" if node is None else f"{counted(node.sent, 'frame')} from it, {counted(node.asked, 'request')} to it"
    )


def _share(part: int, whole: int) -> float:
    return part / whole if whole else 0.0
