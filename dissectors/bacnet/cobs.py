"""COBS-encoded data of extended MS/TP frames (ANSI/ASHRAE 135, 9.10 and annex T; RFC 8163, appendix B).

    length field = encoded data octets + 3        after the header come length + 2 octets:
    encoded data (n) | CRC-32K over the encoded data, low octet first, itself encoded: always 5 octets

Each encoded octet is XORed with 55, so that the preamble never appears in the body.
"""

from __future__ import annotations

import struct

from dissectors.checksums import crc32k

MASK = 0x55
CRC_SIZE = 5
_TO_MASKED = bytes(value ^ MASK for value in range(256))


def stuff(data: bytes) -> bytes:
    """Encode: at most one octet in 254 longer, no 55 in it."""
    out = bytearray()
    for run in _runs(data):
        out.append(len(run) + 1)
        out += run
    return bytes(out).translate(_TO_MASKED)


def _runs(data: bytes) -> list[bytes]:
    """The runs between zeros, each of at most 254 octets; a zero follows each run that is shorter, but the last."""
    runs: list[bytes] = []
    pieces = data.split(b"\x00")
    for number, piece in enumerate(pieces, 1):
        full = len(piece) // 254
        runs += [piece[i * 254 : (i + 1) * 254] for i in range(full)]
        rest = piece[full * 254 :]
        if rest or not full or number < len(pieces):
            runs.append(rest)
    return runs


def unstuff(encoded: bytes) -> bytes | None:
    """Decode; None when a code is zero or runs past the end."""
    octets = encoded.translate(_TO_MASKED)
    out = bytearray()
    position, end = 0, len(octets)
    while position < end:
        code = octets[position]
        if code == 0 or position + code > end:
            return None
        out += octets[position + 1 : position + code]
        position += code
        if code != 255 and position < end:
            out.append(0)
    return bytes(out)


def crc_is_good(body: bytes) -> bool:
    """Whether the CRC-32K at the end of the octets after the header (length + 2 of them) fits."""
    if len(body) < CRC_SIZE:
        return False
    crc = unstuff(body[-CRC_SIZE:])
    return crc is not None and len(crc) == 4 and crc == struct.pack("<I", crc32k(body[:-CRC_SIZE]))


def decode_body(body: bytes) -> bytes | None:
    """The data of an extended frame from the octets after its header, CRC not looked at; None when malformed."""
    return unstuff(body[:-CRC_SIZE]) if len(body) >= CRC_SIZE else None


def stuffed_crc(encoded: bytes) -> bytes:
    """The five octets of CRC-32K that follow these encoded data."""
    return stuff(struct.pack("<I", crc32k(encoded)))


def encode_body(data: bytes) -> bytes:
    """The octets after the header; the length field is two less than their number."""
    encoded = stuff(data)
    return encoded + stuffed_crc(encoded)
