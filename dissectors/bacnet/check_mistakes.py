"""Ways in which an MS/TP sender makes its CRCs wrongly, as `dissectors.wrong_checks` asks of a damaged frame. Pure."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final

from dissectors.bacnet.frame_types import HEADER, PREAMBLE, is_encoded
from dissectors.checksums import crc8_mstp, crc16_modbus, crc16_x25
from dissectors.frame import Damage, Frame
from dissectors.wrong_checks import ALIKE, BY_ANOTHER_RULE, NOT_MADE, Mistake, Way

_CHECK = 2  # octets of the data CRC
_START: Final = len(PREAMBLE)
_HEADER_CRC = HEADER - 1  # its place


def _turned(crc: int) -> int:
    return crc >> 8 | (crc & 0xFF) << 8


_DATA_CRCS: Final[dict[Mistake, Callable[[bytes], int]]] = {
    Mistake("which lacks its final complement", BY_ANOTHER_RULE): lambda frame: crc16_x25(frame[HEADER:]) ^ 0xFFFF,
    Mistake("whose two octets have changed places", BY_ANOTHER_RULE): lambda frame: _turned(crc16_x25(frame[HEADER:])),
    Mistake("which is made over the header, too", BY_ANOTHER_RULE): lambda frame: crc16_x25(frame[_START:]),
    Mistake("which is the CRC-16 of Modbus", BY_ANOTHER_RULE): lambda frame: crc16_modbus(frame[HEADER:]),
}
"""What a sender may take for the data CRC of a frame that ends with its data."""

_HEADER_UNCOMPLEMENTED: Final = Mistake("which lacks its final complement", BY_ANOTHER_RULE)


def data_ways(frame: Frame) -> Iterator[tuple[Way, int]]:
    """How the data CRC of a damaged frame is wrong, and what would be right; nothing where a line error was reported,
    more is wrong with it, or its data are encoded."""
    octets = frame.octets
    if frame.damage is not Damage.CHECK or frame.marks or is_encoded(octets[2]) or len(octets) < HEADER + _CHECK:
        return
    whole, received = octets[:-_CHECK], int.from_bytes(octets[-_CHECK:], "little")
    right = crc16_x25(whole[HEADER:])
    for mistake, made in _DATA_CRCS.items():
        if made(whole) == received:
            yield Way(mistake), right
    yield Way(ALIKE, received ^ right, len(octets)), right
    if received in (0, 0xFFFF):
        yield Way(NOT_MADE, received), right


def header_ways(frame: Frame) -> Iterator[tuple[Way, int]]:
    """The same of the header CRC."""
    octets = frame.octets
    if frame.damage is not Damage.HEADER or frame.marks or len(octets) < HEADER:
        return
    received, right = octets[_HEADER_CRC], crc8_mstp(octets[_START:_HEADER_CRC])
    if received == right ^ 0xFF:
        yield Way(_HEADER_UNCOMPLEMENTED), right
    yield Way(ALIKE, received ^ right), right
    if received in (0, 0xFF):
        yield Way(NOT_MADE, received), right
