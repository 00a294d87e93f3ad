"""Findings about stations whose late answers fall on what others send.

Who answers later than it may does so when somebody else has the token: two senders at once are no frame, and whoever is
hit looks damaged, or as if it had lost a token. It shows by where the damage stands: while an answer is overdue.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from dissectors.bacnet.limits import T_REPLY_DELAY
from dissectors.bacnet.ring import Ring
from dissectors.bacnet.ring_events import RingEventKind
from dissectors.bacnet.ring_questions import T_OVERDUE
from dissectors.bacnet.ring_remarks import Remark, listed, measured, of
from dissectors.bacnet.rules import RULES
from dissectors.chances import at_least
from dissectors.findings import as_consequence, counted, times

STRUCK_LEAST, SELDOM = 3, 0.002
"""For a station that was heard to answer late."""

ALONE_LEAST, ALONE_SHARE, ALONE_SELDOM = 5, 0.75, 1e-6
"""For one that was not, since all that it says late is damaged: it is behind requests to it that damage stands, and to
hardly anybody else."""


SEVERAL = 2
"""So many stations that answer late are told of together."""


def overdue(ring: Ring) -> Iterable[Remark]:
    """Who answers into what comes next, where that is half of the damage and more. Several are one finding of the bus,
    and what each does stands under it."""
    damaged = ring.header_errors + ring.data_errors + ring.cut
    then = ring.of(RingEventKind.OVERDUE).count
    if 2 * then < damaged or not ring.span:
        return
    each = tuple(_of_each(ring, damaged, then))
    whole = _of_several(ring, damaged, each)
    if whole is not None:
        yield whole
    for one in each:
        yield one if whole is None else Remark(one.mac, as_consequence(one.finding, whole.finding, RULES))


def _waits(ring: Ring, mac: int) -> int:
    """How often an answer of a station was overdue."""
    struck, late = ring.of(RingEventKind.OVERDUE, mac), ring.of(RingEventKind.LATE_REPLY, mac).count
    return ring.of(RingEventKind.NO_REPLY, mac).count + late or struck.count


def _of_several(ring: Ring, damaged: int, each: Sequence[Remark]) -> Remark | None:
    """Stations that answer late, where they are several: those that are shown to, or, where none is shown alone, those
    behind whose requests the damage stands together."""
    struck = {mac: ring.of(RingEventKind.OVERDUE, mac).count for mac in ring.nodes}
    late = {
        mac
        for mac, node in ring.nodes.items()
        if (node.replies or node.is_master)
        and (struck[mac] >= STRUCK_LEAST or (struck[mac] and ring.of(RingEventKind.LATE_REPLY, mac).count))
    }
    together = ring.of(RingEventKind.OVERDUE)
    if len(late) < SEVERAL or (len(each) == 1 and 2 * each[0].finding.count >= together.count):
        return None
    share = min(1.0, sum(_waits(ring, mac) for mac in ring.nodes) * (T_OVERDUE - T_REPLY_DELAY) / ring.span)
    chance = at_least(together.count, max(together.count, damaged), share)
    if len(each) < SEVERAL and (together.count < ALONE_LEAST or chance >= ALONE_SELDOM):
        return None
    seen = (
        f"{together.count} of {counted(damaged, 'damaged frame')} stand within {measured(T_OVERDUE)} of requests that "
        f"had no answer in {measured(T_REPLY_DELAY)}: to MAC {listed(sorted(late))}"
    )
    told = of("MS308", None, seen, together).finding
    hit = {mac for mac, count in together.others.items() if mac is not None and count}
    return Remark(
        None,
        replace(
            told,
            means="these stations answer when another one has the token, and their answers run into the frames of "
            "others, who are not to blame",
            next="load and firmware of these stations, all alike: each must answer within 250 ms or send Reply "
            "Postponed (ASHRAE 135, 9.5.3); nobody's cable",
            stations=tuple(sorted(late | hit)),
        ),
    )


def _of_each(ring: Ring, damaged: int, then: int) -> Iterable[Remark]:
    every = sum(ring.of(RingEventKind.OVERDUE, mac).count for mac in ring.nodes)
    for mac, node in ring.nodes.items():
        struck, late = ring.of(RingEventKind.OVERDUE, mac), ring.of(RingEventKind.LATE_REPLY, mac).count
        share = min(1.0, _waits(ring, mac) * (T_OVERDUE - T_REPLY_DELAY) / ring.span)
        chance = at_least(struck.count, max(struck.count, damaged), share)
        is_late = late and struck.count >= STRUCK_LEAST and chance < SELDOM
        is_there = node.replies > 0 or node.is_master  # who is never heard is most likely off, and speaks into nothing
        is_alone = is_there and struck.count >= max(ALONE_LEAST, ALONE_SHARE * every) and chance < ALONE_SELDOM
        if not is_late and not is_alone:
            continue
        seen = (
            f"damage, or a token that was lost, {times(struck.count)} within {measured(T_OVERDUE)} of a request to it "
            f"that it had not answered in {measured(T_REPLY_DELAY)}"
        )
        seen += f"; in all {then} of {counted(damaged, 'damaged frame')} stand behind such requests" if damaged else ""
        yield of("MS308", mac, seen, struck)


def under_late_answers(remarks: Iterable[Remark], late: Sequence[Remark], ring: Ring) -> Iterable[Remark]:
    """What is said of damage; that of stations whose frames are hit by late answers is under the first of these."""
    hit = ring.of(RingEventKind.OVERDUE).others
    for one in remarks:
        node = None if one.mac is None else ring.nodes.get(one.mac)
        if late and node is not None and 2 * hit.get(one.mac, 0) >= node.damaged:
            yield Remark(one.mac, as_consequence(one.finding, late[0].finding, RULES))
        else:
            yield one
