"""Six meters that nobody has described, whose registers are known: what they answer, and what a master writes."""

from __future__ import annotations

import random
import struct
from collections.abc import Iterator
from dataclasses import dataclass

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from dissectors.modbus.envelope import seal_rtu
from dissectors.profiles.model import Kind

LINE = LineSettings.parse("9600,8E1")
MS = 1_000_000
STATION = 7
FORMS = {
    Kind.F32: ">f",
    Kind.F64: ">d",
    Kind.U32: ">I",
    Kind.S32: ">i",
    Kind.U64: ">Q",
    Kind.U16: ">H",
    Kind.S16: ">h",
}
Series = Iterator[float]


@dataclass(frozen=True)
class Held:
    """One value of a meter. `is_still`: it never changes, so that nobody can tell its kind."""

    kind: Kind
    series: Series
    is_written: bool = False
    is_still: bool = False


@dataclass(frozen=True)
class Meter:
    """One meter. `swapped`, `little`: its order; `blocks`: first register and values of each question."""

    name: str
    swapped: bool
    little: bool
    table: str
    blocks: tuple[tuple[int, tuple[Held, ...]], ...]
    has_gaps: bool = False

    def places(self) -> Iterator[tuple[int, Held]]:
        """Every value with its first register."""
        for first, values in self.blocks:
            at = first
            for held in values:
                yield at, held
                at += held.kind.registers


def measured(dice: random.Random, middle: float, step: float, digits: int | None = None) -> Series:
    value = middle
    while True:
        value += dice.gauss(0, step) + (middle - value) * 0.05
        yield value if digits is None else round(value, digits)


def counted(dice: random.Random, begin: float, most: int, unit: float = 1) -> Series:
    value = begin
    while True:
        yield value
        value += dice.randrange(most) * unit


def chosen(dice: random.Random, values: tuple[float, ...]) -> Series:
    value = values[0]
    while True:
        value = dice.choice(values) if dice.random() < 0.06 else value
        yield value


def flipping(dice: random.Random, bits: int, value: int = 0) -> Series:
    while True:
        value ^= 1 << dice.randrange(bits) if dice.random() < 0.6 else 0
        yield value


def still(value: float) -> Series:
    while True:
        yield value


def meters(dice: random.Random) -> Iterator[Meter]:
    def real(middle: float, step: float, digits: int | None = None) -> Held:
        return Held(Kind.F32, measured(dice, middle, step, digits))

    def whole(middle: float, step: float, kind: Kind = Kind.U16) -> Held:
        return Held(kind, measured(dice, middle, step, 0))

    def count(kind: Kind, begin: float, most: int, unit: float = 1) -> Held:
        return Held(kind, counted(dice, begin, most, unit))

    def fixed(value: int) -> Held:
        return Held(Kind.U16, still(value), is_still=True)

    def bits(number: int, value: int = 0) -> Held:
        return Held(Kind.U16, flipping(dice, number, value))

    def wanted(kind: Kind, *values: float) -> Held:
        return Held(kind, chosen(dice, values), is_written=True)

    def between(low: int, high: int) -> int:
        return dice.randrange(1 << low, 1 << high)

    power = (real(230, 0.8), real(231, 0.8), real(5.2, 0.3), real(0, 1.5), real(1150, 60), real(-700, 90))
    rest = (real(0.93, 0.01), real(50, 0.01))
    energies = (count(Kind.F32, dice.uniform(1e3, 5e5), 9, 0.01), count(Kind.U32, between(17, 22), 900))
    yield Meter("energy, words swapped", True, False, "input", ((0, power + rest), (0x48, energies)))
    heat = (
        count(Kind.U32, between(20, 26), 300), count(Kind.U64, between(33, 40), 1 << 28), whole(640, 9), whole(412, 7),
        whole(15, 30, Kind.S16), fixed(3),
    )  # fmt: skip
    yield Meter("heat, 32 and 64 bits", False, False, "holding", ((100, heat),))
    boiler = (
        whole(652, 5), whole(-20, 40, Kind.S16), whole(1800, 30), bits(6), bits(12, 0x100),
        count(Kind.U16, dice.randrange(2000, 9000), 2), fixed(0), fixed(1200),
    )  # fmt: skip
    wishes = (wanted(Kind.U16, 600, 650, 700, 550), wanted(Kind.U16, 1, 2, 3), fixed(500))
    yield Meter("boiler, scaled whole numbers and bits", False, False, "holding", ((0, boiler), (40, wishes)))
    flow = (
        real(12.5, 0.6), real(101.3, 0.05), real(-3, 4), count(Kind.F64, dice.uniform(1e4, 1e6), 500, 0.01),
        Held(Kind.F64, measured(dice, 1150, 60)), count(Kind.U32, between(18, 24), 700), whole(0, 4000, Kind.S32),
    )  # fmt: skip
    yield Meter("flow, all octets swapped", True, True, "input", ((10, flow),))
    gas = (
        real(4.1, 0.02, 2), real(21.5, 0.3, 1), real(0.85, 0.02, 3), count(Kind.U32, between(17, 23), 400),
        whole(-200, 3000, Kind.S32), real(1013, 0.8, 1),
    )  # fmt: skip
    yield Meter("gas, octets swapped in words", False, True, "input", ((0, gas),))
    scattered = (
        (0, (whole(2310, 6),)), (3, (whole(3, 8, Kind.S16),)), (10, (real(60.2, 2), real(18, 1))),
        (20, (count(Kind.U32, between(17, 20), 900),)), (30, (bits(5), wanted(Kind.F32, 21.5, 20, 19.5, 22), fixed(7))),
    )  # fmt: skip
    yield Meter("scattered, gaps refused", True, False, "holding", scattered, has_gaps=True)


def words_of(held: Held, value: float, meter: Meter) -> list[int]:
    raw = struct.pack(FORMS[held.kind], value if held.kind in (Kind.F32, Kind.F64) else int(value))
    if len(raw) == 2:
        return [int.from_bytes(raw, "big")]
    words = [int.from_bytes(raw[at : at + 2], "little" if meter.little else "big") for at in range(0, len(raw), 2)]
    return words[::-1] if meter.swapped else words


def heard(meter: Meter, answers: int) -> Iterator[Chunk]:
    """All that is on the line while a master asks so many times."""
    now, function, written = 1_772_359_200_000_000_000, 3 if meter.table == "holding" else 4, dict[int, list[int]]()
    for _ in range(answers):
        frames: list[bytes] = []
        for first, values in meter.blocks:
            told: list[int] = []
            for held in values:
                at, words = first + len(told), words_of(held, next(held.series), meter)
                if held.is_written and written.get(at) != words:
                    frames += _write(at, words)
                    written[at] = words
                told += words
            frames.append(struct.pack(">BBHH", STATION, function, first, len(told)))
            frames.append(struct.pack(f">BBB{len(told)}H", STATION, function, 2 * len(told), *told))
            if meter.has_gaps:
                frames.append(struct.pack(">BBHH", STATION, function, first + len(told), 1))
                frames.append(bytes((STATION, function | 0x80, 2)))
        for frame in frames:
            octets = seal_rtu(frame)
            now += 20 * MS + len(octets) * LINE.char
            yield Chunk(now, octets)
        now += 500 * MS


def _write(at: int, words: list[int]) -> list[bytes]:
    if len(words) == 1:
        return [struct.pack(">BBHH", STATION, 6, at, *words)] * 2
    many = struct.pack(f">BBHHB{len(words)}H", STATION, 16, at, len(words), 2 * len(words), *words)
    return [many, many[:6]]
