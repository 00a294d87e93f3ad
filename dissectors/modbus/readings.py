"""Readings of Modbus exchanges: coils, inputs and registers with their values. Addresses as on the wire."""

from __future__ import annotations

from collections.abc import Collection

from dissectors.frame import Frame
from dissectors.modbus.envelope import adu
from dissectors.modbus.functions import EXCEPTION_BIT, ITEMS_ASKED
from dissectors.modbus.layout import MESSAGES
from dissectors.modbus.notation import Means, first, last
from dissectors.modbus.ranges import AGREEMENTS
from dissectors.readings import Origin, Reading

_COIL_ON = 0xFF00
_MOST_ASKED = 2000  # the standard's limit for bits
_HEAD = 6  # unit, function, two words


def readings(request: Frame | None, response: Frame | None) -> tuple[Reading, ...]:
    """See `dissectors.readings.Readings`. A response without its request has values, but nobody knows whose."""
    if request is None or not request.ok:
        return ()
    asked = adu(request)
    if len(asked) < _HEAD:
        return ()
    if response is None:
        return _written(asked)
    answer = adu(response) if response.ok else b""
    if len(answer) < 2 or answer[:2] != asked[:2] or answer[1] & EXCEPTION_BIT:
        return ()
    if asked[1] not in ITEMS_ASKED:
        return _written(asked)
    at, bits = ITEMS_ASKED[asked[1]]
    space, begin, count = MESSAGES[asked[1]].space, _word(asked, at - 2), _word(asked, at)
    octets = answer[3:]
    if not answer[2:] or len(octets) != answer[2]:  # as long as it says itself, or nobody knows which octet is which
        return ()
    if bits == 1:
        return _bits(space, begin, count, octets)
    return (*_written(asked), *_registers(space, begin, octets, Origin.READ)) if len(octets) == 2 * count else ()


def asks(frame: Frame) -> tuple[Reading, ...]:
    """See `dissectors.readings.Asks`."""
    octets = adu(frame) if frame.ok else b""
    if len(octets) < _HEAD or octets[1] not in ITEMS_ASKED:
        return ()
    at, _ = ITEMS_ASKED[octets[1]]
    space, begin, count = MESSAGES[octets[1]].space, _word(octets, at - 2), min(_word(octets, at), _MOST_ASKED)
    return tuple(Reading(space, begin + step & 0xFFFF, None, "", Origin.READ) for step in range(count))


def refusal(frame: Frame) -> tuple[str, int] | None:
    """The exception code of a response; None of any other frame."""
    octets = adu(frame)
    return ("modbus", octets[2]) if len(octets) > 2 and octets[1] & EXCEPTION_BIT else None


def _written(octets: bytes) -> tuple[Reading, ...]:
    """What a request writes; nothing for one that does not, or whose counts contradict each other."""
    code = octets[1]
    if code in _SINGLE:
        return _single(octets, *_SINGLE[code])
    agreement = AGREEMENTS.get(code)
    if agreement is None or len(octets) <= agreement.count_at:
        return ()
    space, begin = MESSAGES[code].space, _word(octets, agreement.quantity_at - 2)
    quantity, count = _word(octets, agreement.quantity_at), octets[agreement.count_at]
    data = octets[agreement.count_at + 1 :]
    if agreement.bits == 1:
        return _bits(space, begin, quantity, data[:count], Origin.WRITE)
    return _registers(space, begin, data, Origin.WRITE) if len(data) == count == 2 * quantity else ()


_SINGLE = {
    code: (messages.space, address.at, value.at, value.field.among)
    for code, messages in MESSAGES.items()
    if messages.writes
    and (address := first(messages.request, Means.ADDRESS)) is not None
    and (value := last(messages.request, Means.VALUE)) is not None
}
"""Of writes of one value: space, where address and value stand, what the value may be (None: anything)."""


def _single(octets: bytes, space: str, at: int, value_at: int, among: Collection[int] | None) -> tuple[Reading, ...]:
    if among is None:
        return _registers(space, _word(octets, at), octets[value_at : value_at + 2], Origin.WRITE)
    value = _word(octets, value_at)
    return (Reading(space, _word(octets, at), value, int(value == _COIL_ON), Origin.WRITE),) if value in among else ()


def _registers(space: str, first: int, octets: bytes, how: Origin) -> tuple[Reading, ...]:
    values = (_word(octets, at) for at in range(0, len(octets) - 1, 2))
    return tuple(Reading(space, first + step & 0xFFFF, value, value, how) for step, value in enumerate(values))


def _bits(space: str, first: int, count: int, octets: bytes, how: Origin = Origin.READ) -> tuple[Reading, ...]:
    if len(octets) != (count + 7) // 8:
        return ()
    values = (octets[step >> 3] >> (step & 7) & 1 for step in range(count))
    return tuple(Reading(space, first + step & 0xFFFF, value, value, how) for step, value in enumerate(values))


def _word(octets: bytes, at: int) -> int:
    return octets[at] << 8 | octets[at + 1]
