"""Meters that nobody has described, in all byte orders: what is said of their registers is right, or it is not sure."""

from __future__ import annotations

import random
import struct
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import pytest

from dissectors.profiles.model import Kind
from sniff.analysis.register_guess import RegisterGuess, guessed
from sniff.analysis.register_kinds import GuessSureness
from sniff.analysis.register_series import RegisterStretch

FORMS = {
    Kind.F32: ">f",
    Kind.F64: ">d",
    Kind.U32: ">I",
    Kind.S32: ">i",
    Kind.U64: ">Q",
    Kind.U16: ">H",
    Kind.S16: ">h",
}
ORDERS = ((False, False), (True, False), (True, True), (False, True))
SEEDS = range(4)
ANSWERS = 200


@dataclass(frozen=True)
class Held:
    """A value of a meter. `is_told`: whether what it shows tells its kind."""

    kind: Kind
    value: float
    is_told: bool = True


def values(dice: random.Random) -> Iterator[list[Held]]:
    """What a meter shows, answer by answer."""
    small, large, decimal = dice.randrange(1 << 20), dice.randrange(1 << 30, 1 << 34), dice.randrange(19_000)
    energy, total, outside = dice.uniform(10, 9_999), dice.uniform(1e3, 1e6), dice.uniform(-30, 30)
    for _ in range(ANSWERS):
        small, large, decimal = small + dice.randrange(400), large + dice.randrange(3_000), decimal + dice.randrange(9)
        energy, total = energy + abs(dice.gauss(0, 0.01)), total + abs(dice.gauss(0, 0.5))
        outside += dice.gauss(0, 3)
        yield [
            Held(Kind.F32, 230 + dice.gauss(0, 2)),
            Held(Kind.F32, abs(5 + dice.gauss(0, 0.5))),
            Held(Kind.F32, dice.gauss(0, 200)),
            Held(Kind.F32, 50 + dice.gauss(0, 0.02)),
            Held(Kind.F32, energy),
            Held(Kind.F32, 0.9 + dice.gauss(0, 0.01)),
            Held(Kind.U32, small),
            Held(Kind.S32, round(dice.gauss(0, 5_000))),
            Held(Kind.U64, large, is_told=False),  # its upper half stays as it is
            Held(Kind.F64, total),
            Held(Kind.F64, 1_150 + dice.gauss(0, 60)),
            Held(Kind.S16, round(outside)),
            Held(Kind.U16, 2_300 + round(dice.gauss(0, 20))),
            Held(Kind.U16, 1 << dice.randrange(4)),
            Held(Kind.U16, int(f"{decimal % 10_000}", 16), is_told=False),  # decimal digits: no profile has them
            Held(Kind.U32, int(f"{decimal * 7}", 16), is_told=False),
            Held(Kind.F32, 0.0, is_told=False),
            Held(Kind.U32, 60, is_told=False),
        ]


def words_of(held: Held, swapped: bool, little: bool) -> list[int]:
    raw = struct.pack(FORMS[held.kind], held.value if held.kind in (Kind.F32, Kind.F64) else int(held.value))
    words = [raw[at : at + 2] for at in range(0, len(raw), 2)]
    if len(words) == 1:
        return [int.from_bytes(raw, "big")]
    return [int.from_bytes(word, "little" if little else "big") for word in (words[::-1] if swapped else words)]


def meter(seed: int, swapped: bool, little: bool) -> tuple[dict[int, Held], RegisterStretch]:
    """Where its values are, and what was heard."""
    places: dict[int, Held] = {}
    block = RegisterStretch(1, "input", 0, 0)
    for turn, shown in enumerate(values(random.Random(seed))):
        words: list[int] = []
        for held in shown:
            places[len(words)] = held
            words += words_of(held, swapped, little)
        block.width = len(words)
        block.add(1_772_359_200_000_000_000 + turn * 1_000_000_000, tuple(words))
    return places, block


def is_right(guess: RegisterGuess, held: Held | None, swapped: bool, little: bool) -> bool:
    same_order = guess.kind.registers == 1 or (guess.swapped, guess.little) == (swapped, little)
    return held is not None and guess.kind is held.kind and same_order


@pytest.mark.parametrize(("swapped", "little"), ORDERS)
def test_what_is_sure_is_right_and_most_is_right(swapped: bool, little: bool) -> None:
    counts: Counter[bool] = Counter()
    for seed in SEEDS:
        places, block = meter(seed, swapped, little)
        found = {guess.address: guess for guess in guessed([block], set())}
        for guess in found.values():
            held = places.get(guess.address)
            assert guess.sure is not GuessSureness.SURE or (held is not None and held.is_told), guess
            assert guess.sure is not GuessSureness.SURE or is_right(guess, held, swapped, little), guess
        for address, held in places.items():
            if held.is_told:
                counts[address in found and is_right(found[address], held, swapped, little)] += 1
    assert counts[True] >= 0.9 * counts.total()
