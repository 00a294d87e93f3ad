"""First octets that a driver spoils: the line errors on them are the same trouble, told once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from random import Random
from typing import ClassVar

import pytest

from dissectors.findings import Severity
from dissectors.line import LineSettings
from dissectors.simulated_faults import Transmission
from sniff.simulation.tap import EXACT, FTDI
from tests.faults.buses import modbus
from tests.faults.case import Case
from tests.faults.matrix import run
from tests.faults.stations import Of


@dataclass(frozen=True, slots=True)
class FirstSpoilt:
    """A driver that is on too late: bits of its first octet are anything."""

    name: ClassVar[str] = "first-spoilt"

    def strike(self, sent: Transmission, now: int, line: LineSettings, dice: Random) -> tuple[Transmission, ...]:
        """Change the first octet, parity included."""
        return (sent.hit(self.name, flips={0: dice.randrange(1, 512)}),)


@pytest.mark.parametrize("tap", [EXACT, FTDI], ids=lambda tap: tap.name)
def test_line_errors_of_first_octets_that_a_driver_spoils_are_told_once(tap) -> None:  # type: ignore[no-untyped-def]
    make = partial(modbus, (Of("unit 2", FirstSpoilt()),))
    found = [one for one in run(Case("", make, (), tap, 20)).findings if one.severity >= Severity.NOTE]
    assert {(one.code, one.subject) for one in found if one.cause is None} == {("MB012", "station 2")}
    assert {one.cause for one in found if one.code == "LN101"} == {("MB012", "station 2")}
