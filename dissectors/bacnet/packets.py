"""MS/TP, NPDU and APDU as scapy packets: the full layout, to look at one frame and to craft frames.

    MSTP(frame_type=0, destination=5, source=2)                                     a token
    MSTP(frame_type=5, destination=5, source=2) / NPDU(expects_reply=1) / ConfirmedRequest(
        invoke_id=1, service=12) / parameters(0, 12, {"object-identifier": "device,1234",
        "property-identifier": "object-name"})                                      a ReadProperty

Lengths and checks are computed where they are None. Types 32 … 127 are encoded when they are built.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import Any, ClassVar

from scapy.fields import (
    BitEnumField,
    BitField,
    ByteEnumField,
    ByteField,
    ConditionalField,
    Field,
    FieldLenField,
    FieldListField,
    IntField,
    PacketListField,
    ShortField,
    TrailerField,
    XByteField,
    XShortField,
    XStrField,
    XStrLenField,
)
from scapy.packet import Packet, Raw

from dissectors.bacnet import cobs, codec, frame_types, names, npdu, services
from dissectors.bacnet.apdu import TITLES
from dissectors.bacnet.frame_types import CARRIES_NPDU, HEADER, PROPRIETARY, is_encoded, total
from dissectors.bacnet.framing import body_is_good
from dissectors.bacnet.values import APPLICATION, escape, primitive, show
from dissectors.checksums import crc8_mstp, crc16_x25

_TAGS_MAX = 8192


class _OptionalTrailer(TrailerField):
    """A trailer that only some frames have; absent is None."""

    __slots__ = ("size",)

    def __init__(self, field: Field, size: Any) -> None:
        super().__init__(field)
        self.size = size

    def getfield(self, pkt: Any, s: bytes) -> tuple[bytes, Any]:
        return super().getfield(pkt, s) if self.size(pkt) > 0 else (s, None)

    def addfield(self, pkt: Any, s: bytes, val: Any) -> bytes:
        return super().addfield(pkt, s, val) if val is not None else s


def _pad_size(pkt: Any) -> int:
    return max(0, len(pkt.original) - total(pkt.length or 0))


def _crc_size(pkt: Any) -> int:
    return 2 if pkt.length and not is_encoded(pkt.frame_type) else 0


class MSTP(Packet):
    """A whole MS/TP frame. `length`, `header_crc`, `data_crc` None: computed."""

    name = "MS/TP"
    fields_desc: ClassVar[list[Any]] = [
        XShortField("preamble", 0x55FF),
        ByteEnumField("frame_type", 0, {n: frame_types.title(n) for n in range(256)}),
        ByteField("destination", 255),
        ByteField("source", 0),
        ShortField("length", None),
        XByteField("header_crc", None),
        _OptionalTrailer(XStrLenField("pad", None, length_from=_pad_size), _pad_size),
        _OptionalTrailer(XShortField("data_crc", None), _crc_size),
    ]

    def pre_dissect(self, s: bytes) -> bytes:
        """Encoded data are decoded first, so that what follows the header is plain."""
        if len(s) >= HEADER and is_encoded(s[2]):
            length = s[5] << 8 | s[6]
            data = cobs.decode_body(s[HEADER : HEADER + length + 2])
            if data is not None:
                return s[:HEADER] + data + s[total(length) :]
        return s

    def post_dissect(self, s: bytes) -> bytes:
        self.raw_packet_cache = None  # the octets of this layer are not contiguous: it is always built anew
        return s

    def post_build(self, pkt: bytes, pay: bytes) -> bytes:
        pad = self.pad or b""
        body = pay[: len(pay) - len(pad)] if pad else pay
        if is_encoded(self.frame_type):
            body = cobs.encode_body(body) if body else b""
        elif body and self.data_crc is None:
            body += struct.pack("<H", crc16_x25(body))
        if self.length is None:
            pkt = pkt[:5] + struct.pack(">H", max(0, len(body) - 2)) + pkt[7:]
        if self.header_crc is None:
            pkt = pkt[:7] + bytes((crc8_mstp(pkt[2:7]),)) + pkt[8:]
        return pkt + body + pad

    def guess_payload_class(self, payload: bytes) -> Any:
        if self.frame_type in CARRIES_NPDU:
            return NPDU
        return Proprietary if self.frame_type >= PROPRIETARY else Raw

    def mysummary(self) -> str:
        return f"{frame_types.title(self.frame_type)} {self.source} → {self.destination}"


class _Tolerant(Field):
    """An unsigned number of one or two octets that may be cut off; then it is None and takes no octets."""

    def getfield(self, pkt: Any, s: bytes) -> tuple[bytes, Any]:
        return super().getfield(pkt, s) if len(s) >= self.sz else (s, None)

    def addfield(self, pkt: Any, s: bytes, val: Any) -> bytes:
        return s if val is None else super().addfield(pkt, s, val)


class MSTPFragment(Packet):
    """A frame that is cut off, or whose data cannot be read: what is there, the rest as octets."""

    name = "MS/TP fragment"
    fields_desc: ClassVar[list[Any]] = [
        _Tolerant("preamble", 0x55FF, "H"),
        _Tolerant("frame_type", 0, "B"),
        _Tolerant("destination", None, "B"),
        _Tolerant("source", None, "B"),
        _Tolerant("length", None, "H"),
        _Tolerant("header_crc", None, "B"),
        XStrField("rest", b""),
    ]

    def mysummary(self) -> str:
        return f"{frame_types.title(self.frame_type or 0)} {self.source} → {self.destination}, not readable"


class Proprietary(Packet):
    """Data of a proprietary frame type."""

    name = "Proprietary"
    fields_desc: ClassVar[list[Any]] = [ShortField("vendor_id", 0)]


def _flag(mask: int) -> Any:
    shift = mask.bit_length() - 1
    field = {7: "network_message", 5: "has_destination", 3: "has_source"}[shift]
    return lambda pkt: bool(getattr(pkt, field))


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
        BitField("expects_reply", 0, 1),
        BitEnumField("priority", 0, 2, dict(enumerate(npdu.PRIORITIES))),
        ConditionalField(ShortField("dnet", 0xFFFF), _flag(0x20)),
        ConditionalField(FieldLenField("dlen", None, length_of="dadr", fmt="B"), _flag(0x20)),
        ConditionalField(XStrLenField("dadr", b"", length_from=lambda pkt: pkt.dlen), _flag(0x20)),
        ConditionalField(ShortField("snet", 1), _flag(0x08)),
        ConditionalField(FieldLenField("slen", None, length_of="sadr", fmt="B"), _flag(0x08)),
        ConditionalField(XStrLenField("sadr", b"", length_from=lambda pkt: pkt.slen), _flag(0x08)),
        ConditionalField(ByteField("hop_count", 255), _flag(0x20)),
        ConditionalField(ByteEnumField("message", 0, {n: npdu.message_name(n) for n in range(256)}), _flag(0x80)),
        ConditionalField(ShortField("vendor_id", 0), lambda pkt: pkt.network_message and pkt.message >= 0x80),
    ]

    def guess_payload_class(self, payload: bytes) -> Any:
        if self.version != npdu.VERSION:
            return Raw
        if self.network_message:
            return _NETWORK.get(self.message, Raw)
        return _APDUS.get(payload[0] >> 4, Raw)


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


class _Apdu(Packet):
    """What the APDU types share."""

    def guess_payload_class(self, payload: bytes) -> Any:
        return Raw if getattr(self, "segmented", 0) else Parameters

    def mysummary(self) -> str:
        return f"{self.name} {self.fields.get('service', '')}"


_TYPE = dict(enumerate(TITLES))


def _pdu(kind: int) -> BitEnumField:
    return BitEnumField("pdu_type", kind, 4, _TYPE)


def _is_segment(pkt: Any) -> bool:
    return bool(pkt.segmented)


def _service(table: dict[int, str], default: int = 0) -> ByteEnumField:
    return ByteEnumField("service", default, dict(table))


class ConfirmedRequest(_Apdu):
    """BACnet-Confirmed-Request-PDU."""

    name = "Confirmed-Request"
    fields_desc: ClassVar[list[Any]] = [
        _pdu(0),
        BitField("segmented", 0, 1),
        BitField("more_follows", 0, 1),
        BitField("segmented_accepted", 0, 1),
        BitField("reserved", 0, 1),
        BitField("reserved_size", 0, 1),
        BitField("max_segments", 0, 3),
        BitField("max_apdu", 3, 4),
        ByteField("invoke_id", 0),
        ConditionalField(ByteField("sequence", 0), _is_segment),
        ConditionalField(ByteField("window", 1), _is_segment),
        _service(names.CONFIRMED, 12),
    ]


class UnconfirmedRequest(_Apdu):
    """BACnet-Unconfirmed-Request-PDU."""

    name = "Unconfirmed-Request"
    fields_desc: ClassVar[list[Any]] = [_pdu(1), BitField("reserved", 0, 4), _service(names.UNCONFIRMED, 8)]


class SimpleAck(_Apdu):
    """BACnet-SimpleACK-PDU."""

    name = "SimpleACK"
    fields_desc: ClassVar[list[Any]] = [
        _pdu(2),
        BitField("reserved", 0, 4),
        ByteField("invoke_id", 0),
        _service(names.CONFIRMED, 15),
    ]


class ComplexAck(_Apdu):
    """BACnet-ComplexACK-PDU."""

    name = "ComplexACK"
    fields_desc: ClassVar[list[Any]] = [
        _pdu(3),
        BitField("segmented", 0, 1),
        BitField("more_follows", 0, 1),
        BitField("reserved", 0, 2),
        ByteField("invoke_id", 0),
        ConditionalField(ByteField("sequence", 0), _is_segment),
        ConditionalField(ByteField("window", 1), _is_segment),
        _service(names.CONFIRMED, 12),
    ]


class SegmentAck(_Apdu):
    """BACnet-SegmentACK-PDU."""

    name = "SegmentACK"
    fields_desc: ClassVar[list[Any]] = [
        _pdu(4),
        BitField("reserved", 0, 2),
        BitField("negative", 0, 1),
        BitField("server", 0, 1),
        ByteField("invoke_id", 0),
        ByteField("sequence", 0),
        ByteField("window", 1),
    ]


class Error(_Apdu):
    """BACnet-Error-PDU."""

    name = "Error"
    fields_desc: ClassVar[list[Any]] = [
        _pdu(5),
        BitField("reserved", 0, 4),
        ByteField("invoke_id", 0),
        _service(names.CONFIRMED, 12),
    ]


class Reject(_Apdu):
    """BACnet-Reject-PDU."""

    name = "Reject"
    fields_desc: ClassVar[list[Any]] = [
        _pdu(6),
        BitField("reserved", 0, 4),
        ByteField("invoke_id", 0),
        ByteEnumField("reason", 0, dict(names.REJECT_REASONS)),
    ]


class Abort(_Apdu):
    """BACnet-Abort-PDU."""

    name = "Abort"
    fields_desc: ClassVar[list[Any]] = [
        _pdu(7),
        BitField("reserved", 0, 3),
        BitField("server", 0, 1),
        ByteField("invoke_id", 0),
        ByteEnumField("reason", 0, dict(names.ABORT_REASONS)),
    ]


_APDUS: dict[int, type[Packet]] = {
    0: ConfirmedRequest,
    1: UnconfirmedRequest,
    2: SimpleAck,
    3: ComplexAck,
    4: SegmentAck,
    5: Error,
    6: Reject,
    7: Abort,
}


def _wide(pkt: Any) -> bool:
    """Whether octets of length follow the tag."""
    return bool(pkt.lvt == 5)


def _content(pkt: Any) -> int:
    if pkt.context and pkt.lvt >= 6:
        return 0
    if not pkt.context and (pkt.extended_number if pkt.number == 15 else pkt.number) == 1 and pkt.lvt < 5:
        return 0
    if pkt.lvt < 5:
        return int(pkt.lvt)
    if pkt.lvt > 5:
        return 0
    if pkt.length_8 == 254:
        return int(pkt.length_16)
    return int(pkt.length_32 if pkt.length_8 == 255 else pkt.length_8)


class _Meaning(Field):
    """Words about a tag; not on the wire."""

    def getfield(self, pkt: Any, s: bytes) -> tuple[bytes, Any]:
        return s, _plain_meaning(pkt)

    def addfield(self, pkt: Any, s: bytes, val: Any) -> bytes:
        return s

    def i2repr(self, pkt: Any, x: Any) -> str:
        return str(x or "")


def _plain_meaning(pkt: Any) -> str:
    if pkt.context:
        return {6: "opening", 7: "closing"}.get(pkt.lvt, "")
    number = pkt.extended_number if pkt.number == 15 else pkt.number
    if number >= len(APPLICATION):
        return ""
    content = bytes((pkt.lvt,)) if number == 1 and pkt.lvt < 5 else bytes(pkt.value)
    try:
        return escape(f"{APPLICATION[number]} {show(primitive(APPLICATION[number], content))}")
    except ValueError:
        return f"no valid {APPLICATION[number]}"


class Tag(Packet):
    """One tag: primitive, opening or closing."""

    name = "Tag"
    fields_desc: ClassVar[list[Any]] = [
        BitField("number", 0, 4),
        BitEnumField("context", 0, 1, {0: "application", 1: "context"}),
        BitField("lvt", 0, 3),
        ConditionalField(ByteField("extended_number", 0), lambda pkt: pkt.number == 15),
        ConditionalField(ByteField("length_8", 0), _wide),
        ConditionalField(ShortField("length_16", 0), lambda pkt: _wide(pkt) and pkt.length_8 == 254),
        ConditionalField(IntField("length_32", 0), lambda pkt: _wide(pkt) and pkt.length_8 == 255),
        ConditionalField(XStrLenField("value", b"", length_from=_content), lambda pkt: _content(pkt) > 0),
        _Meaning("meaning", "", "s"),
    ]

    def extract_padding(self, s: bytes) -> tuple[bytes, bytes]:
        return b"", s


class Parameters(Packet):
    """The parameters of a service, tag by tag; what is no tag is Raw at the end."""

    name = "Parameters"
    fields_desc: ClassVar[list[Any]] = [PacketListField("tags", [], Tag, max_count=_TAGS_MAX)]

    def post_dissection(self, pkt: Packet) -> None:
        under = self.underlayer
        service = under.fields.get("service") if under is not None else None
        if under is None or service is None:
            return
        meanings: dict[int, str] = {}
        octets = b"".join(bytes(tag) for tag in self.tags)
        codec.decode(services.parameters(under.pdu_type, service), octets, meanings)
        at = 0
        for tag in self.tags:
            if at in meanings and isinstance(tag, Tag):
                tag.meaning = escape(meanings[at])
            at += len(bytes(tag))


def parameters(pdu_type: int, service: int, values: Mapping[str, Any]) -> Parameters:
    """Parameters of a service from named values, as `codec.encode` takes them.

    Raises LookupError for a service without a layout.
    """
    layout = services.parameters(pdu_type, service)
    if layout is None:
        raise LookupError(f"{services.service_name(pdu_type, service)}: no layout")
    return Parameters(codec.encode(layout, values))


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
    length = octets[5] << 8 | octets[6]
    end = total(length)
    if len(octets) < end:
        return False
    return not is_encoded(octets[2]) or not length or body_is_good(octets[2], length, octets[HEADER:end])
