"""The network header and the network messages as scapy packets (ANSI/ASHRAE 135, 6.2 and 6.4)."""

from __future__ import annotations

from typing import Any, ClassVar

from scapy.fields import (
    BitEnumField,
    BitField,
    ByteEnumField,
    ByteField,
    ConditionalField,
    FieldLenField,
    FieldListField,
    PacketListField,
    ShortField,
    XStrLenField,
)
from scapy.packet import Packet, Raw

from dissectors.bacnet import apdu, npdu
from dissectors.bacnet.content import ReplyFlaw, reply_flaw
from dissectors.bacnet.message import Message
from dissectors.bacnet.packets.apdus import BY_TYPE
from dissectors.bacnet.station_address import mac_text


def _flag(mask: int) -> Any:
    shift = mask.bit_length() - 1
    field = {7: "network_message", 5: "has_destination", 3: "has_source"}[shift]
    return lambda pkt: bool(getattr(pkt, field))


class _ReplyBit(BitField):
    """The reply bit, with what contradicts it."""

    def i2repr(self, pkt: Any, x: Any) -> str:
        flaw = _reply_flaw(pkt)
        return str(x) if flaw is None else f"{x} ({flaw.words})"


def _reply_flaw(pkt: Any) -> ReplyFlaw | None:
    link, body = pkt.underlayer, bytes(pkt.payload)
    header = npdu.decode(bytes(pkt))
    if link is None or header is None or "frame_type" not in link.fields:
        return None
    inner = None if header.is_network_message else apdu.decode(body)
    return reply_flaw(Message(link.frame_type, link.destination, link.source, npdu=header, apdu=inner))


class _Mac(XStrLenField):
    """The address of a station on another network, as that network writes it, with its octets where they differ."""

    def i2repr(self, pkt: Any, x: Any) -> str:
        words = mac_text(bytes(x))
        return f"{words} ({bytes(x).hex(' ').upper()})" if len(x) == 6 else words


class NPDU(Packet):
    """The network header."""

    name = "NPDU"
    fields_desc: ClassVar[list[Any]] = [
        ByteField("version", 1),
        BitField("network_message", 0, 1),
        BitField("reserved_6", 0, 1),
        BitField("has_destination", 0, 1),
        BitField("reserved_4", 0, 1),
        BitField("has_source", 0, 1),
        _ReplyBit("expects_reply", 0, 1),
        BitEnumField("priority", 0, 2, dict(enumerate(npdu.PRIORITIES))),
        ConditionalField(ShortField("dnet", 0xFFFF), _flag(0x20)),
        ConditionalField(FieldLenField("dlen", None, length_of="dadr", fmt="B"), _flag(0x20)),
        ConditionalField(_Mac("dadr", b"", length_from=lambda pkt: pkt.dlen), _flag(0x20)),
        ConditionalField(ShortField("snet", 1), _flag(0x08)),
        ConditionalField(FieldLenField("slen", None, length_of="sadr", fmt="B"), _flag(0x08)),
        ConditionalField(_Mac("sadr", b"", length_from=lambda pkt: pkt.slen), _flag(0x08)),
        ConditionalField(ByteField("hop_count", 255), _flag(0x20)),
        ConditionalField(ByteEnumField("message", 0, {n: npdu.message_name(n) for n in range(256)}), _flag(0x80)),
        ConditionalField(ShortField("vendor_id", 0), lambda pkt: pkt.network_message and pkt.message >= 0x80),
    ]

    def guess_payload_class(self, payload: bytes) -> Any:
        if self.version != npdu.VERSION:
            return Raw
        if self.network_message:
            return _NETWORK.get(self.message, Raw)
        return BY_TYPE.get(payload[0] >> 4, Raw)


class Networks(Packet):
    """A list of network numbers."""

    name = "Networks"
    fields_desc: ClassVar[list[Any]] = [
        FieldListField("networks", [], ShortField("network", 0), length_from=lambda pkt: None)
    ]


class RejectNetwork(Packet):
    """Reject-Message-To-Network."""

    name = "Reject-Message-To-Network"
    fields_desc: ClassVar[list[Any]] = [ByteEnumField("reason", 0, npdu.REJECTIONS), ShortField("network", 0)]


class CouldBeRouter(Packet):
    """I-Could-Be-Router-To-Network."""

    name = "I-Could-Be-Router-To-Network"
    fields_desc: ClassVar[list[Any]] = [ShortField("network", 0), ByteField("performance", 0)]


class NetworkNumber(Packet):
    """Network-Number-Is."""

    name = "Network-Number-Is"
    fields_desc: ClassVar[list[Any]] = [
        ShortField("network", 0),
        ByteEnumField("how", 1, {0: "learned", 1: "configured"}),
    ]


class Connection(Packet):
    """Establish-Connection-To-Network."""

    name = "Establish-Connection-To-Network"
    fields_desc: ClassVar[list[Any]] = [ShortField("network", 0), ByteField("minutes", 0)]


class Route(Packet):
    """One entry of a routing table."""

    name = "Route"
    fields_desc: ClassVar[list[Any]] = [
        ShortField("network", 0),
        ByteField("port_id", 0),
        FieldLenField("info_length", None, length_of="info", fmt="B"),
        XStrLenField("info", b"", length_from=lambda pkt: pkt.info_length),
    ]

    def extract_padding(self, s: bytes) -> tuple[bytes, bytes]:
        return b"", s


class RoutingTable(Packet):
    """Initialize-Routing-Table and its acknowledgement."""

    name = "Routing table"
    fields_desc: ClassVar[list[Any]] = [
        FieldLenField("count", None, count_of="routes", fmt="B"),
        PacketListField("routes", [], Route, count_from=lambda pkt: pkt.count, max_count=256),
    ]


_NETWORK: dict[int, type[Packet]] = {
    0x00: Networks,
    0x01: Networks,
    0x02: CouldBeRouter,
    0x03: RejectNetwork,
    0x04: Networks,
    0x05: Networks,
    0x06: RoutingTable,
    0x07: RoutingTable,
    0x08: Connection,
    0x09: Networks,
    0x13: NetworkNumber,
}
