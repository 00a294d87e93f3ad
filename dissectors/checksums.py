"""Every check that the protocols use. All take any octets and return the check as an int."""

from __future__ import annotations

from fastcrc import crc16 as _crc16


def crc16_modbus(octets: bytes) -> int:
    """CRC-16/MODBUS: sent low octet first; over a whole good frame it is 0 (Modbus over Serial Line V1.02, 6.2.2)."""
    return int(_crc16.modbus(octets))


def ends_with_crc16(octets: bytes) -> bool:
    """Whether the last two octets are the CRC-16 of those before, the low one first: what serial lines use most."""
    return not crc16_modbus(octets)


def lrc(octets: bytes) -> int:
    """Modbus ASCII LRC: two's complement of the 8-bit sum (Modbus over Serial Line V1.02, 6.2.1)."""
    return -sum(octets) & 0xFF


def sum8(octets: bytes) -> int:
    """Low octet of the sum: N2 (over the ASCII characters) and PROFIBUS FCS."""
    return sum(octets) & 0xFF


def crc16_x25(octets: bytes) -> int:
    """CRC-16/X-25 (complemented): MS/TP data CRC, sent low octet first (ASHRAE 135, 9.6 and annex G.2)."""
    return int(_crc16.ibm_sdlc(octets))


def _mstp_header_step(crc: int) -> int:
    for _ in range(8):
        crc = (crc >> 1) ^ (0x81 if crc & 1 else 0)
    return crc


_HEADER_TABLE = bytes(_mstp_header_step(value) for value in range(256))


def crc8_mstp(octets: bytes) -> int:
    """MS/TP header CRC-8 (complemented), over type … length (ASHRAE 135, annex G.1): 00 10 05 00 00 gives 8C."""
    crc = 0xFF
    for octet in octets:
        crc = _HEADER_TABLE[crc ^ octet]
    return crc ^ 0xFF


def _crc32k_step(crc: int) -> int:
    for _ in range(8):
        crc = (crc >> 1) ^ (0xEB31D82E if crc & 1 else 0)
    return crc


_CRC32K_TABLE = tuple(_crc32k_step(value) for value in range(256))


def crc32k(octets: bytes) -> int:
    """CRC-32K (Koopman, complemented): COBS-encoded MS/TP frames, sent low octet first (ASHRAE 135, annex G.3)."""
    crc = 0xFFFFFFFF
    for octet in octets:
        crc = (crc >> 8) ^ _CRC32K_TABLE[(crc ^ octet) & 0xFF]
    return crc ^ 0xFFFFFFFF
