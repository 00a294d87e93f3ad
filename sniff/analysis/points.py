"""Points: values taken from exchanges, by device and name; the latest of each, and all of them. Pure.

`PointReader` is fed what the engine gives and gives samples; `PointTable` holds the latest of each point with a short
history, mergeable. A value counts only when its exchange is whole: a request that nobody answered tells nothing.
"""

from __future__ import annotations

import math
from collections import OrderedDict, deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

from dissectors.frame import Frame, Role
from dissectors.histogram import Histogram
from dissectors.line import NS_PER_S
from dissectors.manifest import Dissector
from dissectors.meaning import Meaning
from dissectors.profiles import Devices, Entry
from dissectors.profiles.decoding import Quality, Value, decode
from dissectors.readings import Origin, Reading
from dissectors.tracker import Transaction, Verdict
from sniff.engine.engine import Output, Row

MOST_OPEN = 20_000
"""Frames remembered while their transaction is open."""

MOST_ASKED = 512
"""Requests remembered after their transaction closed, for answers that come late."""

MOST_POINTS = 50_000
HISTORY = 120
BROADCAST = 0

ALL = "all"
"""Name of the device that a broadcast is for."""

WHOLE = frozenset({Verdict.ANSWERED, Verdict.RETRY})
ALONE = frozenset({Verdict.BROADCAST, Verdict.DATA})
TELLING = WHOLE | ALONE | {Verdict.LATE}
"""Exchanges whose frames may carry values that count."""


@dataclass(frozen=True, slots=True)
class Sample:
    """One value of one point. `time`: ns, end of the frame that carried or confirmed it; `frame`: that which carried
    it. `device`: the station's address; None for a broadcast.
    """

    time: int
    device: int | None
    value: Value
    frame: int

    @property
    def name(self) -> str:
        """Of the point."""
        return self.value.name

    @property
    def station(self) -> str:
        """The device in words: "5", or "all"."""
        return station_name(self.device)

    @property
    def finite(self) -> bool:
        """Whether it is a number that can be written down; False for text, NaN and the infinities."""
        return not isinstance(self.value.value, str) and math.isfinite(self.value.value)


def station_name(device: int | None) -> str:
    """A device in words: "5", or "all"."""
    return ALL if device is None else str(device)


@dataclass(frozen=True, slots=True)
class Remembered:
    """A good frame and its number."""

    no: int
    frame: Frame


@dataclass(frozen=True, slots=True)
class ValuedExchange:
    """A transaction whose values count. `response`: None where none was to come."""

    transaction: Transaction
    request: Remembered
    response: Remembered | None


class PointReader:
    """Takes values out of what the engine gives. Bounded memory. `frames`: good ones whose transaction is open, by
    number; `asked`: requests of closed transactions, by its id."""

    def __init__(self, dissector: Dissector, devices: Devices | None = None) -> None:
        self.devices = devices or Devices()
        self.dissector = dissector
        self._readings = dissector.readings
        self.frames: OrderedDict[int, Frame] = OrderedDict()
        self.asked: OrderedDict[int, Remembered] = OrderedDict()

    def add(self, output: Output) -> list[Sample]:
        """Take rows and closed transactions; give the samples that these complete, in the order of closing."""
        return [sample for exchange in self._exchanges(output) for sample in self.samples(exchange)]

    def remember(self, output: Output) -> None:
        """Take rows and closed transactions for `meaning` alone: no value is worked out."""
        for _ in self._exchanges(output):
            pass

    def meaning(self, row: Row) -> Meaning | None:
        """What is known of a row besides its octets.

        An answer needs its request: ask when its transaction has closed, not much later.
        """
        asked = self.asked.get(row.placement.tx) if row.placement is not None else None
        return meaning_of(self.dissector, self.devices, row, asked.frame if asked is not None else None)

    def _exchanges(self, output: Output) -> Iterator[ValuedExchange]:
        if self._readings is None:
            return
        for row in output.rows:
            if isinstance(row.event, Frame) and row.event.ok:
                self.frames[row.no] = row.event
        for transaction in output.transactions:
            exchange = self._exchange(transaction)
            if exchange is not None:
                yield exchange
        while len(self.frames) > MOST_OPEN:
            self.frames.popitem(last=False)

    def _exchange(self, transaction: Transaction) -> ValuedExchange | None:
        """The frames of a transaction that tells something."""
        request = self._take(transaction.request)
        response = self._take(transaction.response)
        if request is not None:
            self.ask(transaction.id, request)
        verdict = transaction.verdict
        if verdict is Verdict.LATE and transaction.of is not None:
            request = self.asked.get(transaction.of)
            if request is not None:
                self.ask(transaction.id, request)
        if request is None:
            return None
        if verdict in ALONE:
            return ValuedExchange(transaction, request, None)
        if response is not None and (verdict in WHOLE or verdict is Verdict.LATE):
            return ValuedExchange(transaction, request, response)
        return None

    def ask(self, tx: int, request: Remembered) -> None:
        """Remember what a transaction asked, for an answer that comes late."""
        self.asked[tx] = request
        if len(self.asked) > MOST_ASKED:
            self.asked.popitem(last=False)

    def samples(self, exchange: ValuedExchange) -> Iterator[Sample]:
        """What an exchange tells."""
        request, response = exchange.request, exchange.response
        readings = self._readings(request.frame, response.frame if response else None) if self._readings else ()
        if not readings:
            return
        transaction = exchange.transaction
        station = None if transaction.verdict is Verdict.BROADCAST else transaction.station
        if readings[0].station is not None:
            station = readings[0].station
        confirmed = (response or request).frame.end
        profile = self.devices.at(station)
        limits = profile.limits_on(self.dissector.profile_family) if profile is not None else None
        for value in decode(profile, readings):
            if (
                limits is not None
                and value.how is Origin.WRITE
                and limits.ignores(transaction.kind, value.reading.space)
            ):
                continue  # acknowledged, never done
            carrier = response if response is not None and value.how is Origin.READ else request
            yield Sample(
                confirmed, station, value, (response or carrier).no if value.how is Origin.REPORT else carrier.no
            )

    def _take(self, no: int | None) -> Remembered | None:
        frame = self.frames.pop(no, None) if no is not None else None
        return Remembered(no, frame) if frame is not None and no is not None else None


def meaning_of(dissector: Dissector, devices: Devices, row: Row, request: Frame | None) -> Meaning | None:
    """What is known of a row besides its octets; None where it is no good frame of an exchange. An answer needs its
    `request`."""
    event, placement = row.event, row.placement
    take = dissector.readings
    if take is None or placement is None or not isinstance(event, Frame) or not event.ok:
        return None
    if placement.role is Role.RESPONSE:
        station, readings = placement.source, take(request, event) if request is not None else ()
        readings = tuple(reading for reading in readings if reading.how is not Origin.WRITE)
    else:
        station, readings, request = placement.destination, take(event, None), None
        station = None if placement.role is Role.BROADCAST else station
    asked: tuple[Reading, ...] = ()
    if not readings and placement.role is Role.REQUEST and dissector.asks is not None:
        asked = dissector.asks(event)
    for one in (*readings[:1], *asked[:1]):
        station = station if one.station is None else one.station
    profile = devices.at(station)
    refusal = dissector.refusal
    refused = refusal(event) if profile is not None and refusal is not None and not readings else None
    words = profile.exception(*refused) if profile is not None and refused is not None else ""
    return Meaning(station, profile, readings, words, request, asked)


class SampleRun(NamedTuple):
    """Samples of one point that follow one another, as in `Point`."""

    samples: int
    every: Histogram
    low: float
    high: float
    written: int


@dataclass(slots=True)
class Point:
    """The latest of one point. `changed`: ns, when its value last became another one, 0 when it never did; `history`:
    (ns, value). `first`: value and time, ns, of the earliest sample. `every`: ns from one sample to the next; `low`,
    `high`: of its numbers; `written`: how many of the samples a master wrote."""

    sample: Sample
    count: int = 0
    changed: int = 0
    history: deque[tuple[int, float]] = field(default_factory=lambda: deque(maxlen=HISTORY))
    every: Histogram = field(default_factory=Histogram)
    low: float | None = None
    high: float | None = None
    written: int = 0
    first: tuple[int | float | str, int] = field(init=False)

    def __post_init__(self) -> None:
        self.first = self.sample.value.value, self.sample.time

    @property
    def entry(self) -> Entry | None:
        """What the profile says of it."""
        return self.sample.value.entry

    @property
    def is_command(self) -> bool:
        """Whether the latest was written to the station, not read from it."""
        return self.sample.value.how is Origin.WRITE

    @property
    def quality(self) -> Quality:
        """Of the latest sample."""
        return self.sample.value.quality

    @property
    def interval(self) -> int | None:
        """From one sample to the next as it usually is, ns; None where there was but one."""
        return self.every.quantile(0.5)

    @property
    def jitter(self) -> int | None:
        """By how much nine of ten intervals differ, halved: ± ns; None with less than three samples."""
        low, high = self.every.quantile(0.05), self.every.quantile(0.95)
        return None if low is None or high is None or self.every.count < 2 else (high - low) // 2

    @property
    def rate(self) -> float | None:
        """Mean change a second, up and down, lately; None where no time went by."""
        if len(self.history) < 2 or self.history[-1][0] <= self.history[0][0]:
            return None
        moved = sum(abs(now - was) for (_, was), (_, now) in pairwise(self.history))
        return moved * NS_PER_S / (self.history[-1][0] - self.history[0][0])

    def add(self, sample: Sample) -> None:
        """Take a later sample."""
        if self.count:
            self.every.add(sample.time - self.sample.time)
            if sample.value.value != self.sample.value.value:
                self.changed = sample.time
        self.sample = sample
        self.count += 1
        self.written += sample.value.how is Origin.WRITE
        if sample.finite and not isinstance(sample.value.value, str):
            number = float(sample.value.value)
            self.history.append((sample.time, number))
            self.reach(number, number)

    def reach(self, low: float, high: float) -> None:
        """Its numbers went from `low` to `high`."""
        self.low = low if self.low is None else min(self.low, low)
        self.high = high if self.high is None else max(self.high, high)

    def copy(self) -> Point:
        """The same, which goes on by itself."""
        copy = Point(
            self.sample,
            self.count,
            self.changed,
            self.history.copy(),
            self.every.copy(),
            self.low,
            self.high,
            self.written,
        )
        copy.first = self.first
        return copy

    def go_on(self, later: Point) -> None:
        """Take what a later stretch saw of the same point."""
        if later.changed:
            self.changed = later.changed
        elif later.first[0] != self.sample.value.value:
            self.changed = later.first[1]
        self.every = self.every.merge(later.every)
        self.every.add(later.first[1] - self.sample.time)
        if later.low is not None and later.high is not None:
            self.reach(later.low, later.high)
        self.written += later.written
        self.sample = later.sample
        self.count += later.count
        self.history.extend(later.history)


Key = tuple[str, str]
"""Station and name of a point."""


class PointTable:
    """The latest value of every point, in the order of first sight. `dropped`: samples of points beyond the limit."""

    def __init__(self) -> None:
        self._points: dict[Key, Point] = {}
        self.dropped = 0
        self.version = 0

    def add(self, samples: Iterable[Sample]) -> None:
        """Take samples in the order of time."""
        for sample in samples:
            key = sample.station, sample.name
            point = self._points.get(key)
            if point is None:
                if len(self._points) >= MOST_POINTS:
                    self.dropped += 1
                    continue
                point = self._points[key] = Point(sample)
            point.add(sample)
            self.version += 1

    def add_run(
        self,
        key: Key,
        last: Sample,
        first: tuple[float, int],
        changed: int | None,
        history: Iterable[tuple[int, float]],
        seen: SampleRun,
    ) -> None:
        """Take samples of one point, numbers all, of which `last` is the last. `first`: value and time of the
        first; `changed`: ns, of the last that was another one than the one before it among them, None where none was;
        `history`: of the last `HISTORY`; `seen`: what they add up to."""
        count = seen.samples
        point = self._points.get(key)
        if point is None:
            if len(self._points) >= MOST_POINTS:
                self.dropped += count
                return
            point = self._points[key] = Point(last)
            point.first = first
        else:
            point.every.add(first[1] - point.sample.time)
            if point.sample.value.value != first[0]:
                point.changed = first[1]
        if changed is not None:
            point.changed = changed
        point.sample = last
        point.count += count
        point.history.extend(history)
        point.every = point.every.merge(seen.every)
        point.reach(seen.low, seen.high)
        point.written += seen.written
        self.version += count

    def merge(self, later: PointTable) -> PointTable:
        """With a table of a later stretch of the same bus, as a new value: the table of both stretches. Where either
        was full, what it dropped stays dropped."""
        whole = PointTable()
        whole.dropped = self.dropped + later.dropped
        whole._points = {key: point.copy() for key, point in self._points.items()}
        for key, point in later._points.items():
            mine = whole._points.get(key)
            if mine is not None:
                mine.go_on(point)
            elif len(whole._points) < MOST_POINTS:
                whole._points[key] = point.copy()
            else:
                whole.dropped += point.count
        whole.version = sum(point.count for point in whole._points.values())
        return whole

    def __len__(self) -> int:
        return len(self._points)

    def __iter__(self) -> Iterator[Point]:
        return iter(self._points.values())

    def get(self, station: str, name: str) -> Point | None:
        """One point."""
        return self._points.get((station, name))
