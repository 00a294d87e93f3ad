"""Ways in which a Modbus sender makes its check wrongly, as `dissectors.wrong_checks` asks of a damaged frame. Pure."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import reduce
from operator import xor
from typing import Final

from dissectors.checksums import crc16_modbus, crc16_x25, lrc
from dissectors.frame import Damage, Frame
from dissectors.modbus.envelope import RTU_NAME, ascii_octets, hex_pairs, rtu_check
from dissectors.wrong_checks import ALIKE, BY_ANOTHER_RULE, NOT_MADE, Mistake, Way

_LRCS: Final[dict[Mistake, Callable[[bytes, bytes], int]]] = {
    Mistake("which is the sum of the octets, not its two's complement", BY_ANOTHER_RULE): lambda octets, _: sum(octets),
    Mistake("which is the one's complement of the sum, not the two's", BY_ANOTHER_RULE): lambda octets, _: ~sum(octets),
    Mistake("which is the exclusive or of the octets, not the two's complement of their sum", BY_ANOTHER_RULE): (
        lambda octets, _: reduce(xor, octets, 0)
    ),
    Mistake("which is made of the characters sent, not of the octets that they stand for", BY_ANOTHER_RULE): (
        lambda _, characters: -sum(characters)
    ),
    Mistake(
        "which is made of the characters sent, the colon among them, not of the octets that they stand for",
        BY_ANOTHER_RULE,
    ): lambda _, characters: -sum(characters) - ord(":"),
    Mistake("whose two digits have changed places", BY_ANOTHER_RULE): (
        lambda octets, _: lrc(octets) << 4 | lrc(octets) >> 4
    ),
}
"""What a sender may take for the LRC of a message: of its octets, or of the characters that they are sent as."""

_CRCS: Final[dict[Mistake, Callable[[bytes], int]]] = {
    Mistake("which is a CRC of another polynomial (CCITT)", BY_ANOTHER_RULE): crc16_x25,
    Mistake("which is the sum of the octets, not a CRC", BY_ANOTHER_RULE): sum,
}
"""What a sender may take for the CRC of a message; either octet may come first."""

_UPPER_BITS: Final = 0x8080  # of both octets of a CRC

_CRC: Final = Mistake("which is a CRC-16, not an LRC", "the sender's program puts the check of RTU into an ASCII frame")
_LEFT_OUT: Final = Mistake("which is left out", "the sender's program sends no check", by_chance=False)


def ways(frame: Frame) -> Iterator[tuple[Way, int]]:
    """How the check of a damaged frame of either kind is wrong, and what would be right; nothing where a line error was
    reported, or more is wrong with it."""
    if frame.marks or frame.damage is None:
        return
    yield from _rtu(frame) if frame.protocol == RTU_NAME else _ascii(frame)


def _rtu(frame: Frame) -> Iterator[tuple[Way, int]]:
    check = rtu_check(frame) if frame.damage is Damage.CHECK else None
    if check is None:
        return
    received, right = check
    octets = len(frame.octets)
    if not (received ^ right) & ~_UPPER_BITS and max(frame.octets) < 0x80:
        return  # received with 7 data bits
    begun_with_0 = int.from_bytes(crc16_modbus(bytes(octets - 2)).to_bytes(2, "little"), "big")
    for mistake, made in _CRCS.items():
        if made(frame.octets[:-2]) & 0xFFFF in (received, _turned(received)):
            yield Way(mistake), right
    yield Way(ALIKE, received ^ right, octets, received ^ right == begun_with_0), right
    if received in (0, 0xFFFF):
        yield Way(NOT_MADE, received), right


def _ascii(frame: Frame) -> Iterator[tuple[Way, int]]:
    """Of frames that are whole and end as they should."""
    _, pairs, end = hex_pairs(frame.octets)
    octets = ascii_octets(frame)
    if end[:1] not in (b"\r", b"\x8d") or len(octets) < 3:
        return
    if len(octets) > 4 and int.from_bytes(octets[-2:], "little") in _crcs(octets[:-2]):
        yield Way(_CRC), lrc(octets[:-2])
    if frame.damage is Damage.SHORT and frame.expected is not None and frame.expected - len(frame.octets) == 2:
        yield Way(_LEFT_OUT), lrc(octets)
    if frame.damage is not Damage.CHECK:
        return
    message, received = octets[:-1], octets[-1]
    right = lrc(message)
    characters = pairs[: 2 * len(message)]
    for mistake, made in _LRCS.items():
        if made(message, characters) & 0xFF == received:
            yield Way(mistake), right
    yield Way(ALIKE, received - right & 0xFF), right
    if received in (0, 0xFF):
        yield Way(NOT_MADE, received), right


def _crcs(message: bytes) -> tuple[int, int]:
    """The CRC-16 of a message, as RTU sends it and the other way round, both read the low octet first."""
    crc = crc16_modbus(message)
    return crc, _turned(crc)


def _turned(check: int) -> int:
    return check >> 8 | (check & 0xFF) << 8
