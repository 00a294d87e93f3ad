"""Modbus TCP frames as scapy packets, around the PDUs of `pdus.py`."""

from __future__ import annotations

from typing import ClassVar

from scapy.fields import ByteField, ShortField
from scapy.packet import Packet, Raw

from dissectors.frame import Frame, Header, Role
from dissectors.modbus.packets import Adu


class ModbusTcp(Adu):
    """Header, unit and PDU of a request."""

    name = "Modbus TCP"
    fields_desc: ClassVar = [
        ShortField("transaction", 0),
        ShortField("protocol", 0),
        ShortField("length", None),
        ByteField("unit", 1),
    ]

    def post_build(self, pkt: bytes, pay: bytes) -> bytes:
        """The length is computed where it is not given."""
        if self.length is None:
            pkt = pkt[:4] + (1 + len(pay)).to_bytes(2, "big") + pkt[6:]
        return pkt + pay


class ModbusTcpResponse(ModbusTcp):
    """The same, its PDU read as a response."""

    response = True


def dissect(frame: Frame, role: Role, header: Header) -> Packet:
    """The packet of a frame in the direction that the tracker gave. Total."""
    if len(frame.octets) < 7:
        return Raw(frame.octets)
    if role in (Role.EITHER, Role.UNKNOWN):
        role = header.role
    packet = (ModbusTcpResponse if role is Role.RESPONSE else ModbusTcp)()
    packet.response, packet.unknown = role is Role.RESPONSE, role is Role.UNKNOWN and frame.ok
    packet.dissect(frame.octets)
    if not header.ok:
        object.__setattr__(packet, "name", f"{packet.name} [{header.error}]")
    return packet
