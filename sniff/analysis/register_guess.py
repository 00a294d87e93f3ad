"""Guesses of registers that nobody has described: width, order and kind, with how sure. Pure.

A guess is sure only where what was heard excludes the other readings: a carry from one word into the next, a word that
runs through all its values while its neighbour stays where the exponents of usual numbers are, a step across zero.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Any

import numpy as np
import numpy.typing as npt

from dissectors.profiles.model import Kind
from sniff.analysis.register_series import RegisterStretch, Words

Floats = npt.NDArray[np.float64]
Wide = npt.NDArray[np.int64]
_Place = tuple[int, str, int]  # device, table, register

ENOUGH = 8
"""Different values that a register must have shown before anything of it is sure."""

SMALLEST, LARGEST = 1e-3, 1e8
"""Magnitudes that measured values usually have."""

_WILD = 0x6000  # a word that spans so much, without order, is the low part of something wider
_NEAR = 0x1000  # so close to zero, on both sides of it: a sign


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
class RegisterGuess:
    """What one value may be. `address`: its first register, on the wire; `low`, `high`: of the values so read; `rate`:
    mean change a second. `swapped`, `little`: low register first, low octet first."""

    device: int
    space: str
    address: int
    kind: Kind
    swapped: bool
    little: bool
    use: Use
    sure: GuessSureness
    low: float
    high: float
    answers: int
    changes: int
    rate: float


@dataclass(frozen=True, slots=True)
class _Order:
    swapped: bool
    little: bool


_ORDERS = (_Order(False, False), _Order(True, False), _Order(True, True), _Order(False, True))
"""The usual ones first: as the protocol has it, words swapped, all octets swapped, octets swapped in words."""


def guessed(blocks: Iterable[RegisterStretch], written: set[tuple[int, str, int]]) -> Iterator[RegisterGuess]:
    """A guess for each register that was read, the surest of all blocks that it is in; by device, table, register.

    Blocks that overlap may be read in ways that exclude each other. Then none of these is sure, and what the one that
    is taken leaves over stands by itself.
    """
    held = list(blocks)
    found = _undisputed([guess for block in held for guess in _of_block(block, written)])
    taken: dict[_Place, RegisterGuess] = {}
    for guess in sorted(found, key=lambda one: (-one.sure, -one.answers, one.device, one.space, one.address)):
        if not any(place in taken for place in _places(guess)):
            taken.update(dict.fromkeys(_places(guess), guess))
    for guess in _left_over(held, taken, written):
        taken[guess.device, guess.space, guess.address] = guess
    yield from (taken[place] for place in sorted(taken) if taken[place].address == place[2])


def _places(guess: RegisterGuess) -> list[_Place]:
    return [(guess.device, guess.space, guess.address + step) for step in range(guess.kind.registers)]


def _undisputed(found: Sequence[RegisterGuess]) -> list[RegisterGuess]:
    """The guesses, none of them sure that shares a register with another sure one of another reading."""
    readings: dict[_Place, set[tuple[int, Kind, bool, bool]]] = {}
    for one in found:
        for place in _places(one) if one.sure is GuessSureness.SURE else ():
            readings.setdefault(place, set()).add((one.address, one.kind, one.swapped, one.little))
    disputed = {place for place, ways in readings.items() if len(ways) > 1}
    return [
        replace(one, sure=GuessSureness.LIKELY)
        if one.sure is GuessSureness.SURE and disputed & {*_places(one)}
        else one
        for one in found
    ]


def _left_over(
    blocks: Iterable[RegisterStretch], taken: Mapping[_Place, RegisterGuess], written: set[tuple[int, str, int]]
) -> Iterator[RegisterGuess]:
    """Registers whose guess gave way to one of another block, each by itself, as the block asked most often has it."""
    done: set[_Place] = set()
    for block in sorted(blocks, key=lambda one: -one.count):
        for at in range(block.width):
            place = block.device, block.space, block.first + at
            if place in taken or place in done:
                continue
            done.add(place)
            words, seconds = block.words, np.array(block.times, np.int64) / 1e9
            guess = _guess(block, words, seconds, at, _one(words[:, at]), written)
            yield replace(guess, sure=min(guess.sure, GuessSureness.LIKELY))


def _of_block(block: RegisterStretch, written: set[tuple[int, str, int]]) -> list[RegisterGuess]:
    """The registers of one block, wide values in one order: a device has one.

    In another order and one register further on, the low word of a value and the high word of the next make numbers
    as usual; but then words are left over that run through all their values and are no number by themselves.
    """
    words, seconds = block.words, np.array(block.times, np.int64) / 1e9
    by_order = [(_in_order(block, words, seconds, order, written), order) for order in _ORDERS]
    ranked = sorted(by_order, key=lambda one: _rank(block, words, one[0]))
    best, second = ranked[0][0], ranked[1][0]
    if _rank(block, words, best) == _rank(block, words, second) and best != second:
        best = [
            replace(one, sure=min(one.sure, GuessSureness.LIKELY)) if one.kind.registers > 1 else one for one in best
        ]
    return _as_neighbours(block, words, seconds, _may_be_wider(best), written)


def _may_be_wider(found: Sequence[RegisterGuess]) -> list[RegisterGuess]:
    """The guesses; a number of 32 bits is not sure where the registers above it never change, and would make it one
    of 64 bits, of which nothing has been seen yet but the lower half."""
    still = {one.address for one in found if one.kind.registers == 1 and one.low == one.high and one.low < 0x1000}
    told = []
    for one in found:
        above = (one.address + 2, one.address + 3) if one.swapped else (one.address - 2, one.address - 1)
        is_half = one.kind in (Kind.U32, Kind.S32) and one.sure is GuessSureness.SURE and still.issuperset(above)
        told.append(replace(one, sure=GuessSureness.LIKELY) if is_half else one)
    return told


def _rank(block: RegisterStretch, words: Words, found: Sequence[RegisterGuess]) -> tuple[int, int]:
    """The better the smaller: single words that are no number, then registers that are read surely."""
    singles = [one.address - block.first for one in found if one.kind.registers == 1]
    surely = sum(one.kind.registers for one in found if one.kind.registers > 1 and one.sure is GuessSureness.SURE)
    return sum(_is_wild(words[:, at]) for at in singles), -surely


def _in_order(
    block: RegisterStretch, words: Words, seconds: Floats, order: _Order, written: set[tuple[int, str, int]]
) -> list[RegisterGuess]:
    found: list[RegisterGuess] = []
    at = 0
    while at < block.width:
        guess = _at(block, words, seconds, at, order, written)
        found.append(guess)
        at += guess.kind.registers
    return found


def _at(
    block: RegisterStretch, words: Words, seconds: Floats, at: int, order: _Order, written: set[tuple[int, str, int]]
) -> RegisterGuess:
    """The best reading that begins at a register of a block."""
    for width, judge in ((4, _four), (2, _two)):
        if at + width <= block.width:
            reading = judge(words[:, at : at + width], order)
            if reading is not None:
                return _guess(block, words, seconds, at, reading, written)
    return _guess(block, words, seconds, at, _one(words[:, at]), written)


@dataclass(frozen=True, slots=True)
class _Reading:
    kind: Kind
    order: _Order
    use: Use
    sure: GuessSureness


_PLAIN = _ORDERS[0]


def _guess(
    block: RegisterStretch,
    words: Words,
    seconds: Floats,
    at: int,
    reading: _Reading,
    written: set[tuple[int, str, int]],
) -> RegisterGuess:
    values = read_as(
        words[:, at : at + reading.kind.registers], reading.kind, reading.order.swapped, reading.order.little
    )
    changes = int(np.count_nonzero(np.diff(values)))
    span = float(seconds[-1] - seconds[0]) if len(seconds) > 1 else 0.0
    places = range(block.first + at, block.first + at + reading.kind.registers)
    is_setting = any((block.device, block.space, place) in written for place in places)
    return RegisterGuess(
        block.device,
        block.space,
        block.first + at,
        reading.kind,
        reading.order.swapped,
        reading.order.little,
        Use.SETTING if is_setting else reading.use,
        reading.sure,
        float(values.min()),
        float(values.max()),
        block.count,
        changes,
        float(np.abs(np.diff(values)).sum() / span) if span > 0 else 0.0,
    )


def read_as(words: Words, kind: Kind, swapped: bool, little: bool) -> Floats:
    """float64[answers]: what columns of words are, read as a kind; for whole numbers of 64 bits rounded."""
    if little:
        words = words.byteswap()
    if swapped:
        words = words[:, ::-1]
    octets = np.ascontiguousarray(words.astype(">u2"))
    form = {"u": ">u", "s": ">i", "f": ">f"}[kind.value[0]] + str(2 * kind.registers)
    with np.errstate(invalid="ignore"):
        return octets.view(form)[:, 0].astype(np.float64)


# --- values of one, two and four registers ---


def _one(column: Words) -> _Reading:
    distinct = np.unique(column)
    if len(distinct) == 1:
        return _Reading(Kind.U16, _PLAIN, Use.CONSTANT, GuessSureness.OPEN)
    signed = column.view(np.int16).astype(np.int64)
    steps, signed_steps = np.abs(np.diff(column.astype(np.int64))), np.abs(np.diff(signed))
    below, above = bool((signed < 0).any()), bool((signed >= 0).any())
    if below and above and signed_steps.max() < _NEAR <= steps.max():
        return _Reading(
            Kind.S16, _PLAIN, Use.SENSOR, GuessSureness.SURE if len(distinct) >= ENOUGH else GuessSureness.LIKELY
        )
    if below and not above and signed.min() > -_NEAR:
        return _Reading(Kind.S16, _PLAIN, Use.SENSOR, GuessSureness.LIKELY)
    if _is_bits(column):
        return _Reading(Kind.U16, _PLAIN, Use.BITS, GuessSureness.LIKELY)
    use = Use.COUNTER if _counts(column.astype(np.int64)) else Use.SENSOR
    is_open = len(distinct) < ENOUGH or _may_be_decimal(column)
    return _Reading(Kind.U16, _PLAIN, use, GuessSureness.OPEN if is_open else GuessSureness.LIKELY)


def _two(pair: Words, order: _Order) -> _Reading | None:
    if _is_text(pair):
        return None  # words of text are no number; each stands alone
    sure = _float_fits(pair, order)
    if sure is None:
        return _sign_fits(pair, order) or _count_fits(pair, order)
    grows = _counts(read_as(pair, Kind.U32, order.swapped, order.little).astype(np.int64))
    return _Reading(Kind.F32, order, Use.COUNTER if grows else Use.SENSOR, sure)


def _four(quad: Words, order: _Order) -> _Reading | None:
    words = _ordered(quad, order)
    if _float_fits(quad[:, :2] if order.swapped else quad[:, 2:], order) is not None:
        return None  # the lower half of a number of 64 bits would not be a usual number each time
    wild = _is_wild(words[:, 3]) and _is_wild(words[:, 2]) and _float_exponents(words[:, 0], 0x3F50, 0x41A0)
    if wild and _usual(read_as(quad, Kind.F64, order.swapped, order.little)):
        return _Reading(Kind.F64, order, Use.SENSOR, GuessSureness.SURE)
    return None


def _ordered(words: Words, order: _Order) -> Words:
    """Highest word first, highest octet first."""
    words = words.byteswap() if order.little else words
    return words[:, ::-1] if order.swapped else words


def _float_fits(pair: Words, order: _Order) -> GuessSureness | None:
    """How surely two registers are a float in an order; None where they are not."""
    ordered = _ordered(pair, order)
    high, low = ordered[:, 0], ordered[:, 1]
    values = read_as(pair, Kind.F32, order.swapped, order.little)
    if not _usual(values) or not _float_exponents(high[(high | low) != 0], 0x3A80, 0x4CC0):
        return None
    whole = read_as(pair, Kind.U32, order.swapped, order.little)
    distinct = len(np.unique(values))
    if distinct < 3:
        return None
    if _counts(whole.astype(np.int64)):  # a number of 32 bits that counts fits as well, but one so large is rare
        return GuessSureness.LIKELY if len(np.unique(high)) > 1 else None
    if _is_wild(low) and distinct >= ENOUGH and not _is_wild(high):
        return GuessSureness.SURE
    return GuessSureness.LIKELY if len(np.unique(low)) >= 3 else None


def _sign_fits(pair: Words, order: _Order) -> _Reading | None:
    """Whether two registers are a number of 32 bits with a sign: the high one is all ones whenever the low one has its
    highest bit set, else zero. In two things of their own that would be chance each time the sign changes."""
    ordered = _ordered(pair, order)
    high, low = ordered[:, 0], ordered[:, 1]
    changes = int(np.count_nonzero(np.diff(high)))
    if not changes or not (high == np.where(low >= 0x8000, 0xFFFF, 0)).all():
        return None
    enough = changes >= ENOUGH and len(np.unique(low)) >= ENOUGH
    return _Reading(Kind.S32, order, Use.SENSOR, GuessSureness.SURE if enough else GuessSureness.LIKELY)


def _count_fits(pair: Words, order: _Order) -> _Reading | None:
    """Whether two registers are a number of 32 bits: a carry went from the low one into the high one."""
    ordered = _ordered(pair, order).astype(np.int64)
    high, low = ordered[:, 0], ordered[:, 1]
    whole = high << 16 | low
    if len(np.unique(whole)) < 3:
        return None
    moved = np.diff(high) != 0
    if moved.any():
        steps = np.abs(np.diff(whole))
        small = bool(steps.max() < 0x8000)  # what the words would do together is less than what the low one does alone
        if small and bool((np.abs(np.diff(low))[moved] > 0x8000).all()):
            use = Use.COUNTER if _counts(whole) else Use.SENSOR
            return _Reading(
                Kind.U32, order, use, GuessSureness.LIKELY if _may_be_decimal(ordered) else GuessSureness.SURE
            )
        return None
    if 0 < high[0] < 0x1000 and _counts(whole) and not order.little:
        return _Reading(Kind.U32, order, Use.COUNTER, GuessSureness.LIKELY)
    return None


# --- what a series is like ---


def _usual(values: Floats) -> bool:
    """Whether all are numbers as instruments show them."""
    size = np.abs(values[values != 0])
    return bool(np.isfinite(values).all() and len(size) and (size >= SMALLEST).all() and (size <= LARGEST).all())


def _float_exponents(high: Words, least: int, most: int) -> bool:
    """Whether the highest words, their sign taken off, lie where usual numbers have theirs."""
    size = high & 0x7FFF
    return bool(len(size) and (size >= least).all() and (size <= most).all())


def _is_wild(column: Words) -> bool:
    """Whether a word runs through its values without order, as the low part of a wider number does."""
    values = column.astype(np.int64)
    steps = np.abs(np.diff(values))
    return (
        len(np.unique(values)) >= ENOUGH and int(np.ptp(values)) >= _WILD and float(np.median(steps[steps > 0])) > 0x800
    )


def _counts(values: Wide) -> bool:
    """Whether a series only ever grows."""
    steps = np.diff(values)
    return bool(len(steps) and (steps >= 0).all() and np.count_nonzero(steps) >= 2)


def _may_be_decimal(words: npt.NDArray[Any]) -> bool:
    """Whether no half octet is ever above 9: a number in decimal digits (BCD), of which no profile has a type."""
    whole = words.astype(np.int64)
    return all(bool(((whole >> shift & 0xF) <= 9).all()) for shift in (0, 4, 8, 12))


def _is_bits(column: Words) -> bool:
    """Whether single bits come and go, several of them: no number does that."""
    changed = np.bitwise_xor(column[1:], column[:-1])
    changed = changed[changed != 0]
    single = (changed & (changed - 1)) == 0
    return len(np.unique(changed)) >= 3 and bool(single.mean() >= 0.9) and int(np.ptp(column)) > 8


def _is_text(pair: Words) -> bool:
    octets = np.ascontiguousarray(pair.astype(">u2")).view(np.uint8)
    constant = bool((pair == pair[0]).all())
    return constant and bool(((octets >= 0x20) & (octets < 0x7F) | (octets == 0)).all()) and bool((octets > 0x40).any())


# --- what neighbours say ---


def _as_neighbours(
    block: RegisterStretch,
    words: Words,
    seconds: Floats,
    found: Sequence[RegisterGuess],
    written: set[tuple[int, str, int]],
) -> list[RegisterGuess]:
    """Where the values of a block are of two registers in one order, pairs that are open are likely so too."""
    sure = [one for one in found if one.sure is GuessSureness.SURE and one.kind.registers == 2]
    orders = {(one.swapped, one.little) for one in sure}
    odd = {one.address & 1 for one in sure}
    singles = [
        one for one in found if one.kind.registers == 1 and one.sure > GuessSureness.OPEN and one.use is not Use.COUNTER
    ]
    if len(sure) < 2 or len(orders) != 1 or len(odd) != 1:
        return list(found)
    swapped, little = next(iter(orders))
    parity, taken, joined = next(iter(odd)), {one.address for one in singles}, []
    places = {one.address: one for one in found}
    skip: set[int] = set()
    for one in found:
        other = places.get(one.address + 1)
        pair = one.kind.registers == 1 and other is not None and other.kind.registers == 1
        free = not ({one.address, one.address + 1} & taken)
        if one.address in skip:
            continue
        if pair and one.address & 1 == parity:
            at, order = one.address - block.first, _Order(swapped, little)
            columns = words[:, at : at + 2]
            reading = _pair_like(columns, order) if free or _grows_only_so(columns, order) else None
            if reading is not None:
                joined.append(_guess(block, words, seconds, at, reading, written))
                skip.add(one.address + 1)
                continue
        joined.append(one)
    return joined


def _grows_only_so(pair: Words, order: _Order) -> bool:
    """Whether two registers grow all the time when they are read together in an order, and neither does by itself."""
    whole = read_as(pair, Kind.U32, order.swapped, order.little).astype(np.int64)
    alone = any(_counts(pair[:, at].astype(np.int64)) for at in (0, 1))
    return _counts(whole) and len(np.unique(whole)) >= ENOUGH and not alone


def _pair_like(pair: Words, order: _Order) -> _Reading | None:
    """An open pair in the order of its neighbours: a float of a round value, or a small count."""
    values = read_as(pair, Kind.F32, order.swapped, order.little)
    high = _ordered(pair, order)[:, 0]
    if _usual(values) and _float_exponents(high[high != 0], 0x3A80, 0x4CC0):
        use = Use.CONSTANT if len(np.unique(values)) == 1 else Use.SENSOR
        return _Reading(Kind.F32, order, use, GuessSureness.LIKELY)
    whole = read_as(pair, Kind.U32, order.swapped, order.little).astype(np.int64)
    if high[0] < 0x1000 and (high == high[0]).all() and _counts(whole):
        return _Reading(Kind.U32, order, Use.COUNTER, GuessSureness.LIKELY)
    return None
