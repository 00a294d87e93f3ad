"""Findings about damaged frames and noise, and about two stations with one address."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from math import sqrt

from dissectors import busiest
from dissectors.bacnet.findings_of_use import has_two_rhythms
from dissectors.bacnet.ring import Ring, RingNode
from dissectors.bacnet.ring_events import Happened, RingEventKind
from dissectors.bacnet.ring_remarks import Remark, listed, of, plain, subject
from dissectors.bacnet.rules import RULES
from dissectors.chances import is_by_chance, is_rare
from dissectors.findings import Severity, counted, times
from dissectors.wrong_checks import Habit

DAMAGED_LEAST = 3
DAMAGED_SHARE = 0.001
DAMAGED_OF_ONE_SHARE = 0.01
NOISE_LEAST = 20
NOISE_SHARE = 0.005
LIKE_ALL = 3
"""A station is named for damage where it has so many times what its share of the octets would bring."""

AT_END_SHARE = 0.8
"""Share of a station's damaged frames that lack their end alone, from which on that is its driver."""


def damage(ring: Ring) -> Iterable[Remark]:
    """Damaged frames: of one station where they are its own, else of the bus; noise."""
    damaged = ring.header_errors + ring.data_errors + ring.cut
    is_fault = busiest.is_fault(ring.when_damaged, ring.frames, ring.span)
    if damaged >= DAMAGED_LEAST and (damaged > DAMAGED_SHARE * ring.frames or is_fault):
        kinds = (
            (ring.header_errors, "with a wrong header CRC"),
            (ring.data_errors, "with a wrong data CRC"),
            (ring.cut, "cut off"),
        )
        seen = (
            f"{damaged} of {counted(ring.frames, 'frame')} damaged: "
            f"{', '.join(f'{count} {what}' for count, what in kinds if count)}"
        )
        seen += busiest.words(ring.when_damaged, damaged, ring.frames, ring.span)
        severity = Severity.NOTE if is_rare(damaged, ring.frames, ring.span, ring.when_damaged) else None
        yield plain("MS401", ring, None, seen, damaged, severity)
    for mac, node in ring.nodes.items():
        if node.damaged >= DAMAGED_LEAST and _is_its_own(ring, node):
            yield from _of_one(ring, mac, node)
    if ring.noise >= NOISE_LEAST and ring.noise > NOISE_SHARE * (ring.octets + ring.noise):
        seen = f"{ring.noise} octets of {ring.octets + ring.noise} belong to no frame"
        yield plain("MS403", ring, None, seen, ring.noise)


def _is_there(node: RingNode) -> bool:
    """Whether more than damaged headers speak for a station: it sent a good frame, or was asked or given the token. Two
    that talk at once make headers of stations that there are not."""
    return _sent(node) > node.damaged or node.tokens_received > 0 or node.requests_received > 0


def _is_its_own(ring: Ring, node: RingNode) -> bool:
    """Whether a station has more damaged frames than noise that hits everybody brings, by its share of the octets."""
    own = node.octets + node.damaged_octets
    others = [other for other in ring.nodes.values() if other is not node]
    theirs = sum(other.octets + other.damaged_octets for other in others)
    expected = sum(other.damaged for other in others) * own / max(1, theirs)
    return node.damaged > LIKE_ALL * expected + 3 * sqrt(expected)


def _is_chance(ring: Ring, node: RingNode) -> bool:
    """Whether what falls anywhere strikes one of the stations so much oftener than the others, now and then."""
    octets = {id(one): one.octets + one.damaged_octets for one in ring.nodes.values()}
    damaged = sum(one.damaged for one in ring.nodes.values())
    share = octets[id(node)] / max(1, sum(octets.values()))
    return share < 1 and is_by_chance(node.damaged, damaged, share, sum(count > 0 for count in octets.values()))


def _of_one(ring: Ring, mac: int, node: RingNode) -> Iterable[Remark]:
    sent = _sent(node)
    replies = ring.of(RingEventKind.DAMAGED_REPLY, mac).count
    for what, habit in (
        ("data CRC", node.data_checks.habit(node.damaged, node.data_sent) or node.data_checks.same(node.damaged)),
        (
            "header CRC",
            node.header_checks.habit(node.damaged, sent - node.damaged) or node.header_checks.same(node.damaged),
        ),
    ):
        if habit is not None:
            yield _wrongly_checked(mac, habit, f"{habit.count} of its {sent} frames {habit.told(what)}")
    if node.cut_last >= DAMAGED_LEAST and node.cut_last >= AT_END_SHARE * node.damaged:
        seen = (
            f"{node.cut_last} of its {sent} frames lack their last octet or two, or it is wrong; all before that fits"
        )
        yield plain("MS405", ring, mac, seen, node.cut_last)
    is_fault = busiest.is_fault(node.when_damaged, sent, ring.span)
    if (node.damaged > DAMAGED_OF_ONE_SHARE * sent or is_fault) and _is_there(node):
        seen = f"{node.damaged} of its {sent} frames damaged"
        if replies:
            seen += f", {replies} of them answers"
        seen += busiest.words(node.when_damaged, node.damaged, sent, ring.span)
        yield plain("MS402", ring, mac, seen, node.damaged, Severity.NOTE if _is_chance(ring, node) else None)


def _wrongly_checked(mac: int, habit: Habit, seen: str) -> Remark:
    finding = habit.tally.found(RULES["MS407"], subject(mac), seen)
    return Remark(mac, replace(finding, means=habit.mistake.means or finding.means))


def _sent(node: RingNode) -> int:
    return node.data_sent + node.tokens_sent + node.polls_sent + node.poll_replies_sent + node.postponed + node.damaged


def duplicates(ring: Ring) -> Iterable[Remark]:
    """Two stations with one address: only what a single one cannot have done."""
    for mac in sorted({mac for _, mac in ring.happened if mac is not None}):
        second, echo = ring.of(RingEventKind.SECOND_DEVICE, mac), ring.of(RingEventKind.OTHER_ECHO, mac)
        other, node = ring.of(RingEventKind.OTHER_DEVICE, mac), ring.nodes.get(mac, RingNode())
        reasons, evidence = [], Happened()
        if second.count:
            reasons.append(f"devices {listed(node.devices)} said I-Am from this address in turns")
            evidence = evidence.merge(other).merge(second)
        if echo.count:
            reasons.append(f"answered a test of its own address {times(echo.count)} with other octets")
            evidence = evidence.merge(echo)
        if has_two_rhythms(ring, mac):
            soon = ring.of(RingEventKind.TOO_SOON, mac)
            reasons.append(
                f"sent again {times(soon.count)} before its own poll could be answered, and waited for the answer "
                f"{times(node.polls_waited)}"
            )
            evidence = evidence.merge(soon)
        if reasons:
            remark = of("MS501", mac, "; ".join(reasons), evidence)
            hit = {address for address, one in ring.nodes.items() if one.damaged}  # two tokens run into everybody
            yield remark._replace(finding=replace(remark.finding, stations=tuple(sorted({mac, *hit}))))
        elif other.count:
            seen = f"devices {listed(node.devices)} said I-Am from this address, one after the other"
            yield of("MS501", mac, seen, other, Severity.NOTE)
