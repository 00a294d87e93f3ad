"""Lengths that function codes predict, and how well formed frames look, for many places of a capture at once.

The same as `candidates.readings` and `candidates.octet_bits`, which say what each thing means; a property test holds
both equal. Places are those of first octets; `octets` has at least PADDING octets behind the last that counts.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from dissectors.modbus.candidates import HIGH_UNIT, ODD_BROADCAST, SHORT_FRAME, UNKNOWN_CODE, VENDOR_CODE
from dissectors.modbus.functions import (
    BROADCAST,
    EXCEPTION_BIT,
    EXCEPTION_LENGTH,
    EXCEPTIONS,
    FUNCTIONS,
    IMPLAUSIBLE,
    MAX_FIFO,
    MAX_FRAME,
    MAX_READ_BITS,
    MAX_READ_REGISTERS,
    MAX_READ_WRITE_REGISTERS,
    MAX_UNIT,
    MAX_WRITE_BITS,
    MAX_WRITE_REGISTERS,
    MEI_DEVICE_IDENTIFICATION,
    MORE,
    NEVER,
    VENDOR_EXCEPTIONS,
    response_length,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy.typing as npt

    from dissectors.columns import Codes, Masks, Octets, Times

    Bits = npt.NDArray[np.int16]
    Lengths = npt.NDArray[np.int16]

PADDING: Final = 16

RARE: Final = -100
"""Bits of frames whose shape is not weighed here."""

NOT_WEIGHED: Final = RARE // 2

_FIXED_REQUESTS: Final = {
    **dict.fromkeys((0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x08), 8),
    **dict.fromkeys((0x07, 0x0B, 0x0C, 0x11), 4),
    0x16: 10,
    0x18: 6,
}
_FIXED_RESPONSES: Final = {
    **dict.fromkeys((0x05, 0x06, 0x08, 0x0B, 0x0F, 0x10), 8),
    0x07: 5,
    0x16: 10,
}
_COUNTED_REQUESTS: Final = {0x0F: (6, 1), 0x10: (6, 2), 0x14: (2, 7), 0x15: (2, 9), 0x17: (10, 2)}
_COUNTED_RESPONSES: Final = {
    **dict.fromkeys((0x01, 0x02, 0x03, 0x04, 0x17, 0x11), (2, 1)),
    0x0C: (2, 6),
    0x14: (2, 2),
    0x15: (2, 9),
}
"""By function: where the byte count stands, and the least that it may say."""

COMMON: Final = frozenset((0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x0F, 0x10, 0x17))
"""Functions whose shapes are weighed here; to them come exceptions."""


class _Direction(NamedTuple):
    """By code: octets beside what is counted (or NEVER); where the count stands (0: none); what of it counts (a mask);
    the least that it may say."""

    fixed: Lengths
    at: Codes
    mask: Codes
    least: Codes

    def lengths(self, octets: Octets, places: Times, codes: Codes, room: Times) -> Lengths:
        at = self.at[codes]
        count = octets[places + at] & self.mask[codes]
        length = self.fixed[codes] + count
        length[(count < self.least[codes]) | (length > MAX_FRAME)] = NEVER
        length[(at >= room) & (at > 0)] = MORE
        told: Lengths = length
        return told


def _direction(fixed: Mapping[int, int], counted: Mapping[int, tuple[int, int]]) -> _Direction:
    told = _Direction(np.full(256, NEVER, np.int16), *(np.zeros(256, np.uint8) for _ in range(3)))
    for code, length in fixed.items():
        told.fixed[code] = length
    for code, (at, least) in counted.items():
        told.fixed[code], told.at[code], told.mask[code], told.least[code] = at + 3, at, 0xFF, least
    return told


@lru_cache(maxsize=1)
def _directions() -> tuple[_Direction, _Direction]:
    requests = _direction(_FIXED_REQUESTS, _COUNTED_REQUESTS)
    responses = _direction(_FIXED_RESPONSES, _COUNTED_RESPONSES)
    for code in FUNCTIONS:
        responses.fixed[code | EXCEPTION_BIT] = EXCEPTION_LENGTH
    return requests, responses


def of_codes(codes: frozenset[int], exceptions: bool) -> Masks:
    """bool[256]: which function octets are one of these, or an exception to a known one."""
    table = np.zeros(256, bool)
    table[sorted(codes)] = True
    if exceptions:
        table[[code | EXCEPTION_BIT for code in FUNCTIONS]] = True
    return table


@lru_cache(maxsize=1)
def predicting() -> Masks:
    """bool[256]: function octets that predict a length."""
    return of_codes(frozenset(FUNCTIONS), True)


@lru_cache(maxsize=1)
def common() -> Masks:
    """bool[256]: function octets whose shapes are weighed here."""
    return of_codes(COMMON, True)


def lengths(octets: Octets, places: Times, codes: Codes, room: Times) -> tuple[Lengths, Lengths]:
    """Octets of the request, of the response that begins at each place, or MORE, or NEVER.

    `codes`: the function octets there. `room`: octets there are from each place on (2 or more).
    """
    request, response = (direction.lengths(octets, places, codes, room) for direction in _directions())
    _of_queues(octets, places, codes, room, response)
    _of_interfaces(octets, places, codes, room, request, response)
    return request, response


def _of_queues(octets: Octets, places: Times, codes: Codes, room: Times, response: Lengths) -> None:
    """Function 24 counts in two octets."""
    at = np.flatnonzero(codes == 0x18)
    count = _word(octets, places[at], 2)
    length = np.where((count >= 2) & (count <= 2 + 2 * MAX_FIFO), 6 + count, NEVER)
    response[at] = np.where(room[at] > 3, length, MORE)


def _of_interfaces(
    octets: Octets, places: Times, codes: Codes, room: Times, request: Lengths, response: Lengths
) -> None:
    """Function 43 with device identification, whose answer must be walked."""
    at = np.flatnonzero(codes == 0x2B)
    identifies = octets[places[at] + 2] == MEI_DEVICE_IDENTIFICATION
    told = room[at] > 2
    request[at] = np.where(told, np.where(identifies, 7, NEVER), MORE)
    response[at] = np.where(told, NEVER, MORE)
    for which in at[identifies & told].tolist():
        place = int(places[which])
        response[which] = response_length(octets[place : place + min(int(room[which]), MAX_FRAME)].tobytes())


# --- shapes ----------------------------------------------------------------------------------------------------------


@lru_cache(maxsize=1)
def _exception_bits() -> Bits:
    bits = np.full(256, SHORT_FRAME + UNKNOWN_CODE, np.int16)
    bits[sorted(VENDOR_EXCEPTIONS)] = SHORT_FRAME + VENDOR_CODE
    bits[sorted(EXCEPTIONS)] = SHORT_FRAME
    return bits


_MOST_BY_CODE: Final = {
    0x01: (MAX_READ_BITS, 5),
    0x02: (MAX_READ_BITS, 5),
    0x03: (MAX_READ_REGISTERS, 9),
    0x04: (MAX_READ_REGISTERS, 9),
}
_MOST_WRITTEN: Final = {0x0F: (MAX_WRITE_BITS, 5), 0x10: (MAX_WRITE_REGISTERS, 9)}
_TOLD: Final = 12


def shapes(octets: Octets, places: Times, codes: Codes) -> tuple[Bits, Bits]:
    """Evidence of the octets as a request, as a response, all of them there; RARE where it is not weighed here.

    As in `octet_bits`, less what a station above 247 costs.
    """
    request, response = np.full(len(places), RARE, np.int16), np.full(len(places), RARE, np.int16)
    units = octets[places]
    quantity = _word(octets, places, 4)
    third = octets[places + 2]
    for code in np.flatnonzero(np.bincount(codes, minlength=256)).tolist():
        at = np.flatnonzero(codes == code)
        if code & EXCEPTION_BIT:
            response[at] = _exception_bits()[third[at]]
        elif code in _MOST_BY_CODE:
            most, bits = _MOST_BY_CODE[code]
            request[at] = _within(quantity[at], most, bits)
            response[at] = 0 if code <= 0x02 else np.where(third[at] & 1, IMPLAUSIBLE, 1)
        elif code == 0x05:
            value = quantity[at]
            request[at] = response[at] = np.where((value == 0) | (value == 0xFF00), _TOLD, IMPLAUSIBLE)
        elif code == 0x06:
            request[at] = response[at] = 0
        elif code in _MOST_WRITTEN:
            most, bits = _MOST_WRITTEN[code]
            written = quantity[at]
            response[at] = _within(written, most, bits)
            needed = (written + 7) // 8 if code == 0x0F else 2 * written
            request[at] = _told((response[at] > 0) & (octets[places[at] + 6] == needed))
        elif code == 0x17:
            written = _word(octets, places[at], 8)
            fits = (_within(quantity[at], MAX_READ_REGISTERS, 1) > 0) & (octets[places[at] + 10] == 2 * written)
            request[at] = _told(fits & (_within(written, MAX_READ_WRITE_REGISTERS, 1) > 0))
            response[at] = np.where(third[at] & 1, IMPLAUSIBLE, 1)
    writes = _writes()[codes]
    to_all = units == BROADCAST
    request[to_all & ~writes] += ODD_BROADCAST
    response[to_all] += ODD_BROADCAST
    return request, response


def frame_bits(octets: Octets, places: Times, request: Masks, response: Masks) -> Bits:
    """As `octet_bits`, of frames that the directions `request`, `response` may have; below NOT_WEIGHED of others."""
    as_request, as_response = shapes(octets, places, octets[places + 1])
    best = np.maximum(np.where(request, as_request, RARE), np.where(response, as_response, RARE))
    bits: Bits = best + unit_bits(octets[places])
    return bits


def unit_bits(units: Codes) -> Bits:
    """Evidence in the address."""
    return np.where(units > MAX_UNIT, HIGH_UNIT, 0).astype(np.int16)


@lru_cache(maxsize=1)
def _writes() -> Masks:
    return of_codes(frozenset(code for code, function in FUNCTIONS.items() if function.writes), False)


def _word(octets: Octets, places: Times, at: int) -> npt.NDArray[np.int32]:
    return octets[places + at].astype(np.int32) << 8 | octets[places + (at + 1)]


def _within(quantity: npt.NDArray[np.int32], most: int, bits: int) -> Bits:
    return np.where((quantity >= 1) & (quantity <= most), bits, IMPLAUSIBLE).astype(np.int16)


def _told(fits: Masks) -> Bits:
    return np.where(fits, _TOLD, 2 * IMPLAUSIBLE).astype(np.int16)


def answer_lengths(octets: Octets, places: Times, codes: Codes) -> Lengths:
    """Octets of the normal answer to requests of COMMON functions; NEVER of others."""
    answers = np.full(len(places), NEVER, np.int16)
    quantity = _word(octets, places, 4)
    bits = codes <= 0x02
    reads = bits | (codes == 0x03) | (codes == 0x04) | (codes == 0x17)
    counted = np.where(bits, (quantity + 7) // 8, 2 * quantity)
    answers[reads] = np.minimum(5 + counted[reads], np.iinfo(np.int16).max)
    answers[(codes == 0x05) | (codes == 0x06) | (codes == 0x0F) | (codes == 0x10)] = 8
    return answers
