"""The matrix of faults, cut short: every second case, one seed; and clean buses, of which nothing may be said.

`make faults` runs all of it: several seeds, an hour of clean traffic.
"""

from __future__ import annotations

from dataclasses import replace

import pytest

from sniff.simulation.scenarios import bursts
from tests.faults import matrix
from tests.faults.case import Case
from tests.faults.cases import CASES, FURTHER_CASES
from tests.faults.clean_cases import CLEAN, Clean, clean_cases
from tests.faults.judged import run
from tests.seeds import some

# Cases that no rule tells rightly yet: the suite skips them, `make faults` counts them. To be emptied.
PENDING: tuple[str, ...] = ()

RING = ("MS/TP", "PROFIBUS")  # a second of a token ring is some hundred frames
TIMED = (
    "slow",
    "dies",
    "away",
    "drifting",
    "unplugged",
    "lost token",
    "token lost",
    "Clear",
    "restarts",
    "expires",
    "switched off",
    "heard from the middle",
    "line, ",
)  # something happens at a time of the run
DRIVE = "drive"  # wrong in each round
QUIET = ("slow round", "override forgotten")  # hardly a frame a second
BIT_BY_BIT = ("wrong baud", "wrong parity", "swapped")
WHOLE = (
    "twenty frames",
    "stops",
    "at one moment",
    "contactor",
    "another one for a while",
    "hum",
    "anywhere",
    "shut out",
    "Max_Master",
    "now and then answers",
)
"""Words of cases that show only over time."""


def brief(case: Case) -> Case:
    """The same case for as short as it shows."""
    if any(word in case.name for word in (*QUIET, *WHOLE)):
        return case
    if any(word in case.name for word in TIMED):
        return case if not case.name.startswith(RING) else replace(case, seconds=20)
    if any(word in case.name for word in BIT_BY_BIT):
        return replace(case, seconds=5)
    return replace(case, seconds=min(case.seconds, 10 if case.name.startswith((*RING, DRIVE)) else 30))


def brief_clean() -> list[Case]:
    """Every kind of clean bus with exact times and through the adapter that hides most, the plain ones through all."""
    plain = {kind.name for kind in CLEAN[:5]}
    cases = []
    for case in clean_cases(20):
        kind = case.name.rsplit(", ", 1)[0]
        ring = case.name.startswith(RING)
        dense = ring or "brisk" in kind  # as many frames in these seconds as the others in all of theirs
        if case.tap.name in ("exact", "FTDI 16 ms") or (kind in plain and not ring):
            cases.append(replace(case, seconds=6 if dense else case.seconds))
    return cases


LONG = (
    "MS/TP contactor every five seconds",
    "MS/TP polls up to Max_Master after each loss",
    "MS/TP noise anywhere",
    "MS/TP station comes and goes",
)
"""A ring over a long time: only in `make faults`."""

FAULTY = [brief(case) for case in (*CASES, *FURTHER_CASES) if case.name not in LONG]
BRIEF_CLEAN = brief_clean()


def unless_pending(case: Case) -> None:
    """Skip what rules cannot tell yet."""
    if case.name in PENDING:
        pytest.skip("pending: no rule tells this yet")


@pytest.mark.parametrize("case", some(FAULTY, 3), ids=lambda case: case.name)
def test_what_is_wrong_is_found_where_it_is_and_nobody_else_is_accused(case: Case) -> None:
    unless_pending(case)
    outcome = run(case, seed=1)
    assert outcome.missed == ()
    assert outcome.false == ()


@pytest.mark.parametrize("case", BRIEF_CLEAN, ids=lambda case: case.name)
def test_of_a_clean_bus_nothing_is_said(case: Case) -> None:
    unless_pending(case)
    outcome = run(case, seed=1)
    assert outcome.false == ()
    assert outcome.findings != ()  # what the adapter can tell is always said


def test_every_pending_case_exists_and_names_are_told_apart() -> None:
    names = [case.name for case in (*FAULTY, *BRIEF_CLEAN)]
    assert len(set(names)) == len(names)
    assert set(names).issuperset(PENDING)


def test_the_table_adds_up(capsys: pytest.CaptureFixture[str]) -> None:
    words = ("RTU station absent, master by the clock", "N2 clean, exact")
    assert matrix.main([*words, "--jobs=1", "--seeds=1", "--clean-minutes=0.1"]) == 0
    told = capsys.readouterr().out
    assert "1 cases with a fault, 1 runs, recall 100.0%" in told
    assert "0 accusations" in told
    assert "1 clean buses, 0 false alarms" in told


@pytest.mark.parametrize("kind", CLEAN, ids=lambda kind: kind.name)
def test_clean_buses_are_clean(kind: Clean) -> None:
    """Nothing collides, everything arrives: what is said of them is said of the sniffer's making."""
    sent = [one for burst in bursts(kind.make(seed=1), 8) for one in burst.sent]
    assert len(sent) > 8
    assert [one for one in sent if not one.intact] == []
