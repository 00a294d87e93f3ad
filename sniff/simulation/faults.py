"""What can go wrong on a simulated line: the faults of `dissectors/simulated_faults.py`, where scenarios name them."""

from __future__ import annotations

from dissectors.simulated_faults import (
    NOISE,
    BitFlips,
    Break,
    CutShort,
    DuplicateAddress,
    EarlyRelease,
    Echo,
    Fault,
    LateResponse,
    LostResponse,
    MarkParity,
    NoiseInGaps,
    Transmission,
)

__all__ = [
    "NOISE",
    "BitFlips",
    "Break",
    "CutShort",
    "DuplicateAddress",
    "EarlyRelease",
    "Echo",
    "Fault",
    "LateResponse",
    "LostResponse",
    "MarkParity",
    "NoiseInGaps",
    "Transmission",
]
