"""The simulated bus of N2: two drives under a supervisor."""

from __future__ import annotations

from collections.abc import Mapping

from dissectors.frame import Place
from dissectors.line import MS, LineSettings
from dissectors.n2.f510 import POINTS
from dissectors.n2.simulated import Follower, Master, overriding, reading, readings, releasing
from dissectors.simulated import Party, SimulatedBus
from dissectors.simulated_faults import BitFlips, Break, LateResponse, LostResponse, NoiseInGaps


def scenarios() -> Mapping[str, SimulatedBus]:
    """The one bus, by its name."""
    bus = SimulatedBus(
        parties=_parties,
        faults=(
            BitFlips(2e-4),
            LostResponse(0.004),
            LateResponse(0.003, 270 * MS),
            NoiseInGaps(0.01, places=(Place.BETWEEN, Place.AFTER)),
            Break(0.0005),
        ),
        devices=dict.fromkeys((1, 2), "teco-f510"),
        text="two TECO F510 drives under a supervisor; address 3 is absent",
    )
    return {"n2": bus}


def _parties(line: LineSettings, faults: bool) -> list[Party]:
    monitored = [point for point in POINTS if point.region in (1, 2)]
    jobs = [
        *readings(1, monitored),
        overriding(1, 3, 1, 45.0),
        overriding(1, 4, 1, 1),
        *readings(2, monitored),
        overriding(2, 3, 1, 30.0),
        overriding(2, 4, 1, 1),
        reading(3, 1, 9),  # nobody there
        overriding(1, 3, 1, 900.0),  # out of range
        releasing(1, 3, 1),
    ]
    master = Master(jobs, line=line, delay=60 * MS, timeout=250 * MS, retries=1)
    return [
        Party("supervisor", master, answers=False),
        Party("drive 1", Follower(1, delay=10 * MS)),
        Party("drive 2", Follower(2, delay=18 * MS)),
    ]
