"""Samples: values taken out of exchanges, by device and name. Pure.

`PointReader` is fed what the engine gives and gives samples. A value counts only when its exchange is whole: a request
that nobody answered tells nothing.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Iterator
from dataclasses import dataclass

from dissectors.frame import Frame, Role
from dissectors.manifest import Dissector
from dissectors.meaning import Meaning
from dissectors.profiles import Devices
from dissectors.profiles.decoding import Value, decode
from dissectors.readings import Origin, Reading
from dissectors.tracker import Transaction, Verdict
from sniff.engine.engine import Output, Row

MOST_OPEN = 20_000
"""Frames remembered while their transaction is open."""

MOST_ASKED = 512
"""Requests remembered after their transaction closed, for answers that come late; tokens are none."""

MOST_HEARD = 2_048
"""Values that are remembered with what said them: most exchanges of a poll list were heard before, octet for octet."""

ALL = "all"
"""Name of the device that a broadcast is for."""

WHOLE = frozenset({Verdict.ANSWERED, Verdict.RETRY})
ALONE = frozenset({Verdict.BROADCAST, Verdict.DATA})
TELLING = WHOLE | ALONE | {Verdict.LATE}
"""Exchanges whose frames may carry values that count."""


_StationValues = tuple[int | None, tuple[Value, ...]]


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
        self._heard: dict[tuple[bytes, bytes | None, int | None], _StationValues] = {}
        self._held = 0  # values in it

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
        if request is not None and not transaction.is_passing:  # who passes the right to send on asks for nothing
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
        request, response, transaction = exchange.request, exchange.response, exchange.transaction
        station, values = self._values(
            request.frame,
            response.frame if response else None,
            None if transaction.verdict is Verdict.BROADCAST else transaction.station,
        )
        if not values:
            return
        confirmed = (response or request).frame.end
        profile = self.devices.at(station)
        limits = profile.limits_on(self.dissector.profile_family) if profile is not None else None
        for value in values:
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

    def _values(self, request: Frame, response: Frame | None, station: int | None) -> _StationValues:
        """What two frames say, which is worked out once for those that say it by their octets alone."""
        frames = (request,) if response is None else (request, response)
        if any(frame.flags or frame.repair is not None or frame.assembly is not None for frame in frames):
            return self._read(request, response, station)
        heard = request.octets, None if response is None else response.octets, station
        known = self._heard.get(heard)
        if known is None:
            known = self._heard[heard] = self._read(request, response, station)
            self._held += 1 + len(known[1])
            if self._held > MOST_HEARD:
                self._heard, self._held = {}, 0
        return known

    def _read(self, request: Frame, response: Frame | None, station: int | None) -> _StationValues:
        readings = self._readings(request, response) if self._readings else ()
        if readings and readings[0].station is not None:
            station = readings[0].station
        return station, decode(self.devices.at(station), readings)

    def _take(self, no: int | None) -> Remembered | None:
        frame = self.frames.pop(no, None) if no is not None else None
        return Remembered(no, frame) if frame is not None and no is not None else None


def meaning_of(dissector: Dissector, devices: Devices, row: Row, request: Frame | None) -> Meaning | None:
    """What is known of a row besides its octets; None where it is no good frame of an exchange. An answer needs its
    `request`."""
    event, placement = row.event, row.placement
    take = dissector.readings
    written: tuple[Reading, ...] = ()
    if take is None or placement is None or not isinstance(event, Frame) or not event.ok:
        return None
    if placement.role is Role.RESPONSE:
        station, readings = placement.source, take(request, event) if request is not None else ()
        written = tuple(reading for reading in readings if reading.how is Origin.WRITE)
        readings = tuple(reading for reading in readings if reading.how is not Origin.WRITE)
    else:
        station, readings, request = placement.destination, take(event, None), None
        station = None if placement.role is Role.BROADCAST else station
    asked: tuple[Reading, ...] = ()
    if not readings and placement.role is Role.REQUEST and dissector.asks is not None:
        asked = dissector.asks(event)
    for one in (*readings[:1], *written[:1], *asked[:1]):
        station = station if one.station is None else one.station
    profile = devices.at(station)
    refusal = dissector.refusal
    refused = refusal(event) if profile is not None and refusal is not None and not readings else None
    words = profile.exception(*refused) if profile is not None and refused is not None else ""
    return Meaning(station, profile, readings, words, request, asked, written, dissector.noun)
