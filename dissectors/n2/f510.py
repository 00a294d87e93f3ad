"""The N2 points of a TECO F510 drive for the simulated follower: its device profile, and what a drive holds at first.

Names, units, ranges and access are those of the profile (F510 communication addendum 1.2.4). The values at power-up are
plausible, not the manual's.
"""

from __future__ import annotations

from dataclasses import dataclass

from dissectors.profiles.model import Entry
from dissectors.profiles.packaged import packaged

_AI, _BI, _AO, _BO = 1, 2, 3, 4
_REGIONS = {"AI": _AI, "BI": _BI, "AO": _AO, "BO": _BO}


@dataclass(frozen=True, slots=True)
class F510Point:
    """One object. `low`, `high`: its range; `writable`: whether an override changes it; `initial`: at power-up."""

    region: int
    number: int
    name: str
    unit: str
    low: float
    high: float
    writable: bool = False
    initial: float = 0.0


_INITIAL: dict[str, float] = {
    "motor-rated-speed": 1750,
    "motor-rated-voltage": 460,
    "motor-rated-power": 7.5,
    "motor-rated-frequency": 60,
    "motor-rated-current": 9.4,
    "station-address": 1,
    "communication-mode": 2,
    "baud-rate": 3,
    "carrier-frequency": 4,
    "analog-input-1-voltage": 3.2,
    "run-source": 2,
    "frequency-source": 3,
    "upper-limit-frequency": 100,
    "acceleration-time-1": 10,
    "deceleration-time-1": 10,
    **{f"speed-stage-{stage}": 2.5 * (stage + 1) for stage in range(16)},
    "pid-gain": 1,
    "pid-integral-time": 1,
}


def _point(entry: Entry) -> F510Point:
    return F510Point(
        region=_REGIONS[entry.space],
        number=entry.address,
        name=entry.label,
        unit=entry.unit,
        low=entry.low if entry.low is not None else 0.0,
        high=entry.high if entry.high is not None else float("inf"),
        writable=entry.access.writable,
        initial=_INITIAL.get(entry.name, 0.0),
    )


POINTS: tuple[F510Point, ...] = tuple(map(_point, packaged("teco-f510").in_space(*_REGIONS)))
