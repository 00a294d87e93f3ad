"""Damage of one station's frames: named where it is no chance, and what falls anywhere is nobody's."""

from __future__ import annotations

from random import Random

import pytest

from dissectors.bacnet.findings import judge
from dissectors.bacnet.ring import Ring, RingNode
from dissectors.bacnet.rules import RULES
from dissectors.findings import Severity, with_consequences

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
