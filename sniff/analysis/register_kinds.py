"""What one, two or four registers may hold, by their words over time: kind, order and use, with how sure. Pure.

It is sure only where what was heard excludes the other readings: a carry from one word into the next, a word that runs
through all its values while its neighbour stays where the exponents of usual numbers are, a step across zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from dissectors.profiles.model import Kind
from sniff.analysis.register_series import Words
from sniff.analysis.register_words import (
    ENOUGH,
    FLOAT_EXPONENTS,
    Floats,
    Wide,
    are_bits,
    are_exponents,
    are_text,
    are_usual,
    grow,
    is_wild,
    may_be_decimal,
    ordered,
    read_as,
)

_NEAR = 0x1000  # so close to zero, on both sides of it: a sign
_HALF = 1 << 31


class GuessSureness(IntEnum):
    """How far a guess goes."""

    OPEN = 0  # other readings fit as well
    LIKELY = 1
    SURE = 2  # what was heard excludes the others


class Use(IntEnum):
    """What a register is for, as far as its values tell."""

    CONSTANT = 0
    SENSOR = 1
    COUNTER = 2
    SETTING = 3  # a master writes it
    BITS = 4


@dataclass(frozen=True, slots=True)
class RegisterOrder:
    """Low register first, low octet first."""

    swapped: bool
    little: bool


ORDERS = (
    RegisterOrder(False, False),
    RegisterOrder(True, False),
    RegisterOrder(True, True),
    RegisterOrder(False, True),
)
"""The usual ones first: as the protocol has it, words swapped, all octets swapped, octets swapped in words."""


@dataclass(frozen=True, slots=True)
class RegisterReading:
    """One way to read registers."""

    kind: Kind
    order: RegisterOrder
    use: Use
    sure: GuessSureness


def one(column: Words) -> RegisterReading:
    """The best reading of a register by itself."""
    plain, distinct = ORDERS[0], np.unique(column)
    if len(distinct) == 1:
        return RegisterReading(Kind.U16, plain, Use.CONSTANT, GuessSureness.OPEN)
    signed = column.view(np.int16).astype(np.int64)
    steps, signed_steps = np.abs(np.diff(column.astype(np.int64))), np.diff(signed)
    below, above = bool((signed < 0).any()), bool((signed >= 0).any())
    if below and above and np.abs(signed_steps).max() < _NEAR <= steps.max():
        if not (signed_steps >= 0).all():
            sure = GuessSureness.SURE if len(distinct) >= ENOUGH else GuessSureness.LIKELY
            return RegisterReading(Kind.S16, plain, Use.SENSOR, sure)
        if np.ptp(signed) >= _NEAR:  # it only grows, and began anew behind the last number
            return RegisterReading(Kind.U16, plain, Use.COUNTER, GuessSureness.LIKELY)
        return RegisterReading(Kind.S16, plain, Use.SENSOR, GuessSureness.LIKELY)
    if below and not above and signed.min() > -_NEAR:
        return RegisterReading(Kind.S16, plain, Use.SENSOR, GuessSureness.LIKELY)
    if are_bits(column):
        return RegisterReading(Kind.U16, plain, Use.BITS, GuessSureness.LIKELY)
    is_open = len(distinct) < ENOUGH or may_be_decimal(column)
    sure = GuessSureness.OPEN if is_open else GuessSureness.LIKELY
    return RegisterReading(Kind.U16, plain, _use_of(column.astype(np.float64)), sure)


def two(pair: Words, order: RegisterOrder) -> RegisterReading | None:
    """What two registers are in an order; None where they are not one value."""
    if are_text(pair):
        return None  # words of text are no number; each stands alone
    sure = _float_fits(pair, order)
    if sure is None:
        return _sign_fits(pair, order) or _carry_fits(pair, order)
    return RegisterReading(Kind.F32, order, _use_of(_read(pair, Kind.F32, order)), sure)


def four(quad: Words, order: RegisterOrder) -> RegisterReading | None:
    """What four registers are in an order; None where they are not one value."""
    words = ordered(quad, order.swapped, order.little)
    if _float_fits(quad[:, :2] if order.swapped else quad[:, 2:], order) is not None:
        return None  # the lower half of a number of 64 bits would not be a usual number each time
    wild = is_wild(words[:, 3]) and is_wild(words[:, 2]) and are_exponents(words[:, 0], 0x3F50, 0x41A0)
    values = _read(quad, Kind.F64, order)
    if wild and are_usual(values):
        return RegisterReading(Kind.F64, order, _use_of(values), GuessSureness.SURE)
    whole = words.astype(np.int64)
    high, low = whole[:, 0] << 16 | whole[:, 1], whole[:, 2] << 16 | whole[:, 3]
    if is_wild(words[:, 3]) and high.max() < _HALF and _has_carried(high, low, 32) and grow(high << 32 | low):
        return RegisterReading(Kind.U64, order, Use.COUNTER, GuessSureness.LIKELY)  # or one of 32 bits, and others
    return None


def like_neighbours(pair: Words, order: RegisterOrder) -> RegisterReading | None:
    """Two registers of which nothing is known, in the order of their neighbours: a float of a round value, or a small
    count."""
    values = _read(pair, Kind.F32, order)
    high = ordered(pair, order.swapped, order.little)[:, 0]
    if not values.any():
        return RegisterReading(Kind.F32, order, Use.CONSTANT, GuessSureness.OPEN)
    if are_usual(values) and are_exponents(high[high != 0], *FLOAT_EXPONENTS):
        return RegisterReading(Kind.F32, order, _use_of(values), GuessSureness.LIKELY)
    whole = _read(pair, Kind.U32, order)
    if high[0] < 0x1000 and (high == high[0]).all() and grow(whole):
        return RegisterReading(Kind.U32, order, Use.COUNTER, GuessSureness.LIKELY)
    return None


def written_at_once(pair: Words, orders: Sequence[RegisterOrder]) -> RegisterReading | None:
    """Two registers that a master writes together: likely one float, where they are a usual one in one order alone."""
    fitting = []
    for order in orders:
        high = ordered(pair, order.swapped, order.little)[:, 0]
        if are_usual(_read(pair, Kind.F32, order)) and are_exponents(high[high != 0], *FLOAT_EXPONENTS):
            fitting.append(order)
    if len(fitting) != 1:
        return None
    return RegisterReading(Kind.F32, fitting[0], Use.SETTING, GuessSureness.LIKELY)


def grows_only_whole(pair: Words, order: RegisterOrder) -> bool:
    """Whether two registers grow all the time when they are read together in an order, and neither does by itself."""
    whole = _read(pair, Kind.U32, order)
    alone = any(grow(pair[:, at].astype(np.int64)) for at in (0, 1))
    return grow(whole) and len(np.unique(whole)) >= ENOUGH and not alone


def _read(words: Words, kind: Kind, order: RegisterOrder) -> Floats:
    return read_as(words, kind, order.swapped, order.little)


def _use_of(values: Floats) -> Use:
    if len(np.unique(values)) == 1:
        return Use.CONSTANT
    return Use.COUNTER if grow(values) else Use.SENSOR


def _has_carried(high: Wide, low: Wide, bits: int) -> bool:
    """Whether the high part moves, and only where the low one has carried: what both do together is less than what the
    low one does alone."""
    half = 1 << (bits - 1)
    moved = np.diff(high) != 0
    steps = np.abs(np.diff(high << bits | low))
    return bool(moved.any() and steps.max() < half and (np.abs(np.diff(low))[moved] > half).all())


def _float_fits(pair: Words, order: RegisterOrder) -> GuessSureness | None:
    """How surely two registers are a float in an order; None where they are not."""
    both = ordered(pair, order.swapped, order.little)
    high, low = both[:, 0], both[:, 1]
    values = _read(pair, Kind.F32, order)
    if not are_usual(values) or not are_exponents(high[(high & 0x7FFF | low) != 0], *FLOAT_EXPONENTS):
        return None
    distinct = len(np.unique(values))
    moved = np.diff(high) != 0
    if distinct < 3 or (moved.any() and np.median(np.abs(np.diff(low.astype(np.int64)))[moved]) < _NEAR):
        return None  # where the high word of a number moves, the low one may be anything, and hardly where it was
    if grow(_read(pair, Kind.U32, order)):  # a number of 32 bits that counts fits as well, but one so large is rare
        return GuessSureness.LIKELY if len(np.unique(high)) > 1 else None
    if is_wild(low) and distinct >= ENOUGH and not is_wild(high):
        return GuessSureness.SURE
    return GuessSureness.LIKELY if len(np.unique(low)) >= 3 else None


def _sign_fits(pair: Words, order: RegisterOrder) -> RegisterReading | None:
    """Whether two registers are a number of 32 bits with a sign: the high one is all ones whenever the low one has its
    highest bit set, else zero. In two things of their own that would be chance each time the sign changes."""
    both = ordered(pair, order.swapped, order.little)
    high, low = both[:, 0], both[:, 1]
    changes = int(np.count_nonzero(np.diff(high)))
    if not changes or not (high == np.where(low >= 0x8000, 0xFFFF, 0)).all():
        return None
    enough = changes >= ENOUGH and len(np.unique(low)) >= ENOUGH
    return RegisterReading(Kind.S32, order, Use.SENSOR, GuessSureness.SURE if enough else GuessSureness.LIKELY)


def _carry_fits(pair: Words, order: RegisterOrder) -> RegisterReading | None:
    """Whether two registers are a number of 32 bits: a carry went from the low one into the high one.

    Of one that goes up and down nobody knows whether it could be below zero, until it is.
    """
    both = ordered(pair, order.swapped, order.little).astype(np.int64)
    high, low = both[:, 0], both[:, 1]
    whole = high << 16 | low
    if len(np.unique(whole)) < 3:
        return None
    moved = np.diff(high) != 0
    if not moved.any():
        if 0 < high[0] < 0x1000 <= low.max() and grow(whole) and not order.little:
            return RegisterReading(Kind.U32, order, Use.COUNTER, GuessSureness.LIKELY)
        return None
    is_below = high >= 0xF000
    signed = np.where(is_below, high - (1 << 16), high)
    if not _has_carried(signed, low, 16):
        return None
    values = signed << 16 | low
    use = Use.COUNTER if grow(values) else Use.SENSOR
    if is_below.any():
        crossed = int(np.count_nonzero(np.diff(is_below)))
        return RegisterReading(Kind.S32, order, use, GuessSureness.SURE if crossed >= 3 else GuessSureness.LIKELY)
    is_told = use is Use.COUNTER and not may_be_decimal(both)
    return RegisterReading(Kind.U32, order, use, GuessSureness.SURE if is_told else GuessSureness.LIKELY)
