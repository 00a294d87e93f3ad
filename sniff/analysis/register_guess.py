"""Guesses of registers that nobody has described: the best reading of each, over all questions that asked for it. Pure.

`register_kinds.py` says what a stretch of registers may be by itself; here it is decided between orders, between
neighbours and between questions that overlap.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dissectors.profiles.model import Kind
from sniff.analysis import register_kinds
from sniff.analysis.register_kinds import ORDERS, GuessSureness, RegisterOrder, RegisterReading, Use
from sniff.analysis.register_series import RegisterStretch, Span, Words
from sniff.analysis.register_words import Floats, is_wild, read_as

_Place = tuple[int, str, int]  # device, table, register


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
class _Heard:
    """One block as columns. `written`: places in it that a master writes; `together`: those of two registers that it
    writes at once, by the first."""

    block: RegisterStretch
    words: Words
    seconds: Floats
    written: frozenset[int]
    together: frozenset[int]

    @classmethod
    def of(cls, block: RegisterStretch, written: Collection[Span]) -> _Heard:
        here = [one[2:] for one in written if one[:2] == (block.device, block.space)]
        places = {first + step - block.first for first, width in here for step in range(width)}
        pairs = {first - block.first for first, width in here if width == 2}
        seconds = np.array(block.times, np.int64) / 1e9
        return cls(block, block.words, seconds, frozenset(places), frozenset(pairs))

    def guess(self, at: int, reading: RegisterReading) -> RegisterGuess:
        """The guess that a reading is, which begins at this place."""
        block, seconds, width = self.block, self.seconds, reading.kind.registers
        order = reading.order
        values = read_as(self.words[:, at : at + width], reading.kind, order.swapped, order.little)
        steps = np.diff(values)
        span = float(seconds[-1] - seconds[0]) if len(seconds) > 1 else 0.0
        return RegisterGuess(
            block.device,
            block.space,
            block.first + at,
            reading.kind,
            order.swapped,
            order.little,
            Use.SETTING if self.written & {*range(at, at + width)} else reading.use,
            reading.sure,
            float(values.min()),
            float(values.max()),
            block.count,
            int(np.count_nonzero(steps)),
            float(np.abs(steps).sum() / span) if span > 0 else 0.0,
        )

    def alone(self, at: int) -> RegisterGuess:
        """The guess of a register by itself."""
        return self.guess(at, register_kinds.one(self.words[:, at]))

    def best_at(self, at: int, order: RegisterOrder) -> RegisterGuess:
        """The best reading that begins at a place, wide values in an order."""
        for width, judge in ((4, register_kinds.four), (2, register_kinds.two)):
            if at + width <= self.block.width:
                reading = judge(self.words[:, at : at + width], order)
                if reading is not None:
                    return self.guess(at, reading)
        return self.alone(at)


def guessed(blocks: Iterable[RegisterStretch], written: Collection[Span]) -> Iterator[RegisterGuess]:
    """A guess for each register that was read, the surest of all blocks that it is in; by device, table, register.

    Blocks that overlap may be read in ways that exclude each other. Then none of these is sure, and what the one that
    is taken leaves over stands by itself.
    """
    held = [_Heard.of(block, written) for block in blocks]
    by_block = [(heard, _of_block(heard)) for heard in held]
    orders = _orders_of([guess for _, some in by_block for guess in some])
    joined = (_with_neighbours(heard, some, orders.get(heard.block.device)) for heard, some in by_block)
    found = _undisputed([guess for some in joined for guess in some])
    taken: dict[_Place, RegisterGuess] = {}
    for guess in sorted(found, key=lambda one: (-one.sure, -one.answers, one.device, one.space, one.address)):
        if not any(place in taken for place in _places(guess)):
            taken.update(dict.fromkeys(_places(guess), guess))
    for guess in _left_over(held, taken):
        taken[guess.device, guess.space, guess.address] = guess
    yield from (_over_all(held, taken[place]) for place in sorted(taken) if taken[place].address == place[2])


def _over_all(blocks: Iterable[_Heard], guess: RegisterGuess) -> RegisterGuess:
    """The guess with what all questions heard of it that asked for the whole of it, in the order of time."""
    width = guess.kind.registers
    told: list[tuple[Floats, Floats]] = []
    answers = 0
    for heard in blocks:
        block, at = heard.block, guess.address - heard.block.first
        if (block.device, block.space) == (guess.device, guess.space) and 0 <= at <= block.width - width:
            words = heard.words[:, at : at + width]
            told.append((heard.seconds, read_as(words, guess.kind, guess.swapped, guess.little)))
            answers += block.count
    if len(told) < 2:
        return guess
    seconds, values = (np.concatenate(parts) for parts in zip(*told, strict=True))
    finite = np.isfinite(values)
    in_order = np.argsort(seconds[finite], kind="stable")
    seconds, values = seconds[finite][in_order], values[finite][in_order]
    steps, span = np.diff(values), float(seconds[-1] - seconds[0])
    rate = float(np.abs(steps).sum() / span) if span > 0 else 0.0
    low, high, changes = float(values.min()), float(values.max()), int(np.count_nonzero(steps))
    return replace(guess, low=low, high=high, answers=answers, changes=changes, rate=rate)


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


def _left_over(blocks: Iterable[_Heard], taken: Mapping[_Place, RegisterGuess]) -> Iterator[RegisterGuess]:
    """Registers whose guess gave way to one of another block, each by itself, as the block asked most often has it."""
    done: set[_Place] = set()
    for heard in sorted(blocks, key=lambda one: -one.block.count):
        block = heard.block
        for at in range(block.width):
            place = block.device, block.space, block.first + at
            if place in taken or place in done:
                continue
            done.add(place)
            guess = heard.alone(at)
            yield replace(guess, sure=min(guess.sure, GuessSureness.LIKELY))


# --- one block ---


def _of_block(heard: _Heard) -> list[RegisterGuess]:
    """The registers of one block, wide values in one order: a device has one.

    In another order and one register further on, the low word of a value and the high word of the next make numbers
    as usual; but then words are left over that run through all their values and are no number by themselves.
    """
    ranked = sorted((_in_order(heard, order) for order in ORDERS), key=lambda one: _rank(heard, one))
    best, second = ranked[0], ranked[1]
    if _rank(heard, best) == _rank(heard, second) and best != second:
        best = [
            replace(one, sure=min(one.sure, GuessSureness.LIKELY)) if one.kind.registers > 1 else one for one in best
        ]
    return _may_be_wider(best)


def _in_order(heard: _Heard, order: RegisterOrder) -> list[RegisterGuess]:
    found: list[RegisterGuess] = []
    at = 0
    while at < heard.block.width:
        guess = heard.best_at(at, order)
        found.append(guess)
        at += guess.kind.registers
    return found


def _rank(heard: _Heard, found: Sequence[RegisterGuess]) -> tuple[int, int]:
    """The better the smaller: single words that are no number, then registers that are read surely."""
    singles = [one.address - heard.block.first for one in found if one.kind.registers == 1]
    surely = sum(one.kind.registers for one in found if one.kind.registers > 1 and one.sure is GuessSureness.SURE)
    return sum(is_wild(heard.words[:, at]) for at in singles), -surely


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


# --- what neighbours and writes say ---


def _sure_pairs(found: Iterable[RegisterGuess]) -> list[RegisterGuess]:
    return [one for one in found if one.sure is GuessSureness.SURE and one.kind.registers == 2]


def _orders_of(found: Sequence[RegisterGuess]) -> dict[int, RegisterOrder]:
    """By device, the one order of its values of two registers, where at least two are sure."""
    by_device: dict[int, list[RegisterOrder]] = {}
    for one in _sure_pairs(found):
        by_device.setdefault(one.device, []).append(RegisterOrder(one.swapped, one.little))
    return {device: some[0] for device, some in by_device.items() if len(some) > 1 and len(set(some)) == 1}


def _with_neighbours(heard: _Heard, found: list[RegisterGuess], order: RegisterOrder | None) -> list[RegisterGuess]:
    return _as_written(heard, found if order is None else _as_neighbours(heard, found, order), order)


def _as_neighbours(heard: _Heard, found: list[RegisterGuess], order: RegisterOrder) -> list[RegisterGuess]:
    """Where the values of a device are of two registers in one order, pairs that are open are likely so too; such as
    never change only beside others in the same block."""
    sure = _sure_pairs(found)
    odd = {one.address & 1 for one in sure} or {heard.block.first & 1}
    if len(odd) != 1:
        return found
    parity = odd.pop()

    def pair_at(first: RegisterGuess, second: RegisterGuess) -> RegisterReading | None:
        at = first.address - heard.block.first
        columns = heard.words[:, at : at + 2]
        if first.address & 1 != parity:
            return None
        if any(map(_speaks_for_itself, (first, second))) and not register_kinds.grows_only_whole(columns, order):
            return None
        reading = register_kinds.like_neighbours(columns, order)
        return None if reading is not None and reading.use is Use.CONSTANT and len(sure) < 2 else reading

    return _paired(heard, found, pair_at)


def _speaks_for_itself(guess: RegisterGuess) -> bool:
    return guess.sure > GuessSureness.OPEN and guess.use is not Use.COUNTER


def _as_written(heard: _Heard, found: list[RegisterGuess], order: RegisterOrder | None) -> list[RegisterGuess]:
    """Two registers that a master writes at once, and that are open by themselves, are likely one float."""
    if not heard.together:
        return found
    known = {RegisterOrder(one.swapped, one.little) for one in found if one.kind.registers > 1}
    orders = [order] if order is not None else [one for one in ORDERS if one in known] or ORDERS

    def pair_at(first: RegisterGuess, second: RegisterGuess) -> RegisterReading | None:
        at = first.address - heard.block.first
        if at not in heard.together or second.sure > GuessSureness.OPEN:
            return None
        return register_kinds.written_at_once(heard.words[:, at : at + 2], orders)

    return _paired(heard, found, pair_at)


_PairAt = Callable[[RegisterGuess, RegisterGuess], RegisterReading | None]


def _paired(heard: _Heard, found: Sequence[RegisterGuess], pair_at: _PairAt) -> list[RegisterGuess]:
    """The guesses; single registers that follow one another as one value, where `pair_at` has a reading of them."""
    joined: list[RegisterGuess] = []
    at = 0
    while at < len(found):
        some = found[at : at + 2]
        reading = pair_at(*some) if len(some) == 2 and all(one.kind.registers == 1 for one in some) else None
        joined.append(heard.guess(some[0].address - heard.block.first, reading) if reading is not None else some[0])
        at += 1 if reading is None else 2
    return joined
