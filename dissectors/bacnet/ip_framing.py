"""BACnet/IP framing: one datagram, one frame, behind who sent it to whom (ASHRAE 135, annex J).

    source address(4) port(2) destination address(4) port(2) | type(1) = 81 function(1) length(2) …

The first twelve octets are no part of the datagram: IP and UDP have them, and whoever puts datagrams behind one another
writes them down, since nothing in a datagram says whose it is. `length` counts from `type` on.
"""

from __future__ import annotations

from typing import Final

from dissectors.frame import Check, Damage, Event, FoundBy, Reason
from dissectors.line import Timing
from dissectors.plain_framers import SILENCE, PlainFramer

IP_NAME: Final = "bacnet-ip"
ENDS: Final = 12
"""Octets before the datagram."""
TYPE: Final = 0x81
LAST_FUNCTION: Final = 0x0C
_HEADER = ENDS + 4
_LONGEST = 1600


class IpFramer(PlainFramer):
    """Datagrams of everybody on a network in, frames out."""

    def __init__(self, timing: Timing) -> None:
        super().__init__(timing, IP_NAME, SILENCE)

    def _scan(self, last: bool) -> list[Event]:
        events: list[Event] = []
        octets = self._window.octets
        while octets:
            if len(octets) < _HEADER and not last:
                break
            size = expected(octets, 0)
            if size is None:
                begin = next((at for at in range(1, len(octets) - _HEADER + 1) if expected(octets, at)), None)
                if begin is None:
                    if len(octets) < _LONGEST and not last:
                        break
                    begin = len(octets) if last else len(octets) - _HEADER + 1
                events.append(self._noise(begin, Reason.NO_FRAME))
            elif len(octets) >= size:
                events.append(self._frame(size, FoundBy.LENGTH, Check.ABSENT, None, size))
            elif last:
                events.append(self._frame(len(octets), FoundBy.LENGTH, Check.ABSENT, Damage.SHORT, size))
            else:
                break
        return events


def expected(octets: bytes | bytearray, at: int) -> int | None:
    """Octets of the frame that begins there; None where none does."""
    head = octets[at + ENDS : at + _HEADER]
    if len(head) < 4 or head[0] != TYPE or head[1] > LAST_FUNCTION:
        return None
    size = head[2] << 8 | head[3]
    return ENDS + size if 4 <= size <= _LONGEST - ENDS else None
