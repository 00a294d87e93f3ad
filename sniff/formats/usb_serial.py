"""How serial adapters lay octets into USB transfers: as they are, or in packets that begin with two of status. Pure.

FTDI's adapters put state of the modem lines and errors of the line before what they send, in each packet of 64 or (high
speed) 512 octets, and send that alone when nothing was heard. What they are sent has no such octets.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum

from dissectors.frame import LineError, Mark

STATUS = 2
_ERRORS = ((0x02, LineError.OVERRUN), (0x04, LineError.PARITY), (0x08, LineError.FRAMING), (0x10, LineError.BREAK))


_LEAST, _MOSTLY = 4, 0.8
_IDLE = 0x60
"""Nothing waits to be sent, of the second octet."""


def begin_with_status(packets: Sequence[bytes]) -> bool:
    """Whether what an adapter sent begins with its status: all of it, and mostly nothing waited to be sent."""
    idle = sum(packet[1:2] != b"" and packet[1] & _IDLE == _IDLE for packet in packets)
    return (
        len(packets) >= _LEAST
        and idle >= _MOSTLY * len(packets)
        and all(len(packet) >= STATUS and packet[0] & 0x0F in (1, 2) for packet in packets)
    )


class Laid(Enum):
    """How. The value: octets of a packet with status, 0 where there is none."""

    PLAIN = 0
    FULL_SPEED = 64
    HIGH_SPEED = 512

    def heard(self, octets: bytes) -> tuple[bytes, tuple[Mark, ...]]:
        """The octets of the line in what an adapter sent, and those among which there was an error."""
        if self is Laid.PLAIN:
            return octets, ()
        found, marks = b"", []
        for at in range(0, len(octets), self.value):
            packet = octets[at : at + self.value]
            said = LineError(0)
            for bit, error in _ERRORS:
                said |= error if len(packet) > STATUS and packet[1] & bit else LineError(0)
            if said:
                marks += [Mark(len(found) + place, said) for place in range(len(packet) - STATUS)]
            found += packet[STATUS:]
        return found, tuple(marks)
