"""Guessed points of stations without a profile: guesses of their registers beside their latest values. Pure."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import isfinite
from typing import TYPE_CHECKING

import numpy as np

from dissectors.manifest import Dissector
from dissectors.profiles import Devices
from dissectors.profiles.decoding import plain_name
from dissectors.profiles.model import Kind
from sniff.analysis.point_reader import station_name
from sniff.analysis.points import Key, Point, PointTable
from sniff.analysis.register_guess import RegisterGuess, guessed
from sniff.analysis.register_kinds import GuessSureness, Use
from sniff.analysis.register_series import WORD_SPACES, RegisterSeries, RegisterStretch, covering
from sniff.analysis.register_words import read_as

if TYPE_CHECKING:
    from sniff.analysis.point_columns import TableSamples

_USES = {
    Use.CONSTANT: "constant",
    Use.SENSOR: "sensor",
    Use.COUNTER: "counter",
    Use.SETTING: "set point",
    Use.BITS: "bits",
}
_SURE = {GuessSureness.SURE: "sure", GuessSureness.LIKELY: "likely", GuessSureness.OPEN: "open"}


@dataclass(frozen=True, slots=True)
class GuessedPoint:
    """What one register of a point may be. `value`: of the latest samples, so read; `is_itself`: the register as it is,
    a whole number; `is_covered`: it is a further part of the value that begins before it. `history`: times, ns, and
    values so read. The others as in `RegisterGuess`."""

    words: str
    value: float | None
    low: float
    high: float
    rate: float
    is_covered: bool = False
    is_itself: bool = True
    history: tuple[tuple[int, float], ...] = ()


class Guessing:
    """Fed the samples of one bus; tells what the registers of stations without a profile may be."""

    def __init__(self, dissector: Dissector, devices: Devices) -> None:
        self.dissector = dissector
        self.devices = devices
        self.series = RegisterSeries()

    def add(self, samples: TableSamples) -> None:
        """Take those of a table."""
        self.series.add_samples(samples)

    def of(self, points: PointTable) -> dict[Key, GuessedPoint]:
        """By point, for those that the table has."""
        found: dict[Key, GuessedPoint] = {}
        for guess in guessed(covering(self._undescribed()), self.series.written):
            for key, told in _told(guess, points, self.series):
                found[key] = told
        return found

    def _undescribed(self) -> Iterable[RegisterStretch]:
        return (block for block in self.series.blocks() if self.devices.at(block.device) is None)


class LatestGuesses:
    """The same for a table that grows: guesses are worked out anew when a tenth more was heard, values every time."""

    def __init__(self) -> None:
        self._of: tuple[RegisterSeries | None, int] = (None, 0)
        self._guesses: list[RegisterGuess] = []

    def of(self, points: PointTable, series: RegisterSeries) -> dict[Key, GuessedPoint]:
        """By point, for those that the table has; what is described is among them."""
        heard = sum(block.count for block in series.blocks())
        if self._of[0] is not series or not self._of[1] <= heard < 1.1 * self._of[1] + 1:
            self._of = series, heard
            self._guesses = list(guessed(covering(series.blocks()), series.written))
        return {key: told for guess in self._guesses for key, told in _told(guess, points, series)}


def guess_of(point: Point, series: RegisterSeries, points: PointTable) -> GuessedPoint | None:
    """What one point may be; None where it is no register, or described."""
    sample, reading = point.sample, point.sample.value.reading
    if point.entry is not None or sample.device is None or reading.space not in WORD_SPACES:
        return None
    blocks = [
        block
        for block in series.blocks()
        if (block.device, block.space) == (sample.device, reading.space)
        and block.first <= reading.address < block.first + block.width
    ]
    key = sample.station, sample.name
    for guess in guessed(covering(blocks), series.written):
        for place, one in _told(guess, points, series):
            if place == key:
                return replace(one, history=history(guess, blocks))
    return None


def history(guess: RegisterGuess, blocks: Iterable[RegisterStretch]) -> tuple[tuple[int, float], ...]:
    """Times, ns, and values, as all questions tell them that asked for the whole."""
    width = guess.kind.registers
    whole = [
        block for block in blocks if block.first <= guess.address and guess.address + width <= block.first + block.width
    ]
    told: list[tuple[int, float]] = []
    for block in whole:
        at = guess.address - block.first
        values = read_as(block.words[:, at : at + width], guess.kind, guess.swapped, guess.little)
        finite = np.isfinite(values).tolist()
        told += [(time, value) for time, value, good in zip(block.times, values.tolist(), finite, strict=True) if good]
    return tuple(sorted(told))


def _told(guess: RegisterGuess, points: PointTable, series: RegisterSeries) -> Iterable[tuple[Key, GuessedPoint]]:
    station = station_name(guess.device)
    keys = [(station, plain_name(guess.space, guess.address + step)) for step in range(guess.kind.registers)]
    held = [points.get(*key) for key in keys]
    raws = [point.sample.value.raw for point in held if point is not None]
    value = None
    if len(raws) == len(held) and None not in raws:
        row = np.array([[(raw or 0) & 0xFFFF for raw in raws]], np.uint16)
        value = float(read_as(row, guess.kind, guess.swapped, guess.little)[0])
        if len({point.sample.frame for point in held if point is not None}) > 1:  # words of two moments are no number
            value = _latest_whole(guess, series)
    words = told(guess)
    for step, (key, point) in enumerate(zip(keys, held, strict=True)):
        whole = len(raws) == len(held)
        covered, itself = step > 0 and whole, guess.kind is Kind.U16
        low, high, rate = guess.low, guess.high, guess.rate
        if value is not None and isfinite(value):
            low, high = min(low, value), max(high, value)
        if itself and point is not None and point.low is not None and point.high is not None:
            low, high, rate = point.low, point.high, point.rate or 0.0  # of every sample, where a guess has some
        yield key, GuessedPoint(words, value, low, high, rate, covered, itself)


def _latest_whole(guess: RegisterGuess, series: RegisterSeries) -> float | None:
    """The latest value of which all registers were answered at once, as far as answers are kept."""
    blocks = [one for one in series.blocks() if (one.device, one.space) == (guess.device, guess.space)]
    seen = history(guess, blocks)
    return seen[-1][1] if seen else None


def told(guess: RegisterGuess) -> str:
    """ "guessed f32 low word first: sensor (sure)"."""
    order = " low word first" if guess.swapped else ""
    order += " low octet first" if guess.little else ""
    kind = "" if guess.use is Use.BITS else f" {guess.kind.value}{order}"
    return f"guessed{kind}: {_USES[guess.use]} ({_SURE[guess.sure]})"
