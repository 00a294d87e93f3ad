"""Guessing what registers hold, from meters whose registers are known."""

from __future__ import annotations

import random
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dissectors.profiles.model import Kind
from sniff.analysis.register_guess import RegisterGuess, guessed
from sniff.analysis.register_kinds import GuessSureness, Use
from sniff.analysis.register_series import RegisterSeries, RegisterStretch, covering
from sniff.bus.offline import survey
from sniff.engine.follow_settings import dissector_for
from sniff.formats import read

CAPTURES = Path(__file__).parents[3] / "captures"

SECOND = 1_000_000_000
Series = Callable[[random.Random, int], list[float]]


def sensor(dice: random.Random, answers: int, middle: float, step: float) -> list[float]:
    value, found = middle, []
    for _ in range(answers):
        value += dice.gauss(0, step) + (middle - value) * 0.05
        found.append(value)
    return found


def counter(dice: random.Random, answers: int, begin: int, most: int) -> list[float]:
    found = [begin]
    for _ in range(answers - 1):
        found.append(found[-1] + dice.randrange(0, most))
    return [float(value) for value in found]


def words_of(kind: Kind, value: float, swapped: bool, little: bool) -> tuple[int, ...]:
    form = {
        Kind.F32: ">f",
        Kind.F64: ">d",
        Kind.U32: ">I",
        Kind.U16: ">H",
        Kind.S16: ">h",
        Kind.S32: ">i",
    }[kind]
    packed = struct.pack(form, value if form[1] in "fd" else int(value))
    words = list(struct.unpack(f">{len(packed) // 2}H", packed))
    if little:
        words = [word >> 8 | (word & 0xFF) << 8 for word in words]
    return tuple(words[::-1] if swapped else words)


METER: list[tuple[Kind, Series]] = [
    (Kind.F32, lambda dice, n: sensor(dice, n, 230, 0.8)),
    (Kind.F32, lambda dice, n: sensor(dice, n, 229, 0.8)),
    (Kind.F32, lambda dice, n: sensor(dice, n, 12.3, 0.4)),
    (Kind.F32, lambda dice, n: sensor(dice, n, 2800, 60)),
    (Kind.F32, lambda dice, n: sensor(dice, n, -15, 4)),
    (Kind.F32, lambda dice, n: sensor(dice, n, 0.93, 0.01)),
    (Kind.F32, lambda dice, n: sensor(dice, n, 50.0, 0.01)),
    (Kind.U32, lambda dice, n: counter(dice, n, 1_234_567, 900)),
    (Kind.U32, lambda dice, n: counter(dice, n, 65_000, 40)),
    (Kind.U32, lambda dice, n: counter(dice, n, 70_000_000, 3000)),
    (Kind.U16, lambda dice, n: sensor(dice, n, 2300, 8)),
    (Kind.U16, lambda dice, n: sensor(dice, n, 500, 1.4)),
    (Kind.S16, lambda dice, n: sensor(dice, n, 5, 12)),
    (Kind.U16, lambda dice, n: counter(dice, n, 100, 4)),
]


def block_of(
    dice: random.Random, layout: list[tuple[Kind, Series]], swapped: bool, little: bool, answers: int
) -> RegisterStretch:
    columns = [(kind, make(dice, answers)) for kind, make in layout]
    width = sum(kind.registers for kind, _ in columns)
    block = RegisterStretch(1, "holding", 100, width)
    for at in range(answers):
        row = [word for kind, values in columns for word in words_of(kind, values[at], swapped, little)]
        block.add(at * SECOND, tuple(row))
    return block


def judged(found: list[RegisterGuess], layout: list[tuple[Kind, Series]], order: tuple[bool, bool]) -> tuple[int, int]:
    """How many registers are read rightly, and how many are wrong although they are said to be sure."""
    by_address = {guess.address: guess for guess in found}
    right = wrong = 0
    at = 100
    for kind, _ in layout:
        guess = by_address.get(at)
        same = guess is not None and guess.kind is kind
        if kind.registers > 1 and guess is not None:
            same = same and (guess.swapped, guess.little) == order
        right += same * kind.registers
        overlapping = [by_address[place] for place in range(at, at + kind.registers) if place in by_address]
        wrong += sum(one.sure is GuessSureness.SURE and not (one is guess and same) for one in overlapping)
        at += kind.registers
    return right, wrong


@pytest.mark.parametrize("order", [(False, False), (True, False), (True, True)])
def test_most_registers_of_a_meter_are_read_rightly_and_none_surely_wrong(order: tuple[bool, bool]) -> None:
    right = total = 0
    for seed in range(7):
        dice = random.Random(seed)
        layout = METER[:]
        dice.shuffle(layout)
        if order[1]:  # octets swapped are usual for wide values only
            layout = [one for one in layout if one[0].registers > 1]
        block = block_of(dice, layout, *order, 300)
        found = list(guessed([block], set()))
        good, wrong = judged(found, layout, order)
        assert not wrong, [one for one in found if one.sure is GuessSureness.SURE]
        right += good
        total += block.width
    assert right >= 0.9 * total, f"{right} of {total}"


def test_what_is_constant_is_left_open() -> None:
    block = RegisterStretch(1, "input", 0, 4)
    for at in range(100):
        block.add(at * SECOND, (0x4366, 0, 7, 0))
    assert {(guess.sure, guess.use) for guess in guessed([block], set())} == {(GuessSureness.OPEN, Use.CONSTANT)}


def test_what_a_master_writes_is_a_setting() -> None:
    block = RegisterStretch(3, "holding", 9, 1)
    for at in range(50):
        block.add(at * SECOND, (3000 + at % 4,))
    (guess,) = guessed([block], {(3, "holding", 9, 1)})
    assert guess.use is Use.SETTING


@given(st.lists(st.lists(st.integers(0, 0xFFFF), min_size=5, max_size=5).map(tuple), min_size=1, max_size=40))
def test_any_words_give_a_guess_for_every_register(rows: list[tuple[int, ...]]) -> None:
    block = RegisterStretch(1, "holding", 0, 5)
    for at, row in enumerate(rows):
        block.add(at, row)
    found = list(guessed([block], set()))
    assert sum(guess.kind.registers for guess in found) == 5
    assert [guess.address for guess in found] == sorted(guess.address for guess in found)


@pytest.mark.parametrize("cut", [(0, 4), (1, 4), (1, 3), (0, 3)])
def test_overlapping_questions_lose_no_register_and_dispute_nothing_surely(cut: tuple[int, int]) -> None:
    dice = random.Random(3)
    layout = [one for one in METER if one[0] is Kind.F32][:2]
    whole = block_of(dice, layout, True, False, 300)
    begin, end = cut
    part = RegisterStretch(1, "holding", 100 + begin, end - begin)
    for time, row in zip(whole.times, whole.rows, strict=True):
        part.add(time, row[begin:end])
    found = list(guessed([whole, part], set()))
    covered = [one.address + step for one in found for step in range(one.kind.registers)]
    assert covered == [100, 101, 102, 103]


def test_sure_guesses_that_exclude_each_other_are_both_likely() -> None:
    """The same registers as a float once in this order, once, by another question, one register further on."""
    dice = random.Random(4)
    one = block_of(dice, [(Kind.F32, METER[0][1])] * 2, True, False, 300)
    other = block_of(dice, [(Kind.F32, METER[0][1])] * 2, True, False, 200)
    shifted = RegisterStretch(1, "holding", 101, 4, other.times, other.rows, other.count)
    alone = [list(guessed([block], set())) for block in (one, shifted)]
    assert all(guess.sure is GuessSureness.SURE for found in alone for guess in found)
    both = list(guessed([one, shifted], set()))
    assert all(guess.sure < GuessSureness.SURE for guess in both)
    assert [guess.address + step for guess in both for step in range(guess.kind.registers)] == list(range(100, 105))


blocks_that_overlap = st.lists(
    st.tuples(st.integers(0, 6), st.integers(1, 6), st.integers(0, 99)), min_size=1, max_size=4
)


@given(blocks_that_overlap)
def test_every_register_of_all_blocks_has_one_guess(shapes: list[tuple[int, int, int]]) -> None:
    blocks = []
    for first, width, seed in shapes:
        dice, block = random.Random(seed), RegisterStretch(1, "holding", first, width)
        for at in range(20):
            block.add(at, tuple(dice.randrange(0x10000) for _ in range(width)))
        blocks.append(block)
    covered = [one.address + step for one in guessed(blocks, set()) for step in range(one.kind.registers)]
    assert covered == sorted({first + step for first, width, _ in shapes for step in range(width)})


@pytest.mark.parametrize("name", ["rtu-clean", "rtu-usual-faults", "ascii-clean", "n2-clean", "rtu-noisy-ftdi"])
def test_series_of_tables_are_those_of_rows(name: str) -> None:
    def series(reference: bool) -> RegisterSeries:
        capture = read(CAPTURES / f"{name}.cap.txt")
        made = RegisterSeries()
        survey(capture, capture.session, made.of(dissector_for(capture.session)), reference=reference)
        return made

    rows, columns = series(True), series(False)
    assert list(rows.blocks()) == list(columns.blocks())
    assert (rows.written, rows.objects) == (columns.written, columns.objects)


@given(st.lists(st.integers(0, 700), max_size=5))
def test_many_answers_are_thinned_as_one_by_one(parts: list[int]) -> None:
    one, many = RegisterStretch(1, "holding", 0, 1), RegisterStretch(1, "holding", 0, 1)
    at = 0
    for part in parts:
        times = np.arange(at, at + part, dtype=np.int64)
        for time in times.tolist():
            one.add(time, (time & 0xFFFF,))
        many.add_many(times, (times & 0xFFFF).astype(np.uint16).reshape(-1, 1))
        at += part
    assert one == many


def test_blocks_that_cover_all_registers_are_few() -> None:
    blocks = [RegisterStretch(1, "holding", first, width) for first in range(40) for width in range(1, 9)]
    for block in blocks:
        block.add(0, (0,) * block.width)
    kept = covering(blocks)
    assert {block.first + step for block in kept for step in range(block.width)} == set(range(47))
    assert len(kept) <= 47 < len(blocks)


def guesses_of(*columns: list[int]) -> list[tuple[int, Kind, GuessSureness, Use]]:
    block = RegisterStretch(1, "holding", 0, len(columns))
    for at, row in enumerate(zip(*columns, strict=True)):
        block.add(at * SECOND, tuple(word & 0xFFFF for word in row))
    return [(one.address, one.kind, one.sure, one.use) for one in guessed([block], set())]


def test_a_counter_that_begins_anew_is_no_sign() -> None:
    (found,) = guesses_of([65_000 + 97 * turn for turn in range(120)])
    assert found == (0, Kind.U16, GuessSureness.LIKELY, Use.COUNTER)


def test_a_value_that_rises_through_zero_once_is_not_surely_signed() -> None:
    (found,) = guesses_of(list(range(-30, 30)))
    assert found == (0, Kind.S16, GuessSureness.LIKELY, Use.SENSOR)


def test_whole_numbers_as_large_as_exponents_are_no_floats() -> None:
    dice = random.Random(6)
    middles = (16_800, 17_200, 16_500, 19_000)
    columns = [[round(value) for value in sensor(dice, 200, middle, middle / 300)] for middle in middles]
    assert [kind for _, kind, _, _ in guesses_of(*columns)] == [Kind.U16] * 4


def test_a_number_of_64_bits_is_told_by_its_carry() -> None:
    dice = random.Random(7)
    values = [int(value) for value in counter(dice, 200, 5 << 32, 1 << 29)]
    columns = [[value >> shift for value in values] for shift in (48, 32, 16, 0)]
    assert guesses_of(*columns) == [(0, Kind.U64, GuessSureness.LIKELY, Use.COUNTER)]


@pytest.mark.parametrize(("middle", "kind"), [(70_000, Kind.U32), (-70_000, Kind.S32), (0, Kind.S32)])
def test_a_number_of_32_bits_is_signed_where_it_was_below_zero(middle: int, kind: Kind) -> None:
    """One that was not may be: it is not sure."""
    dice = random.Random(8)
    values = [round(value) for value in sensor(dice, 300, middle, 6_000)]
    columns = [[value >> 16 for value in values], values]
    (found,) = guesses_of(*columns)
    assert found[1] is kind
    assert (found[2] is GuessSureness.SURE) == (middle == 0)


def test_two_registers_written_at_once_are_likely_one_float() -> None:
    dice = random.Random(9)
    block = RegisterStretch(1, "holding", 4, 2)
    for at in range(60):
        block.add(at * SECOND, words_of(Kind.F32, dice.choice((21.5, 20.0, 22.5)), True, False))
    (found,) = guessed([block], {(1, "holding", 4, 2)})
    assert (found.kind, found.swapped, found.sure, found.use) == (Kind.F32, True, GuessSureness.LIKELY, Use.SETTING)
    assert len(list(guessed([block], {(1, "holding", 4, 1), (1, "holding", 5, 1)}))) == 2
