"""BACnet/IP frames as scapy packets: who speaks to whom, the header of the datagram, then the NPDU as on MS/TP."""

from __future__ import annotations

from contextlib import suppress
from typing import ClassVar

from scapy.fields import ByteEnumField, ConditionalField, IPField, ShortEnumField, ShortField, XByteField
from scapy.packet import Packet, Raw

from dissectors.bacnet.ip import twin
from dissectors.bacnet.ip_functions import FUNCTIONS, RESULTS
from dissectors.bacnet.packets import NPDU
from dissectors.frame import Frame

_RESULT, _FORWARDED, _REGISTER = 0x00, 0x04, 0x05


class BVLC(Packet):  # type: ignore[misc]
    """A datagram with its ends."""

    name = "BACnet/IP"
    fields_desc: ClassVar = [
        IPField("source", "0.0.0.0"),
        ShortField("source_port", 47808),
        IPField("destination", "255.255.255.255"),
        ShortField("destination_port", 47808),
        XByteField("type", 0x81),
        ByteEnumField("function", 0x0A, FUNCTIONS),
        ShortField("length", None),
        ConditionalField(IPField("origin", "0.0.0.0"), lambda packet: packet.function == _FORWARDED),
        ConditionalField(ShortField("origin_port", 47808), lambda packet: packet.function == _FORWARDED),
        ConditionalField(ShortEnumField("result", 0, RESULTS), lambda packet: packet.function == _RESULT),
        ConditionalField(ShortField("seconds", 0), lambda packet: packet.function == _REGISTER),
    ]

    def post_build(self, pkt: bytes, pay: bytes) -> bytes:
        """The length is computed where it is not given."""
        if self.length is None:
            pkt = pkt[:14] + (len(pkt) - 12 + len(pay)).to_bytes(2, "big") + pkt[16:]
        return pkt + pay


class BVLCWithNPDU(BVLC):
    """One that carries an NPDU."""

    def guess_payload_class(self, payload: bytes) -> type[Packet]:
        return NPDU


def dissect(frame: Frame) -> Packet:
    """The packet of a frame. Total; bytes(packet) are the frame's octets."""
    with suppress(Exception):  # whatever the wire holds
        packet = (BVLC if twin(frame) is None else BVLCWithNPDU)(frame.octets)
        if bytes(packet) == frame.octets:
            return packet
    return Raw(frame.octets)
