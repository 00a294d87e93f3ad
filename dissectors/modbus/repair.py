"""Repairs of damaged RTU frames: one thing at one of the ends went wrong, and the check proves it.

A fault that is always the same (a driver that switches late or too early, a CRC sent high octet first) leaves frames
that are good but for it. Put it right, and see whether the check agrees:

    check octets swapped        all 16 bits of the check agree
    first octet missing/spoilt  with the station that was asked, or one that good frames named, all 16 bits agree
    last octet missing/spoilt   8 bits of the check are left: the length must be right, too, and the octets must answer
                                the open request, or be a request that was made before
    last two octets missing     none is left: the same, and nothing but the check may be missing
                                (where nobody was ever heard well: a request that is well formed)

What merely could be put right is not told. By chance one damaged frame in 65536 would have one of the first three
flaws; but one in 256 with a wrong check seems to have only its last octet spoilt, and any frame that lost two octets
somewhere to lack its check. So an answer with one of those must follow another of that station with the same flaw.
"""

from __future__ import annotations

from collections.abc import Set
from functools import lru_cache
from typing import Final

from dissectors.checksums import crc16_modbus
from dissectors.frame import Flaw, Repair
from dissectors.modbus.candidates import octet_bits, readings
from dissectors.modbus.functions import EXCEPTION_BIT, FUNCTIONS, ITEMS_ASKED, MAX_UNIT, is_open_length
from dissectors.modbus.lengths import MAX_FRAME, MIN_FRAME
from dissectors.modbus.open_request import Expected
from dissectors.modbus.past import Past
from dissectors.modbus.ranges import RANGES_REPEATED
from dissectors.modbus.shapes import IMPLAUSIBLE

_SHORTEST: Final = MIN_FRAME + 1
"""Octets of the shortest frame that is put right: of fewer, too little agrees beside the check."""

_BY_HABIT: Final = frozenset({Flaw.LAST_SPOILT, Flaw.LAST_TWO_MISSING})
_WELL_FORMED: Final = 5
"""Bits that tell a request whose counts are right from octets that merely could be one."""


def repaired(octets: bytes, expected: Expected | None, past: Past, heard: Set[int]) -> Repair | None:
    """What a stretch without a good CRC was, if one thing happened to it; None where nothing proves it. Total.

    `expected`: the open request. `past`: what was said before. `heard`: the stations that good frames named.
    """
    if not MIN_FRAME - 1 <= len(octets) <= MAX_FRAME:
        return None
    repair = (
        _swapped(octets, expected, heard)
        or _without_first(octets, expected, heard)
        or _without_last(octets, expected, past, heard)
        or _last_spoilt(octets, expected, past)
    )
    if repair is None or repair.flaw not in _BY_HABIT or past.has_asked(repair.octets):
        return repair
    return repair if past.is_habit(repair.octets[0], repair.flaw) else None


def _sealed(body: bytes) -> bytes:
    return body + crc16_modbus(body).to_bytes(2, "little")


def _swapped(octets: bytes, expected: Expected | None, heard: Set[int]) -> Repair | None:
    if len(octets) < _SHORTEST or octets[-1] == octets[-2]:
        return None
    whole = octets[:-2] + octets[:-3:-1]
    known = _is_known(whole[0], expected, heard) or (not heard and whole[0] <= MAX_UNIT)  # since all have that flaw
    if crc16_modbus(whole) or not known or not _is_formed(whole, expected):
        return None
    return Repair(Flaw.CHECK_SWAPPED, whole)


def _without_first(octets: bytes, expected: Expected | None, heard: Set[int]) -> Repair | None:
    """The first octet is lost, or another one stands in its place: which station makes the check agree?"""
    for flaw, rest in ((Flaw.FIRST_MISSING, octets), (Flaw.FIRST_SPOILT, octets[1:])):
        if len(rest) + 1 < _SHORTEST:
            continue
        unit = _stations(len(rest)).get(crc16_modbus(b"\0" + rest))
        if unit is None:
            continue
        whole = bytes((unit,)) + rest
        known = _is_known(unit, expected, heard) or (flaw is Flaw.FIRST_MISSING and _may_be_first(whole, heard))
        if known and _is_formed(whole, expected):
            return Repair(flaw, whole)
    return None


def _without_last(octets: bytes, expected: Expected | None, past: Past, heard: Set[int]) -> Repair | None:
    for flaw, body, check in (
        (Flaw.LAST_MISSING, octets[:-1], octets[-1:]),
        (Flaw.LAST_TWO_MISSING, octets, b""),
    ):
        if len(body) + 2 < _SHORTEST:
            continue
        whole = _sealed(body)
        if whole[len(body) : len(body) + len(check)] != check:
            continue
        if _may_be_first(whole, heard):
            return Repair(flaw, whole)
        if _is_proved(whole, expected, past) and (check or _says_its_length(whole, expected, past)):
            return Repair(flaw, whole)
    return None


def _last_spoilt(octets: bytes, expected: Expected | None, past: Past) -> Repair | None:
    if len(octets) < _SHORTEST:
        return None
    whole = _sealed(octets[:-2])
    if whole[:-1] != octets[:-1] or not _is_proved(whole, expected, past):
        return None
    return Repair(Flaw.LAST_SPOILT, whole)


# --- what proves it ---------------------------------------------------------------------------------------------------


@lru_cache(maxsize=MAX_FRAME)
def _stations(count: int) -> dict[int, int]:
    """Which station before `count` octets makes their CRC good, by the CRC that they have behind a station 0.

    A CRC is linear: whatever the octets are, another station in front of them changes it in the same way.
    """
    rest = bytes(count)
    zero = crc16_modbus(b"\0" + rest)
    return {crc16_modbus(bytes((unit,)) + rest) ^ zero: unit for unit in range(1, 256)}


def _is_well_formed_request(whole: bytes) -> bool:
    return any(
        reading.request and reading.length == len(whole) and octet_bits(whole, 0, reading) >= _WELL_FORMED
        for reading in readings(whole, 0, len(whole))
    )


def _may_be_first(whole: bytes, heard: Set[int]) -> bool:
    """Whether it may be a request where nobody was ever heard, since all have that flaw."""
    return not heard and whole[0] <= MAX_UNIT and _is_well_formed_request(whole)


def _is_known(unit: int, expected: Expected | None, heard: Set[int]) -> bool:
    return unit in heard or (expected is not None and expected.unit == unit)


def _is_formed(whole: bytes, expected: Expected | None) -> bool:
    """Whether a frame has a length that its function predicts, and nothing in it contradicts that.

    Where nothing predicts a length, it must be the function that was asked.
    """
    if is_open_length(whole):
        return expected is not None and expected.is_for(whole, 0)
    if whole[1] & ~EXCEPTION_BIT not in FUNCTIONS:
        return False
    return any(
        reading.length == len(whole) and octet_bits(whole, 0, reading) > IMPLAUSIBLE
        for reading in readings(whole, 0, len(whole))
    )


def _is_proved(whole: bytes, expected: Expected | None, past: Past) -> bool:
    """Whether a frame answers the open request at the right length, or is a request that was made before."""
    if past.has_asked(whole):
        return True
    if expected is None or not expected.is_for(whole, 0) or not 0 < whole[0] <= MAX_UNIT:
        return False
    if whole[1] & EXCEPTION_BIT:
        return _is_formed(whole, expected)
    return len(whole) == expected.length and _is_formed(whole, expected)


def _says_its_length(whole: bytes, expected: Expected | None, past: Past) -> bool:
    """Whether the octets of a frame that is proved so far say themselves where they end: by a byte count that is right
    for the request, or by what they repeat of it."""
    if past.has_asked(whole):
        return True
    if expected is None or whole[1] & EXCEPTION_BIT:
        return False
    if whole[1] in ITEMS_ASKED:
        return True
    asked = expected.octets
    return whole[2:6] == asked[2:6] if whole[1] in RANGES_REPEATED else whole == asked
