"""The matrix of faults, cut short: one seed a case; and buses without a fault, of which nothing may be said.

`make faults` runs all of it: several seeds, an hour of clean traffic.
"""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.faults.cases import CASES, Case, clean_cases, unsteady_cases
from tests.faults.matrix import run

RING = "MS/TP"  # a second of a token ring is some hundred frames
TIMED = (
    "slow",
    "dies",
    "away",
    "drifting",
    "unplugged",
    "lost token",
    "line, ",
)  # something happens at a time of the run
DRIVE = "drive"  # wrong in each round
QUIET = ("slow round", "override forgotten")  # hardly a frame a second
BIT_BY_BIT = ("wrong baud", "wrong parity", "swapped")


def brief(case: Case) -> Case:
    """The same case for as short as it shows."""
    if any(word in case.name for word in QUIET):
        return case
    if any(word in case.name for word in TIMED):
        return case if not case.name.startswith(RING) else replace(case, seconds=20)
    if any(word in case.name for word in BIT_BY_BIT):
        return replace(case, seconds=5)
    return replace(case, seconds=10 if case.name.startswith((RING, DRIVE)) else 30)


SHORT = [brief(case) for case in CASES]
BRIEF_CLEAN = [
    replace(case, seconds=6 if case.name.startswith(RING) else 20)
    for case in clean_cases(20)
    if not case.name.startswith(RING) or case.tap.name in ("exact", "FTDI 16 ms")
]


@pytest.mark.parametrize("case", SHORT, ids=lambda case: case.name)
def test_what_is_wrong_is_found_where_it_is(case: Case) -> None:
    outcome = run(case, seed=1)
    assert outcome.missed == ()
    assert outcome.false == ()


@pytest.mark.parametrize("case", [*BRIEF_CLEAN, *unsteady_cases()], ids=lambda case: case.name)
def test_of_a_clean_bus_nothing_is_said(case: Case) -> None:
    outcome = run(case, seed=1)
    assert outcome.false == ()
    assert outcome.findings != ()  # what the adapter can tell is always said
