"""What Modbus exchanges tell: coils, inputs and registers with their values. Addresses as on the wire."""

from __future__ import annotations

from dissectors.frame import Frame
from dissectors.modbus.adu import adu
from dissectors.modbus.functions import EXCEPTION_BIT
from dissectors.readings import How, Reading

_READS = {0x01: "coil", 0x02: "discrete", 0x03: "holding", 0x04: "input"}
_COIL_ON, _COIL_OFF = 0xFF00, 0x0000
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
    code = asked[1]
    if code in (0x01, 0x02):
        return _bits(_READS[code], _word(asked, 2), _word(asked, 4), answer[3 : 3 + answer[2]] if answer[2:] else b"")
    if code in (0x03, 0x04, 0x17):
        count, octets = _word(asked, 4), answer[3:]
        if len(octets) < 2 * count or not answer[2:] or answer[2] != 2 * count:
            return ()
        read = _registers(_READS.get(code, "holding"), _word(asked, 2), octets[: 2 * count], How.READ)
        return (*_written(asked), *read)
    return _written(asked)


def refusal(frame: Frame) -> tuple[str, int] | None:
    """The exception code of a response; None of any other frame."""
    octets = adu(frame)
    return ("modbus", octets[2]) if len(octets) > 2 and octets[1] & EXCEPTION_BIT else None


def _written(octets: bytes) -> tuple[Reading, ...]:
    """What a request writes; nothing for one that does not, or whose counts contradict each other."""
    code = octets[1]
    if code == 0x05:
        value = _word(octets, 4)
        known = value in (_COIL_ON, _COIL_OFF)
        return (Reading("coil", _word(octets, 2), value, int(value == _COIL_ON), How.WRITE),) if known else ()
    if code == 0x06:
        return _registers("holding", _word(octets, 2), octets[4:6], How.WRITE)
    if code == 0x0F and len(octets) > 7:
        return _bits("coil", _word(octets, 2), _word(octets, 4), octets[7 : 7 + octets[6]], How.WRITE)
    if code in (0x10, 0x17):
        at = 2 if code == 0x10 else 6
        data = octets[at + 5 :]
        if len(octets) > at + 4 and len(data) == octets[at + 4] == 2 * _word(octets, at + 2):
            return _registers("holding", _word(octets, at), data, How.WRITE)
    return ()


def _registers(space: str, first: int, octets: bytes, how: How) -> tuple[Reading, ...]:
    values = (_word(octets, at) for at in range(0, len(octets) - 1, 2))
    return tuple(Reading(space, first + step & 0xFFFF, value, value, how) for step, value in enumerate(values))


def _bits(space: str, first: int, count: int, octets: bytes, how: How = How.READ) -> tuple[Reading, ...]:
    if len(octets) != (count + 7) // 8:
        return ()
    values = (octets[step >> 3] >> (step & 7) & 1 for step in range(count))
    return tuple(Reading(space, first + step & 0xFFFF, value, value, how) for step, value in enumerate(values))


def _word(octets: bytes, at: int) -> int:
    return octets[at] << 8 | octets[at + 1]
