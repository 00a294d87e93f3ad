"""Modbus TCP framing: the header names how many octets follow.

    transaction(2) protocol(2) = 0 length(2) | unit(1) PDU(1…253)          length counts unit and PDU

There is no check (TCP has one), so that a frame is good when its header is one and all of it came. Octets that begin
no header are noise (MODBUS Messaging on TCP/IP Implementation Guide V1.0b, 3.1.3).
"""

from __future__ import annotations

from typing import Final

from dissectors.frame import Check, Damage, Event, FoundBy, Reason
from dissectors.line import Timing
from dissectors.plain_framers import SILENCE, PlainFramer

TCP_NAME: Final = "modbus-tcp"
HEADER: Final = 6
"""Octets before the unit."""
LONGEST: Final = HEADER + 254
_LEAST = 8  # up to the function
_REFUSAL = 3
"""Unit, function and code of an exception."""


class TcpFramer(PlainFramer):
    """Octets of both directions of a connection in, frames out."""

    def __init__(self, timing: Timing) -> None:
        super().__init__(timing, TCP_NAME, SILENCE)

    def _scan(self, last: bool) -> list[Event]:
        events: list[Event] = []
        octets = self._window.octets
        while octets:
            size = expected(bytes(octets[:_LEAST]))
            if size is None:
                begin = _next(octets)
                if begin is None:
                    if len(octets) < LONGEST and not last:
                        break
                    begin = len(octets) if last else len(octets) - _LEAST + 1
                events.append(self._noise(begin, Reason.NO_FRAME))
            elif len(octets) >= max(size, _LEAST):
                events.append(self._frame(size, FoundBy.LENGTH, Check.ABSENT, None, size))
            elif last:
                events.append(self._frame(len(octets), FoundBy.LENGTH, Check.ABSENT, Damage.SHORT, size or None))
            else:
                break
        return events


def expected(begin: bytes) -> int | None:
    """Octets of the frame that begins so; 0 where more must come to tell; None where none begins so."""
    if any(begin[2:4]) or (len(begin) > 4 and begin[4]):
        return None
    size = begin[5] if len(begin) > 5 else 2
    if not 2 <= size <= LONGEST - HEADER or (len(begin) > 7 and not begin[7] & 0x7F):
        return None
    if len(begin) > 7 and begin[7] & 0x80 and size < _REFUSAL:
        return None  # as an RTU request of two registers 0 with its CRC
    return HEADER + size if len(begin) == _LEAST else 0


def _next(octets: bytearray | bytes) -> int | None:
    """Where the next header begins behind the first octet; None where none is seen whole."""
    for place in range(1, len(octets) - _LEAST + 1):
        if expected(bytes(octets[place : place + _LEAST])):
            return place
    return None
