"""Several faults at once, drawn at random: whoever is not among the culprits is accused of nothing."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from random import Random

import pytest

from dissectors.findings import Severity
from dissectors.simulated_faults import BitFlips, Fault, LateResponse, LostResponse
from sniff.simulation.scenarios import Scenario, simulate
from sniff.simulation.tap import CH340, EXACT, FTDI, UART
from tests.faults.case import subject_of
from tests.faults.judged import findings_of
from tests.faults.workbench import N2, Modbus, by_turns, follower, usual_requests, usual_stations
from tests.seeds import seeds

MS = 1_000_000
_NUMBERS = (3, 12, 20, 41, 60)


def modbus(there: tuple[int, ...], faults: tuple[Fault, ...], timeout: int, dice: Random) -> Scenario:
    """A master that asks all of them, and those that are `there`."""
    plan = Modbus(
        usual_requests(_NUMBERS, dice.choice((2, 10, 30))),
        usual_stations(there),
        faults,
        timeout=timeout,
        retries=dice.randrange(3),
        pause=dice.choice((5, 25, 80)) * MS,
    )
    return plan(seed=dice.randrange(99))


def n2(there: tuple[int, ...], faults: tuple[Fault, ...], timeout: int, dice: Random) -> Scenario:
    """The same on N2."""
    plan = N2(
        partial(by_turns, *_NUMBERS, count=2),
        {f"unit {one}": partial(follower, one, dice.randrange(4, 20) * MS, few=True) for one in there},
        faults,
        timeout=timeout,
        retries=dice.randrange(3),
    )
    return plan(seed=dice.randrange(99))


@pytest.mark.parametrize("make", [modbus, n2])
@pytest.mark.parametrize("seed", seeds(40, 3))
def test_only_culprits_are_accused(
    make: Callable[[tuple[int, ...], tuple[Fault, ...], int, Random], Scenario], seed: int
) -> None:
    dice = Random(f"innocents {seed}")
    timeout = dice.choice((200, 250, 600)) * MS
    dead, *struck = dice.sample(_NUMBERS, dice.choice((2, 3)))
    late, *others = (f"unit {one}" for one in struck)  # two of four that are late are a master that is impatient
    kinds = (partial(BitFlips, 0.02), partial(LostResponse, 0.2))
    faults: list[Fault] = [dice.choice(kinds)((one,)) for one in others]
    if dice.random() < 0.5:
        faults.append(LateResponse(0.3, timeout + dice.randrange(1, 30) * MS, (late,)))
    else:
        faults.append(dice.choice(kinds)((late,)))
    there = tuple(one for one in _NUMBERS if one != dead)
    session, items = simulate(make(there, tuple(faults), timeout, dice), 20, dice.choice((EXACT, FTDI, CH340, UART)))
    culprits = {"bus", *(f"station {one}" for one in (dead, *struck))}
    found = [one for one in findings_of(session, items) if one.severity >= Severity.WARNING and one.cause is None]
    accused = [f"{one.code} {one.subject}: {one.seen}" for one in found if subject_of(one) not in culprits]
    assert not accused
    assert any(subject_of(one) in culprits for one in found)
