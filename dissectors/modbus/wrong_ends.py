"""How what came in place of an answer ends: too late, or just too early. Pure."""

from __future__ import annotations

from dissectors.checksums import crc16_modbus
from dissectors.frame import Damage, Frame
from dissectors.modbus.asked import AskedRequest
from dissectors.modbus.envelope import RTU_NAME, rtu_check
from dissectors.modbus.functions import FUNCTIONS, answer_length

_TALKED_OVER = 3  # octets by which an answer must be too long before somebody else has spoken


def excess_of(asked: AskedRequest, stray: bytes) -> int | None:
    """By how many octets what came is too long, where it began as the answer; None where it did not, or is not."""
    if asked.frame.protocol != RTU_NAME or stray[:2] != asked.octets[:2] or stray[1] not in FUNCTIONS:
        return None
    expected = answer_length(asked.frame.octets)
    excess = len(stray) - expected if expected is not None else 0
    return excess if excess >= _TALKED_OVER else None


def ends_badly(frame: Frame) -> bool:
    """Whether a damaged frame is right up to its last octet, or ends just before it."""
    if frame.damage is Damage.SHORT:
        if frame.expected is None or frame.expected - len(frame.octets) != 1:
            return False
        # an octet lost further in leaves a wrong check
        return frame.protocol != RTU_NAME or frame.octets[-1] == crc16_modbus(frame.octets[:-1]) & 0xFF
    if frame.damage is not Damage.CHECK:
        return False
    if frame.marks:
        return all(mark.offset == len(frame.octets) - 1 for mark in frame.marks)
    check = rtu_check(frame) if frame.protocol == RTU_NAME else None
    return check is not None and check[0] >> 8 == check[1] >> 8
