"""The matrix of faults, cut short: one seed a case; and buses without a fault, of which nothing may be said.

`make faults` runs all of it: several seeds, an hour of clean traffic.
"""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.faults.cases import CASES, Case, clean_cases
from tests.faults.matrix import run

SLOW = "MS/TP"  # a second of a token ring is some hundred frames
SHORT = [case if not case.name.startswith(SLOW) else replace(case, seconds=15) for case in CASES]
BRIEF_CLEAN = [
    case
    for case in clean_cases(60)
    if not (case.name.startswith(SLOW) and case.tap.name not in ("exact", "FTDI 16 ms"))
]


@pytest.mark.parametrize("case", SHORT, ids=lambda case: case.name)
def test_what_is_wrong_is_found_where_it_is(case: Case) -> None:
    outcome = run(case, seed=1)
    assert outcome.missed == ()
    assert outcome.false == ()


@pytest.mark.parametrize("case", BRIEF_CLEAN, ids=lambda case: case.name)
def test_of_a_clean_bus_nothing_is_said(case: Case) -> None:
    seconds = 10 if case.name.startswith(SLOW) else case.seconds
    outcome = run(replace(case, seconds=seconds), seed=1)
    assert outcome.false == ()
    assert outcome.findings != ()  # what the adapter can tell is always said
