"""The N2 points of a TECO F510 drive, as its manual lists them (F510 communication addendum 1.2.4).

Data for the simulated follower. What the drive means by a point belongs to its device profile.
"""

from __future__ import annotations

from dataclasses import dataclass

_AI, _BI, _AO, _BO = 1, 2, 3, 4


@dataclass(frozen=True, slots=True)
class Point:
    """One object. `low`, `high`: its range; `writable`: whether an override changes it; `initial`: at power-up."""

    region: int
    number: int
    name: str
    unit: str
    low: float
    high: float
    writable: bool = False
    initial: float = 0.0


def _speeds() -> tuple[Point, ...]:
    """AO 11 … 26: the frequencies of the 16 speed stages."""
    return tuple(Point(_AO, 10 + n, f"FreqCommand{n}", "Hz", 0, 400, True, 2.5 * n) for n in range(1, 17))


POINTS: tuple[Point, ...] = (
    Point(_AI, 1, "Motor R-RPM", "", 0, 60000, initial=1750),
    Point(_AI, 2, "Motor R-Volt", "V", 0, 480, initial=460),
    Point(_AI, 3, "Motor R-HP", "hp", 0, 600, initial=7.5),
    Point(_AI, 4, "Motor R-Hz", "Hz", 0, 400, initial=60),
    Point(_AI, 5, "Comm Station", "", 1, 254, initial=1),
    Point(_AI, 6, "CommSel", "", 0, 3, initial=2),
    Point(_AI, 7, "BaudRate", "", 0, 5, initial=3),
    Point(_AI, 8, "CarrierFreq", "kHz", 0, 16, initial=4),
    Point(_AI, 9, "Freq cmd", "Hz", 0, 400),
    Point(_AI, 10, "Frequency", "Hz", 0, 400),
    Point(_AI, 11, "Current", "A", 0, 6553.5),
    Point(_AI, 12, "Control Mode", "", 0, 5),
    Point(_AI, 13, "TM2 AIN", "V", 0, 100, initial=3.2),
    Point(_AI, 14, "TM2 AIN2", "V", 0, 100),
    Point(_AI, 15, "Error code", "", 0, 45),
    Point(_AO, 1, "Set frequency", "Hz", 0, 400, True),
    Point(_AO, 2, "AO1", "V/A", 0, 100),
    Point(_AO, 3, "AO2", "V/A", 0, 100),
    Point(_AO, 4, "RunSource", "", 0, 4, True, 2),
    Point(_AO, 5, "FrequenceComm", "", 0, 6, True, 3),
    Point(_AO, 6, "FreqUpperLim", "Hz", 0, 109, True, 100),
    Point(_AO, 7, "FreqLowerLim", "Hz", 0, 109, True),
    Point(_AO, 8, "Acc Time1", "s", 0, 6000, True, 10),
    Point(_AO, 9, "Dec Time1", "s", 0, 6000, True, 10),
    Point(_AO, 10, "Motor R-Amp", "A", 1, 999.9, True, 9.4),
    *_speeds(),
    Point(_AO, 27, "PwrL Sel", "", 0, 1),
    Point(_AO, 28, "RestartDelay", "s", 0, 7200),
    Point(_AO, 29, "RestartSel", "", 0, 10),
    Point(_AO, 30, "StoppingSel", "", 0, 1, True),
    Point(_AO, 31, "PID P Gain", "", 0, 10, True, 1),
    Point(_AO, 32, "PID I Time", "", 0, 100, True, 1),
    Point(_AO, 33, "PID D Time", "", 0, 10, True),
    Point(_AO, 34, "ReverseOper", "", 0, 2, True),
    Point(_BI, 1, "Run/Stop", "", 0, 1),
    Point(_BI, 2, "Direction", "", 0, 1),
    Point(_BI, 3, "Status", "", 0, 1),
    Point(_BI, 4, "Abnormal", "", 0, 1),
    *(Point(_BI, 4 + n, f"DI_{n} Status", "", 0, 1) for n in range(1, 7)),
    Point(_BO, 1, "Run/Stop", "", 0, 1, True),
    Point(_BO, 2, "Forward/Reverse", "", 0, 1, True),
    *(Point(_BO, 2 + n, f"RY{n} Status", "", 0, 1) for n in range(1, 4)),
)
