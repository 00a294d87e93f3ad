"""Whose trouble it is: who is struck more than his share is named, what falls anywhere is the bus's."""

from __future__ import annotations

import random
from functools import partial

import pytest

from dissectors.findings import Finding, Severity
from dissectors.frame import Place
from dissectors.simulated_faults import BitFlips, Break, MarkParity, NoiseInGaps
from sniff.analysis.shares import only_struck, standing_out
from sniff.simulation.tap import EXACT, FTDI, UART, TapModel
from tests.faults.buses import modbus, mstp, n2
from tests.faults.case import Case
from tests.faults.matrix import run
from tests.faults.stations import Of
from tests.seeds import seeds

ASCII = partial(modbus, is_ascii=True)
FIVE = partial(modbus, units=(1, 2, 3, 4, 5))


@pytest.mark.parametrize("seed", seeds(30, 12))
def test_noise_that_falls_anywhere_names_nobody(seed: int) -> None:
    dice = random.Random(seed)
    shares = {"master": 4.0, "station 1": 1.0, "station 2": 2.0, "station 3": 1.0}
    struck = dice.choices(list(shares), list(shares.values()), k=60)
    assert standing_out({name: (struck.count(name), share) for name, share in shares.items()}, "master") == set()


def test_who_is_struck_more_than_his_share_is_named() -> None:
    assert standing_out({"1": (30, 1.0), "2": (3, 1.0), "3": (4, 1.0), "master": (9, 3.0)}, "master") == {"1"}
    assert standing_out({"1": (30, 1.0), "2": (28, 1.0), "3": (1, 1.0), "master": (0, 3.0)}, "master") == set()
    assert standing_out({"1": (0, 1.0), "2": (1, 1.0), "master": (30, 2.0)}, "master") == {"master"}
    assert standing_out({"1": (2, 1.0), "2": (0, 1.0)}) == set()
    assert standing_out({}) == standing_out({"1": (5, 1.0)}) == set()


def test_who_sends_little_is_not_named_for_a_few() -> None:
    others = {f"station {number}": (50, 100_000.0) for number in range(1, 20)}
    assert standing_out({**others, "station 20": (4, 1_000.0)}) == set()
    assert standing_out({**others, "station 20": (9, 1_000.0)}) == {"station 20"}


def test_twice_as_much_as_the_others_is_not_clearly_more_however_often() -> None:
    assert standing_out({"1": (400, 1.0), "2": (200, 1.0), "3": (200, 1.0)}) == set()
    assert standing_out({"1": (500, 1.0), "2": (200, 1.0), "3": (200, 1.0)}) == {"1"}


def graves(make: partial, tap: TapModel = EXACT, seconds: float = 30, seed: int = 1) -> set[tuple[str, str]]:  # type: ignore[type-arg]
    found: tuple[Finding, ...] = run(Case("", make, (), tap, seconds), seed).findings
    return {(one.code, one.subject) for one in found if one.severity >= Severity.WARNING and one.code.startswith("LN")}


@pytest.mark.parametrize("tap", [EXACT, FTDI, UART], ids=lambda tap: tap.name)
@pytest.mark.parametrize("bus", [modbus, ASCII], ids=["RTU", "ASCII"])
def test_parity_errors_of_one_station_are_its_own(bus: partial, tap: TapModel) -> None:  # type: ignore[type-arg]
    assert graves(partial(bus, (MarkParity(0.01, ("unit 2",)),)), tap) == {("LN101", "station 2")}


@pytest.mark.parametrize("tap", [EXACT, FTDI, UART], ids=lambda tap: tap.name)
def test_parity_errors_of_all_are_the_bus(tap: TapModel) -> None:
    assert graves(partial(modbus, (MarkParity(0.004),)), tap) == {("LN101", "bus")}
    flips = run(Case("", partial(FIVE, (BitFlips(0.002),)), (), tap, 30), 1).findings
    graves_of_all = [(one.code, one.subject) for one in flips if one.severity >= Severity.WARNING]
    assert graves_of_all == [("MB007", "bus")]  # which tells the same trouble
    assert next(one.cause for one in flips if one.code == "LN101") == ("MB007", "bus")


@pytest.mark.parametrize("tap", [EXACT, UART], ids=lambda tap: tap.name)
def test_breaks_of_one_station_are_its_own(tap: TapModel) -> None:
    assert graves(partial(modbus, (Of("unit 2", Break(0.1)),)), tap) == {("LN103", "station 2")}
    assert graves(partial(modbus, (Break(0.05),)), tap) == {("LN103", "bus")}


@pytest.mark.parametrize("tap", [EXACT, FTDI, UART], ids=lambda tap: tap.name)
@pytest.mark.parametrize("bus", [FIVE, ASCII, n2], ids=["RTU", "ASCII", "N2"])
def test_noise_anywhere_is_one_finding_about_the_bus(bus: partial, tap: TapModel) -> None:  # type: ignore[type-arg]
    assert graves(partial(bus, (NoiseInGaps(0.15),)), tap) == {("LN203", "bus")}


def test_ringing_after_everybodys_frames_is_one_finding_about_the_bus() -> None:
    ringing = NoiseInGaps(0.2, places=(Place.AFTER,), values=b"\xff", most=1)
    assert graves(partial(FIVE, (ringing,))) == {("LN202", "bus")}
    zeros = NoiseInGaps(0.2, places=(Place.AFTER,), values=b"\0", most=1)  # FF is the filler that MS/TP allows
    assert graves(partial(mstp, (zeros,)), seconds=8) == {("LN202", "bus")}


@pytest.mark.parametrize("tap", [EXACT, FTDI, UART], ids=lambda tap: tap.name)
def test_noise_before_one_station_is_its_own(tap: TapModel) -> None:
    before = Of("unit 2", NoiseInGaps(0.1, places=(Place.BEFORE,)))
    assert graves(partial(modbus, (before,)), tap) == {("LN201", "station 2")}


def test_the_only_one_that_is_struck_often_enough() -> None:
    assert only_struck({"1": (3, 1.0), "2": (0, 1.0), "master": (0, 2.0)}) == {"1"}
    assert only_struck({"1": (1, 1.0), "2": (0, 1.0), "master": (0, 2.0)}) == set()
    assert only_struck({"1": (9, 1.0), "2": (1, 1.0)}) == only_struck({}) == only_struck({"1": (0, 0.0)}) == set()
