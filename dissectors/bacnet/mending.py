"""Mended frames: what a damaged frame was, where its own checks prove that only one thing happened to it.

A header whose CRC agrees without its preamble is a header; a length that the data CRC contradicts is put right where
both CRCs then agree; a frame that ends one octet early and agrees in all that is left of it lacks its last octet. One
wrong octet among type, addresses and header CRC cannot be told from another: `turn.py` says who sent such a frame.
"""

from __future__ import annotations

import struct

from dissectors.bacnet import cobs
from dissectors.bacnet.frame_types import HEADER, PREAMBLE, FrameType, data_length, is_encoded, total
from dissectors.bacnet.limits import MAX_DATA, MAX_ENCODED
from dissectors.checksums import crc8_mstp, crc16_x25
from dissectors.frame import Damage, Flaw, Repair

WITHOUT_DATA = frozenset(
    map(
        int,
        (
            FrameType.TOKEN,
            FrameType.POLL_FOR_MASTER,
            FrameType.REPLY_TO_POLL_FOR_MASTER,
            FrameType.REPLY_POSTPONED,
        ),
    )
)
"""Types whose frames are a header and nothing else."""

_NAMED = frozenset(map(int, FrameType))
_AFTER_PREAMBLE = HEADER - 2  # type … header CRC


def header_is_good(header: bytes | bytearray) -> bool:
    """Whether eight octets are a preamble and a header with a good CRC."""
    return len(header) >= HEADER and header[:2] == PREAMBLE and crc8_mstp(bytes(header[2:7])) == header[7]


def body_is_good(frame_type: int, length: int, body: bytes) -> bool:
    """Whether the octets after the header (data and CRC) fit the length and the CRC of the frame type."""
    if not length:
        return not body
    if len(body) != length + 2:
        return False
    if is_encoded(frame_type):
        return cobs.crc_is_good(body)
    return crc16_x25(body[:-2]) == body[-2] | body[-1] << 8


def after_spoilt_preamble(octets: bytes | bytearray) -> tuple[int, int, Flaw] | None:
    """A good header behind a preamble that is not as it should be, at the begin of `octets` (eight of them, or fewer).

    Where the type is (0 … 2), the length that the header gives, and what is wrong; None where there is none.
    """
    for at, flaw in _preambles(bytes(octets[:2])):
        header = bytes(octets[at : at + _AFTER_PREAMBLE])
        if len(header) < _AFTER_PREAMBLE or header[0] not in _NAMED or crc8_mstp(header[:5]) != header[5]:
            continue
        length = header[3] << 8 | header[4]
        if (header[0] in WITHOUT_DATA) == (not length) and length <= _most(header[0]):
            return at, length, flaw
    return None


def _preambles(begin: bytes) -> tuple[tuple[int, Flaw], ...]:
    """Where the type may be, and what would have happened to the preamble then."""
    if begin[1:] == PREAMBLE[1:]:
        return (2, Flaw.FIRST_SPOILT), (1, Flaw.FIRST_MISSING), (0, Flaw.FIRST_TWO_MISSING)
    if begin[:1] == PREAMBLE[1:]:
        return (1, Flaw.FIRST_MISSING), (0, Flaw.FIRST_TWO_MISSING)
    if begin[:1] == PREAMBLE[:1]:
        return (2, Flaw.ONE_SPOILT), (1, Flaw.ONE_MISSING), (0, Flaw.FIRST_TWO_MISSING)
    return (2, Flaw.FIRST_TWO_SPOILT), (0, Flaw.FIRST_TWO_MISSING)


def is_like_header(octets: bytes | bytearray) -> bool:
    """Whether eight octets that are no header any more begin with half a preamble and have the length 0 of a token."""
    half = octets[:1] == PREAMBLE[:1] or octets[1:2] == PREAMBLE[1:]
    return half and octets[5:7] == b"\x00\x00" and any(octets[2:5]) and octets[7] != 0


def _most(frame_type: int) -> int:
    return MAX_ENCODED if is_encoded(frame_type) else MAX_DATA


def mended(octets: bytes, damage: Damage | None) -> Repair | None:
    """What damaged octets behind a good preamble were; None where it cannot be proved."""
    if len(octets) == HEADER - 1 and octets[2] in WITHOUT_DATA:
        return _short_header(octets)
    if len(octets) <= HEADER + 2:
        return None
    if damage is Damage.HEADER:
        return _wrong_length(octets)
    if not header_is_good(octets[:HEADER]):
        return None
    return _wrong_end(octets, data_length(octets))


def _short_header(octets: bytes) -> Repair | None:
    """Seven octets of a frame that has eight, with the length as it must be: the last one is missing."""
    header = octets[2:]
    if header[3:] != b"\x00\x00":
        return None
    return Repair(Flaw.LAST_MISSING, octets + bytes((crc8_mstp(header),)))


def _wrong_length(octets: bytes) -> Repair | None:
    """A length that says something else than the octets that came: both CRCs agree with the true one."""
    length = len(octets) - HEADER - 2
    true = struct.pack(">H", length)
    if sum(a != b for a, b in zip(true, octets[5:7], strict=True)) != 1:
        return None
    whole = octets[:5] + true + octets[7:]
    if header_is_good(whole[:HEADER]) and body_is_good(octets[2], length, octets[HEADER:]):
        return Repair(Flaw.ONE_SPOILT, whole)
    return None


def _wrong_end(octets: bytes, length: int) -> Repair | None:
    """Data CRC octets in the wrong order, or the last one missing while the others agree."""
    missing = total(length) - len(octets)
    if is_encoded(octets[2]):
        end = HEADER + length + 2 - cobs.CRC_SIZE
        crc = cobs.stuffed_crc(octets[HEADER:end])
        flaw = {1: Flaw.LAST_MISSING, 2: Flaw.LAST_TWO_MISSING}.get(missing)
        if flaw is not None and length + 2 > cobs.CRC_SIZE and octets[end:] == crc[:-missing]:
            return Repair(flaw, octets[:end] + crc)
        return None
    end = HEADER + length
    crc = struct.pack("<H", crc16_x25(octets[HEADER:end]))
    if missing == 1 and octets[end:] == crc[:1]:
        return Repair(Flaw.LAST_MISSING, octets[:end] + crc)
    if not missing and octets[end:] == crc[::-1]:
        return Repair(Flaw.CHECK_SWAPPED, octets[:end] + crc)
    return None
