"""MS/TP, NPDU and APDU as scapy packets: the full layout, to look at one frame and to craft frames.

    MSTP(frame_type=0, destination=5, source=2)                                     a token
    MSTP(frame_type=5, destination=5, source=2) / NPDU(expects_reply=1) / ConfirmedRequest(
        invoke_id=1, service=12) / parameters(0, 12, {"object-identifier": "device,1234",
        "property-identifier": "object-name"})                                      a ReadProperty

Lengths and checks are computed where they are None. Types 32 … 127 are encoded when they are built.
"""

from __future__ import annotations

from contextlib import suppress

from scapy.packet import Packet, Raw

from dissectors.bacnet.frame_types import HEADER, data_length, is_encoded, total
from dissectors.bacnet.framing import body_is_good
from dissectors.bacnet.packets.apdus import (
    Abort,
    ComplexAck,
    ConfirmedRequest,
    Error,
    Reject,
    SegmentAck,
    SimpleAck,
    UnconfirmedRequest,
)
from dissectors.bacnet.packets.frames import MSTP, MSTPFragment, Proprietary
from dissectors.bacnet.packets.network import (
    NPDU,
    Connection,
    CouldBeRouter,
    NetworkNumber,
    Networks,
    RejectNetwork,
    Route,
    RoutingTable,
)
from dissectors.bacnet.packets.segments import Assembled, assembled
from dissectors.bacnet.packets.tags import Parameters, Tag, parameters
from dissectors.frame import Frame, Role

__all__ = [
    "MSTP",
    "NPDU",
    "Abort",
    "Assembled",
    "ComplexAck",
    "ConfirmedRequest",
    "Connection",
    "CouldBeRouter",
    "Error",
    "MSTPFragment",
    "NetworkNumber",
    "Networks",
    "Parameters",
    "Proprietary",
    "Reject",
    "RejectNetwork",
    "Route",
    "RoutingTable",
    "SegmentAck",
    "SimpleAck",
    "Tag",
    "UnconfirmedRequest",
    "dissect",
    "packet",
    "parameters",
]


def packet(frame: Frame, role: Role) -> Packet:
    """The packet of a frame; its role makes no difference. Behind a last segment stands the message as a whole."""
    found = dissect(frame.octets)
    if frame.assembly is not None and isinstance(found, MSTP):
        with suppress(Exception):  # as in `dissect`: the frame must show whatever its message holds
            found.lastlayer().add_payload(assembled(frame.assembly))
    return found


def dissect(octets: bytes) -> Packet:
    """The packet of a frame's octets; total: what does not parse is kept as octets."""
    if not octets:
        return Raw(octets)
    try:
        if _is_whole(octets):
            packet = MSTP(octets)
            if not is_encoded(octets[2]) or bytes(packet) == octets:
                return packet
        return MSTPFragment(octets)
    except Exception:  # scapy raises whatever its fields raise; a frame from the wire must always show
        return Raw(octets)


def _is_whole(octets: bytes) -> bool:
    if len(octets) < HEADER:
        return False
    length = data_length(octets)
    end = total(length)
    if len(octets) < end:
        return False
    return not is_encoded(octets[2]) or not length or body_is_good(octets[2], length, octets[HEADER:end])
