"""Readings of MS/TP exchanges, many at once: `readings.py` for one property that is read or written, where its value is
one number.

What a reading is called depends on the kind of object, the property, its array index and the tag of the value, and the
words of an enumeration on its number too: of all exchanges that are alike in these, one is read by `readings.py`, and
the others differ from it in instance, station and number alone.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from dissectors.bacnet import message as messages
from dissectors.bacnet import npdu as npdus
from dissectors.bacnet.apdu import SEGMENTED, PduType
from dissectors.bacnet.frame_types import HEADER, FrameType
from dissectors.bacnet.readings import READ_PROPERTY, TELLING, WRITE_PROPERTY, told
from dissectors.bacnet.tags import BOOLEAN
from dissectors.bacnet.values import NUMBER_OF, UNSPECIFIED_INSTANCE
from dissectors.columns import CHECKS, FrameColumns, Masks, Octets, Times
from dissectors.frame import Check, FoundBy, Frame
from dissectors.reading_columns import HOWS, Floats, ReadingColumns, ToldValues
from dissectors.readings import Origin, Reading
from dissectors.single_reals import shortest

_DESTINATION, _SOURCE, _CRC = 3, 4, 2
_PLAIN_TYPES = (FrameType.DATA_EXPECTING_REPLY, FrameType.DATA_NOT_EXPECTING_REPLY)
_ROUTED = npdus.HAS_DESTINATION | npdus.HAS_SOURCE
_GOOD = CHECKS.index(Check.GOOD)
_READ, _WRITE = HOWS.index(Origin.READ), HOWS.index(Origin.WRITE)

_OBJECT, _PROPERTY, _PROPERTY_2, _INDEX, _INDEX_2 = 0x0C, 0x19, 0x1A, 0x29, 0x2A
_OPENING, _CLOSING, _PRIORITY = 0x3E, 0x3F, 0x49
"""Tags of the parameters of both services (ASHRAE 135, 15.5 and 15.9): one or two octets of property and index."""

_UNSIGNED, _SIGNED, _REAL, _ENUMERATED = (NUMBER_OF[name] for name in ("Unsigned", "Signed", "Real", "Enumerated"))
_NO_INDEX = 1 << 16
_NEGATIVE_ZERO, _EXPONENT = 0x8000_0000, 0x7F80_0000


def _sizes() -> npt.NDArray[np.int64]:
    """Octets behind the first of an application tag, by that; -1 where it is no number, or one of over 32 bits."""
    sizes = np.full(256, -1, np.int64)
    sizes[[BOOLEAN << 4, BOOLEAN << 4 | 1]] = 0
    sizes[_REAL << 4 | 4] = 4
    for number in (_UNSIGNED, _SIGNED, _ENUMERATED):
        sizes[(number << 4) + np.arange(1, 5)] = np.arange(1, 5)
    return sizes


_SIZES = _sizes()


def reading_columns(asked: FrameColumns, answered: FrameColumns, has_answer: Masks, octets: Octets) -> ReadingColumns:
    """See `dissectors.reading_columns.BulkReadings`."""
    wire = _Wire(octets)
    request, answer = _Spoken.of(asked, wire), _Spoken.of(answered, wire)
    is_read = has_answer & request.speaks & (answer.kind == PduType.COMPLEX_ACK) & (answer.service == READ_PROPERTY)
    is_confirmed = has_answer & (answer.kind == PduType.SIMPLE_ACK)
    is_write = is_confirmed & (request.kind == PduType.CONFIRMED_REQUEST) & (request.service == WRITE_PROPERTY)
    silent = (asked.length <= HEADER) | request.is_network | request.is_silent & (is_confirmed | ~has_answer)
    refused = (answered.length <= HEADER) | answer.is_network | answer.is_silent & ~is_confirmed
    silent |= has_answer & refused
    rows = np.flatnonzero(is_read | is_write)
    reads = is_read[rows]
    begin = np.where(reads, answer.begin[rows] + 3, request.begin[rows] + 4)
    end = np.where(reads, answer.end[rows], request.end[rows])
    properties = _Properties.of(wire, begin, end, ~reads)
    fits = properties.fits
    offset = np.where(reads, answered.offset[rows], asked.offset[rows])[fits]
    length = np.where(reads, answered.length[rows], asked.length[rows])[fits]
    return _made(silent, rows[fits], _Carriers(reads[fits], offset, length), properties.take(fits), octets)


_SERVICE_AT = np.array([3, 1, -1, 2, *[-1] * 12])
"""Place of the service in an APDU in one piece, by its kind; -1 where no such APDU tells anything."""

_TELLS = np.zeros((16, 256), bool)
for _kind, _service in TELLING:
    _TELLS[_kind, _service] = True


class _Wire:
    """Octets at any places; beyond the last, that one."""

    def __init__(self, octets: Octets) -> None:
        self._octets = octets if len(octets) else np.zeros(1, np.uint8)

    def at(self, places: Times) -> Times:
        return self._octets.take(places, mode="clip").astype(np.int64)

    def number(self, places: Times, size: Times) -> Times:
        """Of so many octets, four at most, the highest first."""
        number = np.zeros(len(places), np.int64)
        for step in range(4):
            number = np.where(step < size, number << 8 | self.at(places + step), number)
        return number


@dataclass(frozen=True, slots=True)
class _Spoken:
    """What frames of a local station carry, not encoded. `speaks`: whether it is an APDU; its octets are in [`begin`,
    `end`). `is_network`: whether it is a network message.

    `kind`: of an APDU in one piece, -1 for others; `service`: -1 where it has none. `is_silent`: whether such an APDU
    tells nothing, whatever its parameters are.
    """

    speaks: Masks
    is_network: Masks
    begin: Times
    end: Times
    kind: Times
    service: Times

    @classmethod
    def of(cls, frames: FrameColumns, wire: _Wire) -> _Spoken:
        start, length = frames.offset, frames.length.astype(np.int64)
        size = wire.number(start + 5, np.full(len(start), 2))
        carries = (length == HEADER + size + _CRC) & (size >= 2) & np.isin(wire.at(start + 2), _PLAIN_TYPES)
        carries &= (frames.check == _GOOD) & (wire.at(start + HEADER) == npdus.VERSION)
        control = wire.at(start + HEADER + 1)
        is_network = carries & (control & npdus.NETWORK_MESSAGE != 0)
        speaks = carries & ~is_network & (control & _ROUTED == 0) & (size >= 3)
        begin, end = start + HEADER + 2, start + HEADER + size
        first = wire.at(begin)
        kind = first >> 4
        in_pieces = np.isin(kind, (PduType.CONFIRMED_REQUEST, PduType.COMPLEX_ACK)) & (first & SEGMENTED != 0)
        kind = np.where(speaks & ~in_pieces, kind, -1)
        at = begin + _SERVICE_AT[kind]
        service = np.where((at > begin) & (at < end), wire.at(at), -1)
        return cls(speaks, is_network, begin, end, kind, service)

    @property
    def is_silent(self) -> Masks:
        silent: Masks = (self.kind >= 0) & ~((self.service >= 0) & _TELLS[self.kind, self.service])
        return silent


@dataclass(frozen=True, slots=True)
class _Properties:
    """Parameters that are one property with one number. `fits`: whether they are, and nothing else; the others count
    only there. `tag`: first octet of the value; `raw`: what stands behind it, or in it."""

    fits: Masks
    object: Times
    property: Times
    index: Times
    tag: Times
    raw: Times

    @classmethod
    def of(cls, wire: _Wire, begin: Times, end: Times, may_have_priority: Masks) -> _Properties:
        fits = wire.at(begin) == _OBJECT
        thing = wire.number(begin + 1, np.full(len(begin), 4))
        at = begin + 5
        size = wire.at(at) - (_PROPERTY - 1)
        fits &= np.isin(wire.at(at), (_PROPERTY, _PROPERTY_2))
        which = wire.number(at + 1, size)
        at = at + 1 + size
        indexed = np.isin(wire.at(at), (_INDEX, _INDEX_2))
        size = np.where(indexed, wire.at(at) - (_INDEX - 1), 0)
        index = np.where(indexed, wire.number(at + 1, size), _NO_INDEX)
        at = at + np.where(indexed, 1 + size, 0)
        fits &= wire.at(at) == _OPENING
        tag = wire.at(at + 1)
        size = _SIZES[tag]
        fits &= size >= 0
        raw = np.where(size == 0, tag & 1, wire.number(at + 2, size))
        at = at + 2 + size
        fits &= wire.at(at) == _CLOSING
        at = at + 1
        fits &= (at == end) | (may_have_priority & (wire.at(at) == _PRIORITY) & (at + 2 == end))
        odd = (raw == _NEGATIVE_ZERO) | (raw & _EXPONENT == _EXPONENT)  # or no finite number
        fits &= (tag >> 4 != _REAL) | ~odd
        return cls(fits, thing, which, index, tag, raw)

    def take(self, which: Masks) -> _Properties:
        return _Properties(*(getattr(self, one.name)[which] for one in fields(self)))

    def kinds(self) -> Times:
        """A number for each, the same where they differ in instance and number only."""
        named = (self.object >> 22) << 41 | self.property << 25 | self.index << 8 | self.tag
        _, template = np.unique(named, return_inverse=True)
        words = np.where(self.tag >> 4 == _ENUMERATED, self.raw, 0)
        kinds: Times = template.astype(np.int64) << 32 | words
        return kinds

    def numbers(self) -> tuple[npt.NDArray[np.uint64], Floats]:
        """The bits of each, and its value, as `readings.py` has both."""
        kind, bits = self.tag >> 4, 8 * _SIZES[self.tag]
        negative = (kind == _SIGNED) & (self.raw >> np.maximum(bits - 1, 0) & 1 == 1)
        whole = np.where(negative, self.raw - (1 << bits), self.raw)
        values = whole.astype(np.float64)
        reals = np.flatnonzero(kind == _REAL)
        distinct, which = np.unique(self.raw[reals], return_inverse=True)
        singles = distinct.astype(np.uint32).view(np.float32).astype(float).tolist()
        values[reals] = np.array([shortest(single) for single in singles], np.float64)[which]
        return whole.view(np.uint64), values


class _Carriers(NamedTuple):
    """The frames that carry a property: an answer that reads it, or a request that writes it; where they are."""

    reads: Masks
    offset: Times
    length: Times

    def told(self, place: int, octets: Octets) -> tuple[Reading, ...]:
        begin = int(self.offset[place])
        held = octets[begin : begin + int(self.length[place])].tobytes()
        message = messages.read(Frame("mstp", held, 0, 0, Check.GOOD, FoundBy.LENGTH))
        return tuple(told(message)) if message is not None else ()


class _Texts:
    """Texts, each with a unit, by the place where it stands."""

    def __init__(self) -> None:
        self._places: dict[tuple[str, str], int] = {("", ""): 0}

    def place(self, text: str, unit: str = "") -> int:
        return self._places.setdefault((text, unit), len(self._places))

    def all(self) -> tuple[str, ...]:
        return tuple(text for text, _ in self._places)

    def units(self) -> tuple[str, ...]:
        return tuple(unit for _, unit in self._places)


def _made(silent: Masks, rows: Times, carriers: _Carriers, properties: _Properties, octets: Octets) -> ReadingColumns:
    """The readings of the exchanges at `rows`."""
    if not len(rows):
        return ReadingColumns.nothing(silent)
    raws, numbers = properties.numbers()
    is_real = properties.tag >> 4 == _REAL
    _, examples, kind = np.unique(properties.kinds(), return_index=True, return_inverse=True)
    spaces, parts, phrases = _Texts(), _Texts(), _Texts()
    called: list[tuple[bool, int, int, int]] = []
    for place in examples.tolist():
        readings = carriers.told(place, octets)
        number = float(numbers[place]) if is_real[place] else int(numbers[place])
        if [(one.raw, one.value) for one in readings] != [(int(raws[place]), number)]:
            called.append((False, 0, 0, 0))
            continue
        (one,) = readings
        called.append((True, spaces.place(one.space), parts.place(one.part), phrases.place(one.words, one.unit)))
    known, space, part, words = np.array(called, np.int32)[kind].T
    kept = known == 1
    done, exchange = silent.copy(), rows[kept]
    done[exchange] = True
    reads = carriers.reads[kept]
    station = octets[carriers.offset[kept] + np.where(reads, _SOURCE, _DESTINATION)].astype(np.int32)
    return ReadingColumns(
        done,
        exchange,
        space[kept].astype(np.uint16),
        (properties.object[kept] & UNSPECIFIED_INSTANCE).astype(np.int32),
        raws[kept],
        np.where(reads, _READ, _WRITE).astype(np.uint8),
        spaces.all(),
        ToldValues(
            numbers[kept], ~is_real[kept], part[kept], words[kept], station, parts.all(), phrases.all(), phrases.units()
        ),
    )
