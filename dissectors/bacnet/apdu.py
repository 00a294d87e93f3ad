"""APDU headers (ANSI/ASHRAE 135, 20.1): which PDU, which service, which invoke id, where the parameters begin.

0 Confirmed-Request   0000 SEG MOR SA 0 | max segs (3), max APDU (4) | invoke id | [seq, window] | service | …
1 Unconfirmed-Request 10 | service | …           2 SimpleACK 20 | invoke id | service
3 ComplexACK          0011 SEG MOR 00 | invoke id | [seq, window] | service | …
4 SegmentACK          0100 00 NAK SRV | invoke id | seq | window
5 Error 50 | invoke id | service | …    6 Reject 60 | invoke id | reason    7 Abort 0111 000 SRV | invoke id | reason
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from dissectors.bacnet import names
from dissectors.bacnet.services import service_name
from dissectors.quick_values import quickly_made


class PduType(IntEnum):
    """The high four bits of an APDU."""

    CONFIRMED_REQUEST = 0
    UNCONFIRMED_REQUEST = 1
    SIMPLE_ACK = 2
    COMPLEX_ACK = 3
    SEGMENT_ACK = 4
    ERROR = 5
    REJECT = 6
    ABORT = 7


TITLES = (
    "Confirmed-Request",
    "Unconfirmed-Request",
    "SimpleACK",
    "ComplexACK",
    "SegmentACK",
    "Error",
    "Reject",
    "Abort",
)
MAX_APDU = (50, 128, 206, 480, 1024, 1476)
"""Octets, by the code in a Confirmed-Request."""

MAX_SEGMENTS = ("unspecified", "2", "4", "8", "16", "32", "64", "more than 64")

SEGMENTED, MORE_FOLLOWS, SEGMENTED_ACCEPTED = 8, 4, 2
NEGATIVE_ACK, SERVER = 2, 1


@quickly_made
@dataclass(frozen=True, slots=True)
class Apdu:
    """An APDU header. None where the PDU type has no such field or the octets end before it.

    `type`: 0 … 7, others are reserved. `flags`: low four bits of the first octet. `reason`: of Reject and Abort.
    `body`: where the parameters begin, counted from the APDU's first octet. `error`: why it could not be read.
    """

    type: int
    flags: int
    invoke_id: int | None = None
    service: int | None = None
    max_segments: int | None = None
    max_apdu: int | None = None
    sequence: int | None = None
    window: int | None = None
    reason: int | None = None
    body: int = 1
    error: str | None = None

    @property
    def segmented(self) -> bool:
        """Whether it is one segment of a longer message."""
        return self.type in (0, 3) and bool(self.flags & SEGMENTED)

    @property
    def more_follows(self) -> bool:
        """Whether it is a segment and not the last one."""
        return self.segmented and bool(self.flags & MORE_FOLLOWS)

    @property
    def is_request(self) -> bool:
        """Whether it asks."""
        return self.type == PduType.CONFIRMED_REQUEST

    @property
    def is_answer(self) -> bool:
        """Whether it answers a confirmed request (a server's, where the PDU type is used by both sides)."""
        if self.type in (PduType.SEGMENT_ACK, PduType.ABORT):
            return bool(self.flags & SERVER)
        return self.type in (PduType.SIMPLE_ACK, PduType.COMPLEX_ACK, PduType.ERROR, PduType.REJECT)

    @property
    def name(self) -> str:
        """Kind of message: the service's name where it has one, else "reject", "abort", "segment-ack"."""
        if self.service is not None:
            return service_name(self.type, self.service)
        return _PLAIN.get(self.type, f"apdu-{self.type}")


_PLAIN = {
    0: "confirmed-request",
    1: "unconfirmed-request",
    2: "simple-ack",
    3: "complex-ack",
    4: "segment-ack",
    5: "error",
    6: "reject",
    7: "abort",
}


def decode(octets: bytes) -> Apdu | None:
    """The header at the front of an APDU; None when there is no octet. Total."""
    if not octets:
        return None
    kind, flags = octets[0] >> 4, octets[0] & 15
    try:
        match kind:
            case PduType.CONFIRMED_REQUEST:
                sizes, invoke = octets[1], octets[2]
                segments, largest = sizes >> 4 & 7, sizes & 15
                if flags & SEGMENTED:
                    return Apdu(kind, flags, invoke, octets[5], segments, largest, octets[3], octets[4], body=6)
                return Apdu(kind, flags, invoke, octets[3], segments, largest, body=4)
            case PduType.UNCONFIRMED_REQUEST:
                return Apdu(kind, flags, None, octets[1], body=2)
            case PduType.SIMPLE_ACK:
                return Apdu(kind, flags, octets[1], octets[2], body=3)
            case PduType.COMPLEX_ACK:
                if flags & SEGMENTED:
                    return Apdu(kind, flags, octets[1], octets[4], sequence=octets[2], window=octets[3], body=5)
                return Apdu(kind, flags, octets[1], octets[2], body=3)
            case PduType.SEGMENT_ACK:
                return Apdu(kind, flags, octets[1], sequence=octets[2], window=octets[3], body=4)
            case PduType.ERROR:
                return Apdu(kind, flags, octets[1], octets[2], body=3)
            case PduType.REJECT | PduType.ABORT:
                return Apdu(kind, flags, octets[1], reason=octets[2], body=3)
    except IndexError:
        return Apdu(kind, flags, body=len(octets), error="cut in its header")
    return Apdu(kind, flags, error=f"reserved PDU type {kind}")


def encode(
    kind: int,
    body: bytes = b"",
    *,
    invoke_id: int = 0,
    service: int = 0,
    flags: int = 0,
    max_segments: int = 0,
    max_apdu: int = 3,
    sequence: int = 0,
    window: int = 1,
    reason: int = 0,
) -> bytes:
    """The octets of an APDU of that type with these parameters."""
    first = bytes((kind << 4 | flags,))
    segment = bytes((sequence, window)) if flags & SEGMENTED and kind in (0, 3) else b""
    match kind:
        case PduType.CONFIRMED_REQUEST:
            return first + bytes((max_segments << 4 | max_apdu, invoke_id)) + segment + bytes((service,)) + body
        case PduType.UNCONFIRMED_REQUEST:
            return first + bytes((service,)) + body
        case PduType.COMPLEX_ACK:
            return first + bytes((invoke_id,)) + segment + bytes((service,)) + body
        case PduType.SIMPLE_ACK | PduType.ERROR:
            return first + bytes((invoke_id, service)) + body
        case PduType.SEGMENT_ACK:
            return first + bytes((invoke_id, sequence, window))
    return first + bytes((invoke_id, reason))


def reason_text(kind: int, reason: int) -> str:
    """The reason of a Reject or Abort by name."""
    return names.name("RejectReason" if kind == PduType.REJECT else "AbortReason", reason)
