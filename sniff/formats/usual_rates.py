"""Baud rates that are usual, and which of them a measured or computed rate stands for. Pure."""

from __future__ import annotations

USUAL = (
    *(300, 600, 1200, 1800, 2400, 4800, 7200, 9600, 14400, 19200, 28800, 31250, 38400, 45450, 56000, 57600, 76800),
    *(93750, 115200, 128000, 153600, 187500, 230400, 250000, 256000, 460800, 500000, 750000, 921600, 1_000_000),
    *(1_500_000, 2_000_000, 3_000_000, 4_000_000, 6_000_000, 8_000_000, 10_000_000, 12_000_000),
)
_SAME = 0.01
"""A clock divided by a whole number misses a rate by less; two usual ones lie farther apart."""


def nominal(rate: float) -> int:
    """The usual rate that is meant by one which an adapter's clock makes; the rate itself where that is none."""
    near = min(USUAL, key=lambda usual: abs(usual / rate - 1))
    return near if abs(near / rate - 1) <= _SAME else round(rate)
