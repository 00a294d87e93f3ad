"""The checks of many MS/TP frames at once: header CRC-8, data CRC-16, and the CRC-32K of encoded data.

All three are linear: what two octets do to a CRC of 16 bits or less is one look-up in a table of 65,536. Bodies are
taken longest first, so that those still under way are always the first ones of the arrays.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from dissectors.bacnet.cobs import CRC_SIZE, MASK
from dissectors.checksums import crc8_mstp, crc16_x25, crc32k

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy.typing as npt

    from dissectors.columns import Masks, Octets, Times

_ALL_ONES = 0xFFFF


def _of_one(crc: Callable[[bytes], int], zeros: int, kind: npt.DTypeLike) -> npt.NDArray[Any]:
    """What each octet, followed by so many zeros, does to the CRC of zeros."""
    nothing = crc(bytes(zeros + 1))
    return np.array([crc(bytes((octet,)) + bytes(zeros)) ^ nothing for octet in range(256)], kind)


def _of_two(first: npt.NDArray[Any], second: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """The table of two octets, the first one low, from those of each."""
    table: npt.NDArray[Any] = (second[:, None] ^ first[None, :]).ravel()
    return table


_TYPE, _DESTINATION, _SOURCE, _HIGH, _LOW = (_of_one(crc8_mstp, zeros, np.uint8) for zeros in (4, 3, 2, 1, 0))
_CRC = np.arange(256, dtype=np.uint8) ^ np.uint8(crc8_mstp(bytes(5)))
_BEFORE, _MIDDLE, _AFTER = _of_two(_TYPE, _DESTINATION), _of_two(_SOURCE, _HIGH), _of_two(_LOW, _CRC)

_STEP16 = _of_one(crc16_x25, 0, np.uint16)
_PAIR16 = _of_two(_of_one(crc16_x25, 1, np.uint16), _STEP16)
_STEP32 = _of_one(crc32k, 0, np.uint32)
_LEFT_BY_GOOD = 0xF0B8
"""The CRC-16 over data and their CRC, before its complement, where they agree (RFC 1662, C.2)."""


def headers_are_good(headers: npt.NDArray[np.uint64]) -> Masks:
    """Whether the header CRC fits; a header is eight octets from the preamble on, the first one lowest."""
    words = headers.astype("<u8", copy=False).view("<u2").reshape(-1, 4)
    left = _BEFORE.take(words[:, 1]) ^ _MIDDLE.take(words[:, 2]) ^ _AFTER.take(words[:, 3])
    good: Masks = left == 0
    return good


def data_left(octets: Octets, begins: Times, counts: Times) -> npt.NDArray[np.uint16]:
    """CRC-16 before its complement over `counts` octets (1 or more) from `begins` on."""
    order = np.argsort(counts.astype(np.uint16), kind="stable")[::-1]
    at, left = begins[order], counts[order]
    odd = (left & 1).astype(bool)
    crc = np.full(len(at), _ALL_ONES, np.uint16)
    crc[odd] = _STEP16.take(octets.take(at[odd]) ^ np.uint8(0xFF)) ^ np.uint16(0xFF)
    at += odd
    pairs = left >> 1
    for under_way in _under_way(pairs):
        now, place = crc[:under_way], at[:under_way]
        word = octets.take(place + 1, mode="clip").astype(np.uint16)
        word <<= 8
        word |= octets.take(place, mode="clip")
        word ^= now
        _PAIR16.take(word, out=now, mode="clip")
        place += 2
    given = np.empty_like(crc)
    given[order] = crc
    return given


def data_are_good(left: npt.NDArray[np.uint16]) -> Masks:
    """Whether `data_left`, taken over data and their CRC, says that they agree."""
    good: Masks = left == _LEFT_BY_GOOD
    return good


def encoded_are_good(octets: Octets, begins: Times, counts: Times) -> Masks:
    """Whether the CRC-32K fits of encoded bodies: `counts` octets (6 or more) from `begins` on, CRC included."""
    order = np.argsort(counts.astype(np.uint16), kind="stable")[::-1]
    at, left = begins[order], counts[order] - CRC_SIZE
    crc = np.full(len(at), 0xFFFFFFFF, np.uint32)
    for under_way in _under_way(left):
        now, place = crc[:under_way], at[:under_way]
        step = _STEP32.take((now ^ octets.take(place, mode="clip")) & np.uint32(0xFF))
        now >>= 8
        now ^= step
        place += 1
    good = np.empty(len(at), bool)
    good[order] = _unstuffed(octets, at) == (crc ^ np.uint32(0xFFFFFFFF))
    return good


def _unstuffed(octets: Octets, at: Times) -> npt.NDArray[np.int64]:
    """The CRC that five COBS octets stand for; -1 where they are no COBS."""
    given = np.zeros(len(at), np.int64)
    code_at = np.zeros(len(at), np.int64)
    for place in range(CRC_SIZE):
        octet = octets.take(at + place, mode="clip").astype(np.int64) ^ MASK
        is_code = code_at == place
        if place:
            given |= np.where(is_code, 0, octet) << 8 * (place - 1)
        code_at = np.where(is_code, np.where(octet == 0, CRC_SIZE + 1, place + octet), code_at)
    given[code_at != CRC_SIZE] = -1
    return given


def _under_way(steps: Times) -> list[int]:
    """How many have a step left, step by step; those with the most steps come first."""
    if not len(steps):
        return []
    ended = np.bincount(steps)
    under_way: list[int] = (len(steps) - np.cumsum(ended))[:-1].tolist()
    return under_way
