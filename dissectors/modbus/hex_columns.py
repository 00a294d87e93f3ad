"""Pairs of hex digits to octets, of many ASCII frames at once."""

from __future__ import annotations

from typing import Final

import numpy as np

from dissectors.columns import Octets, Times

NO_DIGIT: Final = 0xFF
DIGITS: Final = np.full(256, NO_DIGIT, np.uint8)
"""What a character stands for, in upper and lower case."""
for _digit in b"0123456789ABCDEFabcdef":
    DIGITS[_digit] = int(chr(_digit), 16)


def octets_of_pairs(characters: Octets, first: Times, pairs: Times) -> Octets:
    """The octets of all frames, one behind the other: `pairs` of each, from the character at `first` on.

    Total: what is no digit, or lies behind the last character, gives anything.
    """
    before = np.cumsum(pairs) - pairs
    at = np.repeat(first - 2 * before, pairs) + 2 * np.arange(int(pairs.sum()))
    high: Octets = DIGITS.take(characters.take(at, mode="clip"))
    low: Octets = DIGITS.take(characters.take(at + 1, mode="clip"))
    octets: Octets = np.left_shift(high, np.uint8(4)) | low
    return octets
