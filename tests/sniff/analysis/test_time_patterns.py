"""Patterns in time are told where there are some, and never of what has none."""

from __future__ import annotations

from functools import partial

import pytest

from dissectors.frame import Check, Damage, FoundBy, Frame
from dissectors.line import LineSettings
from dissectors.simulated_faults import BitFlips, MarkParity, NoiseInGaps
from sniff.analysis.time_patterns import TimePatterns
from sniff.engine.session import Session
from sniff.simulation.tap import EXACT, FTDI
from tests.faults.buses import modbus, mstp, n2
from tests.faults.case import Case
from tests.faults.line_faults import AtTimes, paused
from tests.faults.line_rule_cases import LINE_RULE_CASES, NO_PATTERN
from tests.faults.matrix import run
from tests.faults.stations import Dies
from tests.seeds import seeds

MS = 1_000_000
S = 1_000_000_000
FIVE = partial(modbus, units=(1, 2, 3, 4, 5))
FAST = partial(modbus, line=LineSettings.parse("38400,8E1"))


def patterns(case: Case, seed: int = 1) -> set[str]:
    return {one.code for one in run(case, seed).findings if one.code.startswith("LN3")}


@pytest.mark.parametrize("case", NO_PATTERN, ids=lambda case: case.name)
@pytest.mark.parametrize("seed", seeds(3))
def test_what_has_no_rhythm_is_no_pattern(case: Case, seed: int) -> None:
    assert patterns(case, seed) == set()


@pytest.mark.parametrize(
    "make",
    [
        partial(FIVE, (BitFlips(0.003),)),
        partial(FIVE, (BitFlips(0.01, ("unit 2",)),)),
        partial(FAST, (MarkParity(0.01),)),
        partial(modbus, (NoiseInGaps(0.2),), pause=100 * MS),
        partial(modbus, (BitFlips(0.01),), is_ascii=True),
        partial(n2, (BitFlips(0.003), NoiseInGaps(0.1))),
        partial(mstp, (BitFlips(0.001),)),
    ],
)
@pytest.mark.parametrize("tap", [EXACT, FTDI], ids=lambda tap: tap.name)
def test_random_damage_is_no_pattern(make: partial, tap) -> None:  # type: ignore[type-arg,no-untyped-def]
    seconds = 12 if make.func is mstp else 60
    assert patterns(Case("", make, (), tap, seconds)) == set()


def test_hum_is_not_told_from_times_that_do_not_allow_it() -> None:
    hum = next(case for case in LINE_RULE_CASES if "50 Hz" in case.name)
    assert patterns(Case("", hum.make, (), FTDI)) == set()
    assert patterns(hum) == {"LN301"}


def test_other_periods_are_no_mains() -> None:
    for period in (13 * MS, 17 * MS, 23 * MS):
        assert "LN301" not in patterns(Case("", partial(FAST, (AtTimes(period, 2 * MS, 0.1),)), ()))


def test_one_station_that_dies_is_not_several() -> None:
    assert patterns(Case("", partial(FIVE, change={2: partial(Dies, at=20 * S)}), ())) == set()


def test_stations_that_die_one_after_the_other_share_nothing() -> None:
    dies = {2: partial(Dies, at=15 * S), 3: partial(Dies, at=30 * S), 5: partial(Dies, at=45 * S)}
    assert patterns(Case("", partial(FIVE, change=dies), ())) == set()


def test_a_station_lost_alone_is_not_explained_by_others() -> None:
    dies = {2: partial(Dies, at=20 * S), 3: partial(Dies, at=20 * S), 5: partial(Dies, at=45 * S)}
    found = {(one.code, one.subject): one for one in run(Case("", partial(FIVE, change=dies), ())).findings}
    assert found["LN305", "bus"].stations == (2, 3)
    assert found["MB003", "station 2"].cause == ("LN305", "bus")
    assert found["MB003", "station 5"].cause is None


def test_regular_pauses_are_the_masters_own_way() -> None:
    pauses = tuple((float(begin), 8.0) for begin in range(5, 50, 5))
    assert patterns(Case("", modbus, (), hear=partial(paused, pauses))) == set()


def test_one_stations_own_rhythm_is_no_hum() -> None:
    line = LineSettings.parse("38400,8N1")
    told = TimePatterns(Session("x", line, "modbus-rtu"))
    for no in range(1, 121):
        octets, start = bytes(8), no * 50 * MS
        damage = Damage.CHECK if no % 2 else None
        check = Check.BAD if no % 2 else Check.GOOD
        frame = Frame("x", octets, start + no % 2 * 3 * MS, start + 5 * MS, check, FoundBy.GAP, damage)
        told.see(no, frame, "station 6" if no % 2 else "master")
    assert list(told.findings()) == []


def test_a_contactor_shows_among_single_errors() -> None:
    faults = (AtTimes(6 * S, 200 * MS, 0.5), BitFlips(0.0004))
    assert "LN302" in patterns(Case("", partial(FIVE, faults), (), seconds=90))


def test_a_master_that_stops_for_some_seconds() -> None:
    assert patterns(Case("", modbus, (), hear=partial(paused, ((20.0, 4.0),)))) == {"LN304"}
    assert patterns(Case("", modbus, (), hear=partial(paused, ((20.0, 1.0),)))) == set()
