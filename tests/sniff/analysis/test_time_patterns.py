"""Patterns in time are told where there are some, and never of what has none."""

from __future__ import annotations

import random
from functools import partial

import numpy as np
import pytest

from dissectors.frame import Check, Damage, Event, FoundBy, Frame, Noise, Place, Reason
from dissectors.line import LineSettings, Timing
from dissectors.modbus.simulated import Cells, ModbusServer
from dissectors.modbus.simulated_master import PollingMaster, read_holding
from dissectors.simulated_faults import BitFlips, Fault, MarkParity, NoiseInGaps
from sniff.analysis.rounds import Bouts
from sniff.analysis.time_patterns import TimePatterns
from sniff.engine.session import Session
from sniff.simulation.scenarios import Scenario
from sniff.simulation.tap import EXACT, FTDI
from sniff.simulation.wire import Party
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


def vars_of(bouts: Bouts) -> list[object]:
    return [getattr(bouts, name) for name in ("_now", "_begun", "_is_at_rest", "_every")]


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


def in_groups(faults: tuple[Fault, ...], every: int, seed: int = 0) -> Scenario:
    """Polls in a group now and then, each time for something else: no request comes at the interval of the groups."""
    line = LineSettings.parse("19200,8E1")
    units = (1, 2, 3, 4, 5)

    def parties() -> list[Party]:
        requests = [lambda now, unit=unit: read_holding(unit, now // every % 30, 6) for unit in units] * 2
        master = PollingMaster(requests, line, interval=every, pause=25 * MS, timeout=700 * MS, retries=1)
        servers = [ModbusServer(unit, holding=Cells(dict.fromkeys(range(40), 7)), delay=9 * MS) for unit in units]
        return [Party("master", master, answers=False)] + [Party(f"unit {one.unit}", one) for one in servers]

    return Scenario("", "modbus-rtu", line, parties, faults, seed, Timing(line).t35)


def test_a_bus_that_speaks_at_an_interval_is_struck_at_that_interval() -> None:
    assert patterns(Case("", partial(in_groups, (MarkParity(0.01),), 5 * S), ()), 2) == set()


def test_something_that_switches_shows_on_a_bus_that_speaks_at_an_interval_of_its_own() -> None:
    case = Case("", partial(in_groups, (AtTimes(7 * S, 400 * MS, 0.3),), S), (), seconds=80)
    assert patterns(case) == {"LN302"}


def test_when_a_bus_begins_to_speak_is_the_same_by_rows_and_by_columns() -> None:
    dice = random.Random(3)
    starts = np.cumsum([dice.choice((5 * MS, 20 * MS, 600 * MS, 2 * S)) for _ in range(400)])
    ends, rests = starts + 4 * MS, np.array([dice.random() < 0.7 for _ in range(400)])
    by_rows, by_columns = Bouts(), Bouts()
    for start, end, at_rest in zip(starts.tolist(), ends.tolist(), rests.tolist(), strict=True):
        by_rows.see(start, end, at_rest)
    for begin in (0, 1, 150):
        end = {0: 1, 1: 150, 150: 400}[begin]
        by_columns.take(starts[begin:end], ends[begin:end], rests[begin:end])
    assert vars_of(by_rows) == vars_of(by_columns)


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


@pytest.mark.parametrize("others", [0, 1])
def test_noise_beside_the_only_one_that_is_struck_is_its_own(others: int) -> None:
    """Station 6 answers at an interval, and leaves an octet that is no frame; then the master, too, is struck."""
    told = TimePatterns(Session("x", LineSettings.parse("38400,8N1"), "modbus-rtu"))
    rows: list[tuple[Event, str]] = []
    for no in range(20 * 12):
        start, is_bad, octets = no * 200 * MS, no % 20 < 2 + others, bytes((3, no, 0, 0, 0, 0, 0, 0))
        damage, check = (Damage.CHECK, Check.BAD) if is_bad else (None, Check.GOOD)
        sender = "station 6" if no % 20 < 2 else "master"
        rows.append((Frame("x", octets, start, start + 5 * MS, check, FoundBy.GAP, damage), sender))
        if is_bad:
            rest = Noise(b"\r", start + 20 * MS, start + 21 * MS, Place.BETWEEN, Reason.NO_FRAME)
            rows.append((rest, "bus"))
    for no, (event, sender) in enumerate(rows, 1):
        told.see(no, event, sender)
    assert [one.code for one in told.findings()] == ["LN302"] * others


def test_a_contactor_shows_among_single_errors() -> None:
    faults = (AtTimes(6 * S, 200 * MS, 0.5), BitFlips(0.0004))
    assert "LN302" in patterns(Case("", partial(FIVE, faults), (), seconds=90))


def test_bursts_of_a_night_show_among_many_single_errors() -> None:
    told, dice = TimePatterns(Session("x", LineSettings.parse("38400,8N1"), "modbus-rtu")), random.Random(1)
    rows = [(at * 600 * S + k * 30 * MS, f"station {k}", False) for at in range(1, 31) for k in range(1, 5)]
    rows += [(dice.randrange(18_000) * S + 90 * MS, f"station {at % 5}", False) for at in range(600)]
    rows += [(at * 2 * S + 500 * MS, "master", True) for at in range(9_000)]
    for no, (start, sender, is_good) in enumerate(sorted(rows), 1):
        check, damage = (Check.GOOD, None) if is_good else (Check.BAD, Damage.CHECK)
        told.see(no, Frame("x", no.to_bytes(4), start, start + MS, check, FoundBy.GAP, damage), sender)
    found = [one for one in told.findings() if one.code == "LN302"]
    assert [("of 10 min," in one.seen) for one in found] == [True]


def test_a_master_that_stops_for_some_seconds() -> None:
    assert patterns(Case("", modbus, (), hear=partial(paused, ((20.0, 4.0),)))) == {"LN304"}
    assert patterns(Case("", modbus, (), hear=partial(paused, ((20.0, 1.0),)))) == set()
