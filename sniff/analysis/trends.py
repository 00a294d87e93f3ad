"""Trends of values over a whole capture, thinned evenly, for a plot: an observer of one bus. Pure, bounded.

Points that a profile describes and things that name themselves are kept as they come; of registers that nobody has
described the numbers that they are guessed to be.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from dissectors.manifest import Dissector
from dissectors.profiles import Devices
from dissectors.profiles.decoding import plain_name
from sniff.analysis.guessed_points import history, told
from sniff.analysis.point_reader import PointReader, Sample, station_name
from sniff.analysis.points import Key
from sniff.analysis.register_guess import guessed
from sniff.analysis.register_kinds import GuessSureness, Use
from sniff.analysis.register_series import WORD_SPACES, RegisterSeries, covering

if TYPE_CHECKING:
    from sniff.analysis.point_columns import PlainSamples
    from sniff.engine.engine import Output
    from sniff.engine.session import LineEvent
    from sniff.engine.table import Table

MOST_VALUES = 512
"""Values of one point that are kept: beyond it every second one is let go, and so on."""

MOST_POINTS = 2048

_TABLES = (*WORD_SPACES, "coil", "discrete")


@dataclass(slots=True)
class Trend:
    """One value over time. `how`: what it is guessed to be, empty where it is known. `times`: ns."""

    station: str
    name: str
    unit: str = ""
    how: str = ""
    times: list[int] = field(default_factory=list)
    values: list[float] = field(default_factory=list)
    count: int = 0
    _every: int = 1

    def add(self, time: int, value: float) -> None:
        """Take a later value."""
        if self.count % self._every == 0:
            if len(self.values) >= MOST_VALUES:
                del self.times[1::2], self.values[1::2]
                self._every *= 2
            self.times.append(time)
            self.values.append(value)
        self.count += 1

    @property
    def turns(self) -> int:
        """How often it became another one."""
        return sum(one != other for one, other in zip(self.values, self.values[1:], strict=False))


class Trends:
    """Fed by a bus; gives what moved."""

    def __init__(self, dissector: Dissector, devices: Devices) -> None:
        self._reader = PointReader(dissector, devices)
        self._devices = devices
        self._series = RegisterSeries()
        self._trends: dict[Key, Trend] = {}

    def add(self, output: Output) -> None:
        """Take rows and closed transactions."""
        samples = self._reader.add(output)
        self._series.add(sample for sample in samples if self._is_undescribed(sample))
        for sample in samples:
            self._take(sample)

    def add_table(self, table: Table) -> None:
        """Take many at once; the same as one after the other."""
        from sniff.analysis.point_columns import PointRun, TableSamples, by_point
        from sniff.analysis.table_points import samples_of

        samples = samples_of(self._reader, table)
        undescribed = [one for one in samples.others if self._is_undescribed(one[1])]
        self._series.add_samples(TableSamples(samples.plain, undescribed))
        for one in by_point(TableSamples(_named_ones(samples.plain), samples.others)):
            if isinstance(one, PointRun):
                self._add(one.key, one.unit, one.numbers())
            else:
                self._take(one)

    def add_line_event(self, event: LineEvent) -> None:
        """It says nothing of a value."""

    def moved(self, most: int) -> list[Trend]:
        """What became another one at least twice, the described first, by station and name; at most so many."""
        held = [trend for trend in (*self._trends.values(), *self._guesses()) if trend.turns > 1]
        held.sort(key=lambda trend: (bool(trend.how), not trend.unit, -trend.turns))
        return sorted(held[:most], key=lambda trend: (len(trend.station), trend.station, trend.name))

    def _is_undescribed(self, sample: Sample) -> bool:
        return sample.value.reading.space in _TABLES and self._devices.at(sample.device) is None

    def _take(self, sample: Sample) -> None:
        value = sample.value
        if (
            value.bit
            or not sample.finite
            or isinstance(value.value, str)
            or value.words
            or self._is_undescribed(sample)
        ):
            return
        self._add((sample.station, sample.name), value.unit, [(sample.time, float(value.value))])

    def _add(self, key: Key, unit: str, numbers: Iterable[tuple[int, float]]) -> None:
        trend = self._trends.get(key)
        if trend is None:
            if len(self._trends) >= MOST_POINTS:
                return
            trend = self._trends[key] = Trend(*key, unit)
        for time, number in numbers:
            trend.add(time, number)

    def _guesses(self) -> Iterator[Trend]:
        blocks = covering(self._series.blocks())
        for guess in guessed(blocks, self._series.written):
            if guess.use in (Use.SENSOR, Use.COUNTER, Use.SETTING) and guess.sure > GuessSureness.OPEN:
                seen = history(guess, [one for one in blocks if (one.device, one.space) == (guess.device, guess.space)])
                times, values = [time for time, _ in seen], [value for _, value in seen]
                yield Trend(
                    station_name(guess.device),
                    plain_name(guess.space, guess.address),
                    "",
                    told(guess),
                    times,
                    values,
                    len(seen),
                )


def _named_ones(plain: PlainSamples) -> PlainSamples:
    """Numbers of things that name themselves; without those that the protocol has words for."""
    of_table = np.array([space in _TABLES for space in plain.spaces], bool)
    named = ~of_table[plain.space]
    if plain.told is not None:
        named &= np.array([not words for words in plain.told.phrases], bool)[plain.told.words]
    return plain.take(named)
