"""The APDU headers as scapy packets, one class a PDU type (ANSI/ASHRAE 135, 20.1)."""

from __future__ import annotations

from typing import Any, ClassVar

from scapy.fields import BitEnumField, BitField, ByteEnumField, ByteField, ConditionalField
from scapy.packet import Packet, Raw

from dissectors.bacnet import names
from dissectors.bacnet.apdu import MAX_APDU, MAX_SEGMENTS, TITLES
from dissectors.bacnet.packets.tags import Parameters


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
        BitEnumField("max_segments", 0, 3, dict(enumerate(MAX_SEGMENTS))),
        BitEnumField("max_apdu", 3, 4, {code: f"{octets} octets" for code, octets in enumerate(MAX_APDU)}),
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


BY_TYPE: dict[int, type[Packet]] = {
    0: ConfirmedRequest,
    1: UnconfirmedRequest,
    2: SimpleAck,
    3: ComplexAck,
    4: SegmentAck,
    5: Error,
    6: Reject,
    7: Abort,
}
