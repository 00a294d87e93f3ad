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
    ITEMS_ASKED,
    MAX_UNIT,
    VENDOR_EXCEPTIONS,
    response_length,
)
from dissectors.modbus.layout import MESSAGES
from dissectors.modbus.lengths import MAX_FRAME, MORE, NEVER, most_of
from dissectors.modbus.notation import CHECK, HEAD, FieldPlace, Means, Message, counted, fixed_length
from dissectors.modbus.notation import places as places_of
from dissectors.modbus.shapes import held, told

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    import numpy.typing as npt

    from dissectors.columns import Codes, Masks, Numbers, Octets, Times

    Bits = npt.NDArray[np.int16]
    Lengths = npt.NDArray[np.int16]

PADDING: Final = 16

RARE: Final = -100
"""Bits of frames whose shape is not weighed here."""

NOT_WEIGHED: Final = RARE // 2

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


def _direction(messages: Mapping[int, Message]) -> _Direction:
    told = _Direction(np.full(256, NEVER, np.int16), *(np.zeros(256, np.uint8) for _ in range(3)))
    for code, message in messages.items():
        count, length = counted(message), fixed_length(message)
        if length is not None and not _selected(message):
            told.fixed[code] = length
        elif count is not None and count.count.field.size == 1:
            at = count.count.at
            told.fixed[code], told.at[code], told.mask[code], told.least[code] = (
                at + 3,
                at,
                0xFF,
                count.count.field.least,
            )
    return told


def _selected(message: Message) -> bool:
    """Whether it is laid out so for one value of a selector only."""
    return any(each.means is Means.SELECTOR and each.only is not None for each in message)


_REQUESTS: Final = {code: messages.request for code, messages in MESSAGES.items()}
_RESPONSES: Final = {code: messages.response for code, messages in MESSAGES.items()}


@lru_cache(maxsize=1)
def _directions() -> tuple[_Direction, _Direction]:
    requests, responses = _direction(_REQUESTS), _direction(_RESPONSES)
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
    """Answers that count in two octets."""
    for code, message in _RESPONSES.items():
        count = counted(message)
        if count is None or count.count.field.size != 2:
            continue
        at = np.flatnonzero(codes == code)
        there, end = _number(octets, places[at], count.count), count.count.at + 2
        length = np.where((there >= count.count.field.least) & (there <= most_of(count)), end + there + CHECK, NEVER)
        response[at] = np.where(room[at] >= end, length, MORE)


def _of_interfaces(
    octets: Octets, places: Times, codes: Codes, room: Times, request: Lengths, response: Lengths
) -> None:
    """Device identification, whose answer must be walked."""
    for code, message in _REQUESTS.items():
        if not _selected(message):
            continue
        at = np.flatnonzero(codes == code)
        selector = places_of(message)[0]
        identifies = octets[places[at] + selector.at] == selector.field.only
        told = room[at] > selector.at
        request[at] = np.where(told, np.where(identifies, fixed_length(message) or NEVER, NEVER), MORE)
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


def shapes(octets: Octets, places: Times, codes: Codes) -> tuple[Bits, Bits]:
    """Evidence of the octets as a request, as a response, all of them there; RARE where it is not weighed here.

    As in `octet_bits`, less what a station above 247 costs.
    """
    request, response = np.full(len(places), RARE, np.int16), np.full(len(places), RARE, np.int16)
    units = octets[places]
    third = octets[places + 2]
    for code in np.flatnonzero(np.bincount(codes, minlength=256)).tolist():
        at = np.flatnonzero(codes == code)
        if code & EXCEPTION_BIT:
            response[at] = _exception_bits()[third[at]]
        elif code in COMMON:
            request[at] = asked = _shapes(_REQUESTS[code], octets, places[at])
            same = _REQUESTS[code] == _RESPONSES[code]
            response[at] = asked if same else _shapes(_RESPONSES[code], octets, places[at])
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


def _shapes(message: Message, octets: Octets, places: Times) -> Bits:
    """As `shapes.shape_of`, of a message without groups."""
    bits, penalty = told(message)
    fits = [_among(_number(octets, places, place), values) for place, values in held(message)]
    count = counted(message)
    if count is not None and count.quantity is not None:
        needed = (_number(octets, places, count.quantity) * count.items.bits + 7 >> 3) + count.beside
        fits.append(octets[places + count.count.at] == needed)
    elif count is not None and count.items.means is Means.REGISTERS:
        fits.append(octets[places + count.count.at] & 1 == 0)
    if not fits:
        return np.full(len(places), bits, np.int16)
    kept = fits[0]
    for each in fits[1:]:
        kept &= each
    return np.where(kept, np.int16(bits), np.int16(penalty))


def _among(numbers: Numbers, values: Collection[int]) -> Masks:
    if isinstance(values, range):
        within: Masks = (numbers >= values.start) & (numbers < values.stop)
        return within
    return np.isin(numbers, tuple(values))


def _number(octets: Octets, places: Times, place: FieldPlace) -> Numbers:
    return _word(octets, places, place.at) if place.field.size == 2 else octets[places + place.at].astype(np.int32)


def answer_lengths(octets: Octets, places: Times, codes: Codes) -> Lengths:
    """Octets of the normal answer to requests of COMMON functions; NEVER of others."""
    answers = np.full(len(places), NEVER, np.int16)
    for code in np.flatnonzero(np.bincount(codes, minlength=256)).tolist():
        if code not in COMMON:
            continue
        at = np.flatnonzero(codes == code)
        asked, length = ITEMS_ASKED.get(code), fixed_length(_RESPONSES[code])
        if asked is not None:
            counted_octets = _word(octets, places[at], asked[0]) * asked[1] + 7 >> 3
            answers[at] = np.minimum(HEAD + 1 + counted_octets + CHECK, np.iinfo(np.int16).max)
        elif length is not None:
            answers[at] = length
    return answers
