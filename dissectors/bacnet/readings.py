"""Readings of BACnet exchanges: properties with their values. Reads, writes and changes of value. A message in
segments tells it with its last one."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import Any

from dissectors.bacnet import message as messages
from dissectors.bacnet import names
from dissectors.bacnet.apdu import PduType
from dissectors.bacnet.dates import Date, Time
from dissectors.bacnet.fixed_units import unit_held
from dissectors.bacnet.frame_types import HEADER
from dissectors.bacnet.message import Message
from dissectors.bacnet.values import BitString, ConstructedValue, Double, Enumerated, ObjectId, show
from dissectors.frame import Frame
from dissectors.readings import Origin, Reading
from dissectors.single_reals import shortest

PRESENT_VALUE = 85
READ_PROPERTY, _READ_MULTIPLE, WRITE_PROPERTY, _WRITE_MULTIPLE = 12, 14, 15, 16
_CONFIRMED_COV, _UNCONFIRMED_COV = 1, 2
_CONFIRMED_COV_MULTIPLE, _UNCONFIRMED_COV_MULTIPLE = 31, 11


def readings(request: Frame | None, response: Frame | None) -> tuple[Reading, ...]:
    """See `dissectors.readings.Readings`."""
    if request is None or not request.ok or len(request.octets) <= HEADER:  # tokens and polls carry nothing
        return ()
    asked = messages.read(request)
    if asked is None or asked.apdu is None:
        return ()
    if response is None:
        return tuple(told(asked))
    answer = messages.read(response) if response.ok else None
    if answer is None or answer.apdu is None:
        return ()
    if answer.apdu.type == PduType.SIMPLE_ACK:
        return tuple(told(asked))
    if answer.apdu.type == PduType.COMPLEX_ACK:
        return tuple(told(answer))
    return ()


def asks(frame: Frame) -> tuple[Reading, ...]:
    """See `dissectors.readings.Asks`."""
    message = messages.read(frame) if frame.ok and len(frame.octets) > HEADER else None
    spoken = message.spoken() if message is not None else None
    if message is None or spoken is None or spoken[0].type != PduType.CONFIRMED_REQUEST:
        return ()
    apdu, parameters = spoken
    if apdu.service not in (READ_PROPERTY, _READ_MULTIPLE):
        return ()
    decoded = messages.decode_parameters(apdu, parameters)
    if decoded is None or decoded.error is not None:
        return ()
    return tuple(_asked(decoded.record, message.destination))


def _asked(record: ConstructedValue, station: int) -> Iterator[Reading]:
    specs = record.get("list-of-read-access-specs")
    if specs is None:
        pairs = [(record.get("object-identifier"), record)]
    else:
        pairs = [(spec["object-identifier"], one) for spec in specs for one in spec["list-of-property-references"]]
    for thing, one in pairs:
        if isinstance(thing, ObjectId):
            part = _part_of(one, one.get("property-array-index"))
            yield Reading(thing.kind, thing.instance, None, "", Origin.READ, part, station=station)


def _part_of(record: ConstructedValue, index: int | None) -> str:
    which = record["property-identifier"]
    return "" if which.value == PRESENT_VALUE else str(which) + (f".{index}" if index is not None else "")


def told(message: Message) -> Iterator[Reading]:
    """What one frame tells by itself; total: a parameter that is not there ends it."""
    spoken = message.spoken()
    if spoken is None:
        return
    apdu, parameters = spoken
    tell = _TELLERS.get((apdu.type, apdu.service or 0))
    if tell is None:
        return
    decoded = messages.decode_parameters(apdu, parameters)
    if decoded is None or decoded.error is not None:
        return
    whose = message.destination if apdu.service in (WRITE_PROPERTY, _WRITE_MULTIPLE) else message.source
    try:
        for thing, record, value, how in tell(decoded.record):
            for index, part in _parts(record, value):
                reading = _reading(thing, record, index, part, how, whose)
                if reading is not None:
                    yield reading
    except (KeyError, TypeError, ValueError, AttributeError):
        return


Item = tuple[ObjectId, ConstructedValue, Any, Origin]


def _property(how: Origin) -> Any:
    def tell(record: ConstructedValue) -> Iterator[Item]:
        yield record["object-identifier"], record, record["property-value"], how

    return tell


def _read_multiple(record: ConstructedValue) -> Iterator[Item]:
    for result in record["list-of-read-access-results"]:
        for item in result.get("list-of-results", ()):
            ((kind, value),) = item["read-result"].entries
            if kind == "property-value":
                yield result["object-identifier"], item, value, Origin.READ


def _write_multiple(record: ConstructedValue) -> Iterator[Item]:
    for spec in record["list-of-write-access-specs"]:
        for item in spec["list-of-properties"]:
            yield spec["object-identifier"], item, item["value"], Origin.WRITE


def _change(record: ConstructedValue) -> Iterator[Item]:
    for item in record["list-of-values"]:
        yield record["monitored-object-identifier"], item, item["value"], Origin.REPORT


def _changes(record: ConstructedValue) -> Iterator[Item]:
    for notification in record["list-of-cov-notifications"]:
        yield from _change(notification)


_TELLERS: dict[tuple[int, int], Any] = {
    (PduType.COMPLEX_ACK, READ_PROPERTY): _property(Origin.READ),
    (PduType.COMPLEX_ACK, _READ_MULTIPLE): _read_multiple,
    (PduType.CONFIRMED_REQUEST, WRITE_PROPERTY): _property(Origin.WRITE),
    (PduType.CONFIRMED_REQUEST, _WRITE_MULTIPLE): _write_multiple,
    (PduType.CONFIRMED_REQUEST, _CONFIRMED_COV): _change,
    (PduType.UNCONFIRMED_REQUEST, _UNCONFIRMED_COV): _change,
    (PduType.CONFIRMED_REQUEST, _CONFIRMED_COV_MULTIPLE): _changes,
    (PduType.UNCONFIRMED_REQUEST, _UNCONFIRMED_COV_MULTIPLE): _changes,
}

TELLING = frozenset(_TELLERS)
"""What may tell something: (PDU type, service)."""


_ARRAYS = frozenset(
    names.number("PropertyIdentifier", name)
    for name in ("event-message-texts", "object-list", "priority-array", "property-list", "state-text")
)
"""Arrays whose elements are values by themselves: read at once they tell the same as read one by one."""


def _parts(record: ConstructedValue, value: Any) -> Iterator[tuple[int | None, Any]]:
    """The value with its array index; each element of an array that came as a whole."""
    index = record.get("property-array-index")
    if index is None and isinstance(value, tuple) and record["property-identifier"].value in _ARRAYS:
        for place, element in enumerate(value, 1):
            chosen = (
                element.entries[0][1]
                if isinstance(element, ConstructedValue) and len(element.entries) == 1
                else element
            )
            yield place, chosen
    else:
        yield index, value


def _reading(
    thing: ObjectId, record: ConstructedValue, index: int | None, value: Any, how: Origin, station: int | None
) -> Reading | None:
    part = _part_of(record, index)
    raw, shown = _shown(value)
    if shown is None:
        return None
    unit = unit_held(record["property-identifier"].value, index, value)
    return Reading(
        thing.kind, thing.instance, raw, shown, how, part, station=station, words=_words(value, shown), unit=unit
    )


def _shown(value: Any) -> tuple[int | None, int | float | str | None]:
    """A value as (bits, number or text)."""
    if isinstance(value, Enumerated):
        return value.value, value.value
    if isinstance(value, bool | int):
        return int(value) & 0xFFFF_FFFF_FFFF_FFFF, int(value)
    if isinstance(value, Double):
        return int.from_bytes(struct.pack(">d", value), "big"), float(value)
    if isinstance(value, float):
        return int.from_bytes(struct.pack(">f", value), "big"), shortest(value)
    if isinstance(value, str):
        return None, value
    if isinstance(value, BitString | ObjectId | Date | Time):
        return None, show(value)
    return None, None


def _words(value: Any, shown: int | float | str) -> str:
    """The value as the standard names it: "hertz", "2024-04-05 Thursday (it is a Friday)"; empty for plain numbers and
    for texts of the device."""
    if isinstance(value, Enumerated):
        words = show(value)
        return "" if words.endswith(str(value.value)) else words
    return shown if isinstance(shown, str) and not isinstance(value, str) else ""
