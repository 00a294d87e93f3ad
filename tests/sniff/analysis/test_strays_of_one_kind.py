"""Stray octets that are one kind with others are told once: a driver seen apart from its frame, an end character."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from random import Random
from typing import ClassVar

from dissectors.findings import Finding, Severity
from dissectors.frame import Place
from dissectors.line import LineSettings
from dissectors.simulated_faults import Fault, NoiseInGaps, Transmission
from sniff.simulation.tap import EXACT, FTDI, TapModel
from tests.faults.buses import modbus
from tests.faults.case import Case
from tests.faults.judged import run
from tests.faults.stations import Of


@dataclass(frozen=True, slots=True)
class OnlyGlitches:
    """A station whose driver moves the line, and that never answers."""

    party: str
    name: ClassVar[str] = "only-glitches"

    def strike(self, sent: Transmission, now: int, line: LineSettings, dice: Random) -> tuple[Transmission, ...]:
        return (sent.hit(self.name, octets=b"\0"),) if sent.party == self.party else (sent,)


def strays(fault: Fault, tap: TapModel, seconds: float = 20) -> dict[tuple[str, str], Finding]:
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


def test_strays_in_place_of_one_stations_answers_are_its_own() -> None:
    found = strays(OnlyGlitches("unit 3"), EXACT)
    assert {key: one.severity for key, one in found.items()} == {("LN203", "station 3"): Severity.NOTE}
    assert "in place of its answers" in found["LN203", "station 3"].seen
