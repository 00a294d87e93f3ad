"""Stray octets that are one kind with others are told once: a driver seen apart from its frame, an end character."""

from __future__ import annotations

from functools import partial

from dissectors.findings import Finding, Severity
from dissectors.frame import Place
from dissectors.simulated_faults import NoiseInGaps
from sniff.simulation.tap import EXACT, FTDI, TapModel
from tests.faults.buses import modbus
from tests.faults.case import Case
from tests.faults.judged import run
from tests.faults.stations import Of


def strays(fault: object, tap: TapModel, seconds: float = 20) -> dict[tuple[str, str], Finding]:
    found = run(Case("", partial(modbus, (fault,), units=(1, 2, 3, 4, 5)), (), tap, seconds), 1).findings
    return {(one.code, one.subject): one for one in found if one.code.startswith("LN2")}


def test_the_same_octets_apart_from_the_frame_are_the_senders_too() -> None:
    falls = Of("unit 2", NoiseInGaps(1.0, places=(Place.AFTER,), values=b"\0", most=1))
    found = strays(falls, FTDI)
    (own,) = (key for key, one in found.items() if one.severity >= Severity.WARNING)
    assert own[1] == "station 2"
    assert {one.cause for key, one in found.items() if key != own} <= {own}


def test_an_octet_behind_every_frame_is_an_end_character_that_is_set() -> None:
    found = strays(NoiseInGaps(1.0, places=(Place.AFTER,), values=b";", most=1), EXACT)
    assert {key: one.severity for key, one in found.items()} == {("LN202", "bus"): Severity.NOTE}
    assert "end character" in found["LN202", "bus"].means


def test_a_level_behind_every_frame_is_none() -> None:
    found = strays(NoiseInGaps(1.0, places=(Place.AFTER,), values=b"\xf8", most=1), EXACT)
    assert found["LN202", "bus"].severity is Severity.WARNING
