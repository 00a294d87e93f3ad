"""Damage of one station's frames: named where it is no chance, and what falls anywhere is nobody's."""

from __future__ import annotations

from dataclasses import replace
from random import Random

import pytest

from dissectors.bacnet.findings import judge
from dissectors.bacnet.ring import Ring, RingNode
from dissectors.bacnet.ring_events import Happened, RingEventKind
from dissectors.bacnet.rules import RULES
from dissectors.findings import Severity, with_consequences
from dissectors.line import Timing
from tests.dissectors.bacnet.ring_script import rounds, script, spoil, token

SENT = 40


def told(*damaged: int, octets: int = 8 * SENT) -> dict[str, Severity]:
    """What is said of stations that sent alike, of which so many frames were damaged. By subject."""
    nodes = {
        mac: RingNode(data_sent=SENT, tokens_received=SENT, octets=octets, damaged=count, damaged_octets=8 * count)
        for mac, count in enumerate(damaged, 1)
    }
    ring = Ring(nodes=nodes, frames=SENT * len(damaged), data_errors=sum(damaged))
    return {
        one.subject: one.severity for one in with_consequences(judge(ring), RULES) if one.code in ("MS401", "MS402")
    }


def graves(found: dict[str, Severity]) -> set[str]:
    return {subject for subject, severity in found.items() if severity >= Severity.WARNING}


@pytest.mark.parametrize(
    ("damaged", "whose"),
    [
        ((3, 0, 0, 0, 0), "MAC 1"),
        ((3, 0, 0), "bus"),  # of three any might have been struck three times
        ((5, 0), "bus"),
        ((7, 0), "MAC 1"),
        ((6, 1, 0, 0, 0, 0, 0, 0), "MAC 1"),
        ((4, 2, 1, 1, 0, 0, 0, 0), "bus"),
        ((12, 2, 1, 1, 0, 0, 0, 0), "MAC 1"),
        ((5,), "MAC 1"),  # nobody else was heard
    ],
)
def test_one_is_named_where_chance_would_seldom_strike_any_so_often(damaged: tuple[int, ...], whose: str) -> None:
    found = told(*damaged)
    assert graves(found) == {whose}


@pytest.mark.parametrize(("strikes", "of"), [(3, 2), (3, 4), (5, 8), (9, 30), (20, 20)])
def test_what_falls_anywhere_names_hardly_ever_a_station(strikes: int, of: int) -> None:
    dice, wrong = Random(485), 0
    for _ in range(100):
        damaged = [0] * of
        for _ in range(strikes):
            damaged[dice.randrange(of)] += 1
        wrong += graves(told(*damaged)) != {"bus"}
    assert wrong <= 5


@pytest.mark.parametrize(("quarters", "named"), [({7: 60}, {"MAC 1"}), (dict.fromkeys(range(30), 2), set())])
def test_a_night_names_who_was_bad_for_a_quarter_of_an_hour(quarters: dict[int, int], named: set[str]) -> None:
    """60 of a million frames: pooled over the night they are nothing."""
    sent, night = 1_000_000, 13 * 3600 * 10**9
    one, happened = RingNode(data_sent=sent, tokens_received=sent, requests_received=sent, octets=8 * sent), {}
    nodes = {1: replace(one, damaged=60, damaged_octets=480, when_damaged=quarters), 2: one}
    found = with_consequences(
        judge(Ring(Timing(), 0, night, 2 * sent, data_errors=60, nodes=nodes, when_damaged=quarters)), RULES
    )
    assert graves({each.subject: each.severity for each in found}) == named
    happened[RingEventKind.NO_REPLY, 2] = Happened(60, 0, night, others={1: 60}, quarters=quarters)
    found = with_consequences(
        judge(Ring(Timing(), 0, night, 2 * sent, nodes={1: one, 2: one}, happened=happened)), RULES
    )
    assert {each.code for each in found if each.severity >= Severity.WARNING} == ({"MS301"} if named else set())


def test_damage_is_counted_by_quarters_as_it_is_counted() -> None:
    ring = script([*rounds(4, 1, 5), *[(2, spoil(token(1, 5), 4)), (2, token(5, 1))] * 5]).ring
    assert sum(ring.when_damaged.values()) == ring.header_errors + ring.data_errors + ring.cut > 0
    for node in ring.nodes.values():
        assert sum(node.when_damaged.values()) == node.damaged
    for happened in ring.happened.values():
        assert sum(happened.quarters.values()) == happened.count
    doubled = ring.merge(ring)
    assert sum(doubled.when_damaged.values()) == 2 * sum(ring.when_damaged.values())
