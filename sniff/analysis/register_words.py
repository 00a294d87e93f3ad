"""What words of registers over time are like: read as a kind of number, wild, growing, bits, text. Pure."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from dissectors.profiles.model import Kind
from sniff.analysis.register_series import Words

Floats = npt.NDArray[np.float64]
Wide = npt.NDArray[np.int64]

ENOUGH = 8
"""Different values that a register must have shown before anything of it is sure."""

SMALLEST, LARGEST = 1e-3, 1e8
"""Magnitudes that measured values usually have."""

FLOAT_EXPONENTS = 0x3A80, 0x4CC0
"""The highest words of floats of such magnitudes, their sign taken off."""

_WILD = 0x6000  # a word that spans so much, without order, is the low part of something wider


def read_as(words: Words, kind: Kind, swapped: bool, little: bool) -> Floats:
    """float64[answers]: what columns of words are, read as a kind; for whole numbers of 64 bits rounded."""
    octets = np.ascontiguousarray(ordered(words, swapped, little).astype(">u2"))
    form = {"u": ">u", "s": ">i", "f": ">f"}[kind.value[0]] + str(2 * kind.registers)
    with np.errstate(invalid="ignore"):
        return octets.view(form)[:, 0].astype(np.float64)


def ordered(words: Words, swapped: bool, little: bool) -> Words:
    """Highest word first, highest octet first."""
    words = words.byteswap() if little else words
    return words[:, ::-1] if swapped else words


def are_usual(values: Floats) -> bool:
    """Whether all are numbers as instruments show them."""
    size = np.abs(values[values != 0])
    return bool(np.isfinite(values).all() and len(size) and (size >= SMALLEST).all() and (size <= LARGEST).all())


def are_exponents(high: Words, least: int, most: int) -> bool:
    """Whether the highest words, their sign taken off, lie where usual numbers have theirs."""
    size = high & 0x7FFF
    return bool(len(size) and (size >= least).all() and (size <= most).all())


def is_wild(column: Words) -> bool:
    """Whether a word runs through its values without order, as the low part of a wider number does."""
    values = column.astype(np.int64)
    steps = np.abs(np.diff(values))
    return (
        len(np.unique(values)) >= ENOUGH and int(np.ptp(values)) >= _WILD and float(np.median(steps[steps > 0])) > 0x800
    )


def grow(values: Wide | Floats) -> bool:
    """Whether a series only ever grows."""
    steps = np.diff(values)
    return bool(len(steps) and (steps >= 0).all() and np.count_nonzero(steps) >= 2)


def may_be_decimal(words: npt.NDArray[Any]) -> bool:
    """Whether no half octet is ever above 9: a number in decimal digits (BCD), of which no profile has a type."""
    whole = words.astype(np.int64)
    return all(bool(((whole >> shift & 0xF) <= 9).all()) for shift in (0, 4, 8, 12))


def are_bits(column: Words) -> bool:
    """Whether single bits come and go, several of them: no number does that."""
    changed = np.bitwise_xor(column[1:], column[:-1])
    changed = changed[changed != 0]
    single = (changed & (changed - 1)) == 0
    return len(np.unique(changed)) >= 3 and bool(single.mean() >= 0.9) and int(np.ptp(column)) > 8


def are_text(pair: Words) -> bool:
    """Whether two registers hold letters that never change."""
    octets = np.ascontiguousarray(pair.astype(">u2")).view(np.uint8)
    constant = bool((pair == pair[0]).all())
    return constant and bool(((octets >= 0x20) & (octets < 0x7F) | (octets == 0)).all()) and bool((octets > 0x40).any())
