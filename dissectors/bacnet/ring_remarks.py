"""A finding about a ring together with the station that it is about: what the rules of MS/TP are written in."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from dissectors.bacnet.ring import Ring
from dissectors.bacnet.ring_events import Happened
from dissectors.bacnet.rules import RULES
from dissectors.findings import EVIDENCE_MAX, Finding, Severity, found
from dissectors.words import duration, percent


class Remark(NamedTuple):
    """`mac`: the station that it is about; None for the whole bus."""

    mac: int | None
    finding: Finding


def of(
    code: str,
    mac: int | None,
    seen: str,
    happened: Happened,
    severity: Severity | None = None,
    *,
    pair: bool = False,
) -> Remark:
    """A finding about things that happened to a station, or to the bus (None).

    `pair`: the subject names the other party too where it is always the same.
    """
    evidence = tuple(dict.fromkeys(event.no for event in happened.events))[:EVIDENCE_MAX]
    finding = found(
        RULES[code],
        _pair(happened, mac) if pair else subject(mac),
        seen,
        first=happened.first,
        last=happened.last,
        count=happened.count,
        evidence=evidence,
        severity=severity,
    )
    return Remark(mac, finding)


def plain(
    code: str, ring: Ring, mac: int | None, seen: str, count: int = 1, severity: Severity | None = None
) -> Remark:
    """A finding about the whole time that the ring was watched."""
    finding = found(
        RULES[code], subject(mac), seen, first=ring.first or 0, last=ring.last or 0, count=count, severity=severity
    )
    return Remark(mac, finding)


def subject(mac: int | None) -> str:
    """How a finding names a station; None is the bus."""
    return "bus" if mac is None else f"MAC {mac}"


def _pair(happened: Happened, mac: int | None) -> str:
    if mac is None or len(happened.others) != 1 or not happened.parties:
        return subject(mac)
    return f"{happened.parties[0]} → {mac}"


def share_of_polls(ring: Ring) -> str:
    """How much of the time polls take that nobody answers; "" where nothing tells times."""
    if not ring.timing.has_times:
        return ""
    return f"; unanswered polls of all stations take {percent(ring.poll_waste_share, 0)} of the time"


def measured(time: int | None) -> str:
    """A duration (ns) for people, "?" where it is not known."""
    return "?" if time is None else duration(time)


def listed(numbers: Iterable[int]) -> str:
    """Numbers with commas between."""
    return ", ".join(str(number) for number in numbers) or "nobody"
