"""Makes the simulated captures of the project: `python -m tests.sniff.simulation.make_captures FOLDER`.

Each is a scenario of the virtual bus with the same seed every time, so the files change only when the simulation does.
After a change: `pytest --sniff-update captures`, and read the diff.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from dissectors.line import NS_PER_S
from dissectors.simulated_faults import (
    BitFlips,
    Break,
    DuplicateAddress,
    EarlyRelease,
    Fault,
    LostResponse,
    NoiseInGaps,
)
from sniff.bus.capture_writer import create
from sniff.simulation.scenarios import scenario, simulate
from sniff.simulation.tap import EXACT, FTDI, UART, TapModel

STARTED = 1_772_359_200 * 1_000_000_000
"""2026-03-01T10:00:00Z, ns."""


@dataclass(frozen=True, slots=True)
class Made:
    """One capture: which bus, for how long (s), with which faults (None: the scenario's own), through what.

    `skip`: s of the run before it begins.
    """

    scenario: str
    seconds: float
    faults: tuple[Fault, ...] | None = ()
    tap: TapModel = EXACT
    seed: int = 485
    skip: float = 0


NOISY = (NoiseInGaps(0.3), BitFlips(0.002))
CAPTURES: Mapping[str, Made] = {
    "rtu-clean": Made("modbus-rtu", 3),
    "rtu-usual-faults": Made("modbus-rtu", 12, None),
    "rtu-noisy-ftdi": Made("modbus-rtu", 3, NOISY, FTDI),
    "rtu-early-release": Made("modbus-rtu", 4, (EarlyRelease(0.5, ("drive 2",)),), UART),
    "rtu-duplicate-address": Made("modbus-rtu", 4, (DuplicateAddress("drive 1", 3_000_000),)),
    "ascii-clean": Made("modbus-ascii", 3),
    "ascii-usual-faults": Made("modbus-ascii", 10, None),
    "ascii-noisy-ftdi": Made("modbus-ascii", 3, NOISY, FTDI),
    "n2-clean": Made("n2", 4),
    "n2-usual-faults": Made("n2", 20, None),
    "n2-noisy-ftdi": Made("n2", 4, NOISY, FTDI),
    "mstp-clean": Made("mstp", 2),
    "mstp-usual-faults": Made("mstp", 6, None),
    "mstp-noisy-ftdi": Made("mstp", 2, (NoiseInGaps(0.05), BitFlips(0.001), LostResponse(0.02)), FTDI),
    "mstp-exceptions": Made("mstp", 0.6, skip=10.2),
    "mstp-breaks": Made("mstp", 2, (Break(0.02),), UART),
    "profibus-clean": Made("profibus", 1),
    "profibus-usual-faults": Made("profibus", 3, None, skip=5),
    "profibus-noisy-ftdi": Made("profibus", 2, (NoiseInGaps(0.05), BitFlips(0.001), LostResponse(0.02)), FTDI),
}


def make(folder: Path) -> list[Path]:
    """Write every capture; give the paths."""
    paths = []
    for name, made in CAPTURES.items():
        plan = scenario(made.scenario, made.seed, faults=made.faults is None)
        if made.faults is not None:
            plan = replace(plan, faults=made.faults)
        session, items = simulate(plan, made.skip + made.seconds, made.tap, STARTED)
        begin = STARTED + int(made.skip * NS_PER_S)
        path = folder / f"{name}.cap.txt"
        with create(path, replace(session, started=begin, notes={})) as writer:
            for item in items:
                if item.time >= begin:
                    writer.write(item)
        paths.append(path)
    return paths


if __name__ == "__main__":
    for written in make(Path(sys.argv[1] if len(sys.argv) > 1 else "captures")):
        sys.stdout.write(f"{written}\n")
