"""A copy behind a late read may be the master's next request: it proves no second answer, whatever the function."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import cycle
from random import Random

import pytest

from dissectors.findings import Severity
from dissectors.frame import Chunk
from dissectors.line import MS, LineSettings
from dissectors.modbus.envelope import seal_rtu
from sniff.engine.session import Session
from tests.faults.hearing import held_back
from tests.faults.judged import findings_of

SESSION = Session("x", LineSettings.parse("38400,8E1"), "modbus-rtu")
DELAY, PAUSE = 4 * MS, 3_500_000  # ns, of the station and of the master

COPIES = {
    "write coil": "20 05 00 28 FF 00",
    "write register": "20 06 00 28 01 8B",
    "loop back": "20 08 00 00 A5 37",
    "mask write": "20 16 00 04 00 F2 00 25",
    "vendor function": "20 41 01 02 03 04",
}


def bus(said: str, seconds: int) -> Iterator[Chunk]:
    """One command for ever, each time confirmed; exact times."""
    octets = seal_rtu(bytes.fromhex(said))
    time, silences = 0, cycle((PAUSE, DELAY))
    while time < seconds * 1000 * MS:
        time += next(silences) + len(octets) * SESSION.line.char
        yield Chunk(time, octets)


@pytest.mark.parametrize("seed", [1, 4])
@pytest.mark.parametrize("said", COPIES.values(), ids=COPIES)
def test_nobody_is_told_to_answer_twice(said: str, seed: int) -> None:
    heard = [item for item in held_back(bus(said, 20), Random(seed)) if isinstance(item, Chunk)]
    found = findings_of(SESSION, heard)
    assert [one.code for one in found if one.severity >= Severity.WARNING] == []
