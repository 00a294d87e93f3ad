"""What framing and pairing keep of an N2 bus under bad conditions: the N2 lines of the framing table, held."""

from __future__ import annotations

from functools import cache
from random import Random

import pytest

from tests.bench.framing_conditions import CONDITIONS
from tests.bench.framing_table import DELIVERIES, Measured, Share, measure
from tests.bench.framing_traffic import TRAFFIC, Traffic
from tests.seeds import IS_SEARCH

JUNK = ("1-3 junk octets a gap", "1-3 junk directly before", "1-3 junk directly after")
DAMAGED = ("bit errors 1e-4", "bit errors 1e-3", "bit errors 3e-3", "lost octets 3e-3", "truncated 5 %")


@cache
def measured(name: str, delivery: str) -> Measured:
    """A condition through an adapter, once for all that is asked of it."""
    (row,) = (row for row in CONDITIONS if row.name == name)
    return measure(traffic(), row, delivery, 7)


@cache
def traffic() -> Traffic:
    return TRAFFIC["n2"](Random(7), 1500 if IS_SEARCH else 1000)


def at_least(share: Share, least: float) -> bool:
    return share.part >= least * share.of


def rows(names: tuple[str, ...]) -> list:
    return [row for row in CONDITIONS if row.name in names]


def test_the_conditions_are_there():
    assert len(rows(JUNK + DAMAGED)) == len(JUNK + DAMAGED)


@pytest.mark.parametrize("delivery", DELIVERIES)
@pytest.mark.parametrize("row", CONDITIONS, ids=lambda row: row.name)
def test_nothing_vanishes_and_hardly_anything_is_missed_or_invented(row, delivery):
    got = measured(row.name, delivery)
    assert got.conserved
    assert at_least(got.found, 0.99), got.failed[:5]
    assert got.invented.part <= 0.003 * got.invented.of, got.failed[:5]
    assert at_least(got.direction, 1)
    assert at_least(got.verdict, 0.98), got.failed[:5]


@pytest.mark.parametrize("delivery", DELIVERIES)
@pytest.mark.parametrize("row", rows(JUNK), ids=lambda row: row.name)
def test_junk_in_the_gaps_costs_nothing(row, delivery):
    got = measured(row.name, delivery)
    assert at_least(got.found, 0.995), got.failed[:5]
    assert got.invented.part == 0
    assert at_least(got.verdict, 0.995), got.failed[:5]


@pytest.mark.parametrize("delivery", DELIVERIES)
@pytest.mark.parametrize("row", rows(DAMAGED), ids=lambda row: row.name)
def test_damaged_frames_stand_at_their_station(row, delivery):
    assert at_least(measured(row.name, delivery).attributed, 0.9)
