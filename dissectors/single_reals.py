"""Real numbers of 32 bits in decimal, with as many digits as they have and no more."""

from __future__ import annotations

import math
import struct


def shortest(value: float) -> float:
    """The shortest decimal that means the same single: 59.9 and not 59.9000015."""
    if not math.isfinite(value):
        return value
    for digits in (6, 7, 8, 9):
        rounded = float(f"{value:.{digits}g}")
        try:
            if struct.pack(">f", rounded) == struct.pack(">f", value):
                return rounded
        except OverflowError:  # rounded up beyond the largest there is
            continue
    return value


def shortest_text(value: float) -> str:
    """The same as text, a whole number as such."""
    return repr(shortest(value)).removesuffix(".0")
