"""The two envelopes of one PDU: unit and PDU octets out of an RTU or an ASCII frame, and the frame's own check.

    RTU     unit 1 | PDU 1…253 octets | CRC-16, low octet first
    ASCII   ':' | the same unit and PDU as hex pairs | LRC pair | CR LF

Everything behind this file walks the same octets whichever envelope they came in.
"""

from __future__ import annotations

from binascii import Error as HexError
from binascii import hexlify, unhexlify
from dataclasses import replace

from dissectors.checksums import crc16_modbus, lrc
from dissectors.frame import Check, Damage, Frame

RTU_NAME = "modbus-rtu"
ASCII_NAME = "modbus-ascii"

_PARITY_BIT = bytes(value & 0x7F for value in range(256))
_CR = (b"\r", b"\x8d")
_HEX = frozenset(b"0123456789ABCDEFabcdef")


def rtu_adu(frame: Frame) -> bytes:
    """Unit and PDU of an RTU frame, without its CRC; of a damaged one, what is there. Total."""
    return frame.octets[:-2] if frame.damage is None else frame.octets[: rtu_end(frame)]


def rtu_end(frame: Frame) -> int:
    """Where the CRC begins, or would: the number of octets of unit and PDU."""
    size = len(frame.octets)
    if frame.damage is None or frame.expected is None:
        return max(0, size - 2) if frame.damage is not Damage.SHORT else size
    return max(0, min(size, frame.expected - 2))


def rtu_check(frame: Frame) -> tuple[int, int] | None:
    """CRC received and computed, both as read in wire order (01 03 02 17 70 **B6 50** is 0xB650); None if not there."""
    end = rtu_end(frame)
    received = frame.octets[end : end + 2]
    if end < 2 or len(received) < 2:
        return None
    return int.from_bytes(received, "big"), int.from_bytes(
        crc16_modbus(frame.octets[:end]).to_bytes(2, "little"), "big"
    )


def hex_pairs(characters: bytes) -> tuple[bytes, bytes, bytes]:
    """An ASCII frame as its start character, its hex pairs, and what follows the last pair. Total.

    Bit 7 of a character is not looked at: an 8-bit port leaves the parity bit of a 7-bit line there.
    """
    plain = characters.translate(_PARITY_BIT)
    start = int(plain[:1] == b":")
    end = next((i for i in range(start, len(plain)) if plain[i] not in _HEX), len(plain))
    end -= (end - start) & 1
    return characters[:start], characters[start:end], characters[end:]


def ascii_octets(frame: Frame) -> bytes:
    """The hex pairs of an ASCII frame as octets: unit, PDU, LRC; those before the first that is no pair. Total."""
    octets = frame.octets
    if octets[:1] == b":":
        try:
            return unhexlify(octets[1 : octets.rindex(b"\r")])  # nearly all frames
        except (HexError, ValueError):
            pass
    return unhexlify(hex_pairs(octets)[1].translate(_PARITY_BIT))


def ascii_adu(frame: Frame) -> bytes:
    """Unit and PDU of an ASCII frame, without its LRC; of a frame without check, what is there. Total."""
    octets = ascii_octets(frame)
    if frame.check is Check.ABSENT or (frame.damage is Damage.FORM and not hex_pairs(frame.octets)[2].startswith(_CR)):
        return octets  # no LRC came, or what is no hex digit stands before it
    return octets[:-1]


def ascii_check(frame: Frame) -> tuple[int, int] | None:
    """LRC received and computed; None if not there."""
    octets = ascii_octets(frame)
    if frame.check is Check.ABSENT or len(octets) < 2:
        return None
    return octets[-1], lrc(octets[:-1])


def adu(frame: Frame) -> bytes:
    """Unit and PDU of a frame of either kind, without check."""
    return ascii_adu(frame) if frame.protocol == ASCII_NAME else rtu_adu(frame)


def readable(frame: Frame) -> Frame:
    """The frame as it was sent, where it is damaged and its repair is known; else the frame itself."""
    if frame.repair is None:
        return frame
    return replace(frame, octets=frame.repair.octets, check=Check.GOOD, damage=None, expected=None, repair=None)


def readable_adu(frame: Frame) -> bytes:
    """Unit and PDU of a frame of either kind; of a damaged one as repaired, where its repair is known."""
    return adu(readable(frame))


def seal_rtu(octets: bytes) -> bytes:
    """The RTU frame of unit and PDU."""
    return octets + crc16_modbus(octets).to_bytes(2, "little")


def seal_ascii(octets: bytes) -> bytes:
    """The ASCII frame of unit and PDU, closed by CR LF."""
    return b":" + hexlify(octets + bytes((lrc(octets),))).upper() + b"\r\n"


def unseal(octets: bytes, is_ascii: bool) -> bytes | None:
    """Unit and PDU of exactly one good frame, as a station takes it off the line; None of anything else. Total."""
    if not is_ascii:
        return octets[:-2] if len(octets) >= 4 and crc16_modbus(octets) == 0 else None
    start, pairs, end = hex_pairs(octets)
    inside = unhexlify(pairs.translate(_PARITY_BIT))
    whole = start and end.startswith(b"\r") and len(end) == 2 and len(inside) >= 3
    return inside[:-1] if whole and lrc(inside) == 0 else None


def make_rtu(unit: int, pdu: bytes) -> bytes:
    """The RTU frame of a unit and a PDU (function code and data)."""
    return seal_rtu(bytes([unit]) + pdu)


def make_ascii(unit: int, pdu: bytes, delimiter: bytes = b"\n") -> bytes:
    """The ASCII frame of a unit and a PDU, closed by CR and a delimiter."""
    return seal_ascii(bytes([unit]) + pdu)[:-1] + delimiter
