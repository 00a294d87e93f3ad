"""Wireshark's field names and values of an MS/TP frame, for filters, columns and JSON.

A field that stands more than once in a frame is a comma-separated string, as Wireshark prints it.
"""

from __future__ import annotations

from typing import Any

from dissectors.bacnet import message as messages
from dissectors.bacnet import npdu as npdus
from dissectors.bacnet.apdu import Apdu, PduType
from dissectors.bacnet.dates import Date, Time
from dissectors.bacnet.frame_types import HEADER, PREAMBLE, PROPRIETARY, is_encoded
from dissectors.bacnet.framing import body_is_good, header_is_good
from dissectors.bacnet.message import Message
from dissectors.bacnet.npdu import Npdu
from dissectors.bacnet.tags import Tag
from dissectors.bacnet.values import BitString, ConstructedValue, Double, Enumerated, ObjectId, Signed, escape
from dissectors.frame import Frame, Role

Value = int | float | str


def fields(frame: Frame, role: Role) -> dict[str, Value]:
    """Field names to values, in frame order. Total; a damaged frame has the fields of what is there."""
    found: dict[str, list[Value]] = {}
    octets = frame.octets if frame.repair is None else frame.repair.octets
    message = messages.read(frame)
    if message is None:
        return {}
    _link(octets, message, frame.repair is None, found)
    if message.npdu is not None:
        _network(message.npdu, message, found)
    if message.apdu is not None:
        _application(message.apdu, found)
    assembly = frame.assembly
    if assembly is not None and message.whole is not None:
        for no in assembly.frames:
            _add(found, "bacapp.fragment", no)
        _add(found, "bacapp.fragment.count", len(assembly.frames))
        _add(found, "bacapp.reassembled.length", len(message.whole[1]))
    spoken = message.spoken()
    if spoken is not None:
        _said(*spoken, found)
    return {name: values[0] if len(values) == 1 else ",".join(map(str, values)) for name, values in found.items()}


def _add(found: dict[str, list[Value]], name: str, value: Value | None) -> None:
    if value is not None:
        found.setdefault(name, []).append(value)


def _link(octets: bytes, message: Message, came_so: bool, found: dict[str, list[Value]]) -> None:
    """The header and the checks. `came_so`: whether the octets are those of the wire, not what they were before."""
    _add(found, "mstp.frame_type", message.frame_type)
    _add(found, "mstp.dst", message.destination)
    _add(found, "mstp.src", message.source)
    if message.length is None:
        return
    _add(found, "mstp.len", message.length)
    _add(found, "mstp.hdr_crc", octets[7])
    good = came_so and octets[:2] == PREAMBLE and header_is_good(octets[:HEADER])
    end = HEADER + message.length + 2
    if message.length:
        body = octets[HEADER:end]
        good = good and body_is_good(message.frame_type, message.length, body)
        if len(octets) >= end and not is_encoded(message.frame_type):
            _add(found, "mstp.data_crc", int.from_bytes(octets[end - 2 : end], "big"))
    _add(found, "mstp.checksum.status", int(good))
    if message.frame_type >= PROPRIETARY and len(message.data) >= 2:
        _add(found, "mstp.vendorid", message.data[0] << 8 | message.data[1])


def _network(npdu: Npdu, message: Message, found: dict[str, list[Value]]) -> None:
    _add(found, "bacnet.version", npdu.version)
    _add(found, "bacnet.control", npdu.control)
    _add(found, "bacnet.control_net", npdu.control >> 7)
    _add(found, "bacnet.control_dest", npdu.control >> 5 & 1)
    _add(found, "bacnet.control_src", npdu.control >> 3 & 1)
    _add(found, "bacnet.control_expect", npdu.control >> 2 & 1)
    _address("d", npdu.dnet, npdu.dadr, found)
    _address("s", npdu.snet, npdu.sadr, found)
    _add(found, "bacnet.hopc", npdu.hops)
    _add(found, "bacnet.mesgtyp", npdu.message)
    _add(found, "bacnet.vendor", npdu.vendor)
    if npdu.message is not None:
        payload = message.data[npdu.body :]
        if npdu.message == 0x03 and payload:
            _add(found, "bacnet.rejectreason", payload[0])
        third = _THIRD_OCTET.get(npdu.message)
        if third is not None and len(payload) >= 3:
            _add(found, third, payload[2])
        for number in npdus.networks(npdu, message.data):
            _add(found, "bacnet.dnet", number)
        for _, port, info in npdus.routes(payload) if npdu.message in (0x06, 0x07) else ():
            _add(found, "bacnet.portid", port)
            _add(found, "bacnet.pinfolen", len(info))
            _add(found, "bacnet.pinfo", info.hex())


_THIRD_OCTET = {0x02: "bacnet.perf", 0x08: "bacnet.term_time_value", 0x13: "bacnet.netno_status"}
"""What follows the network number, by message."""


def _address(end: str, net: int | None, address: bytes | None, found: dict[str, list[Value]]) -> None:
    if net is None or address is None:
        return
    _add(found, f"bacnet.{end}net", net)
    _add(found, f"bacnet.{end}len", len(address))
    if len(address) == 1:
        _add(found, f"bacnet.{end}adr_mstp", address[0])
    elif len(address) == 6:
        _add(found, f"bacnet.{end}adr_eth", address.hex(":"))
    elif address:
        _add(found, f"bacnet.{end}adr_tmp", address.hex())


def _application(apdu: Apdu, found: dict[str, list[Value]]) -> None:
    """The header of an APDU."""
    _add(found, "bacapp.type", apdu.type)
    if apdu.error is not None:
        return
    if apdu.type in (PduType.CONFIRMED_REQUEST, PduType.COMPLEX_ACK):
        _add(found, "bacapp.segmented_request", apdu.flags >> 3 & 1)
        _add(found, "bacapp.more_segments", apdu.flags >> 2 & 1)
    if apdu.type == PduType.CONFIRMED_REQUEST:
        _add(found, "bacapp.SA", apdu.flags >> 1 & 1)
        _add(found, "bacapp.response_segments", apdu.max_segments)
        _add(found, "bacapp.max_adpu_size", apdu.max_apdu)
    if apdu.type == PduType.SEGMENT_ACK:
        _add(found, "bacapp.NAK", apdu.flags >> 1 & 1)
    if apdu.type in (PduType.SEGMENT_ACK, PduType.ABORT):
        _add(found, "bacapp.SRV", apdu.flags & 1)
    _add(found, "bacapp.invoke_id", apdu.invoke_id)
    _add(found, "bacapp.sequence_number", apdu.sequence)
    _add(found, "bacapp.window_size", apdu.window)
    unconfirmed = apdu.type == PduType.UNCONFIRMED_REQUEST
    _add(found, "bacapp.unconfirmed_service" if unconfirmed else "bacapp.confirmed_service", apdu.service)
    if apdu.type == PduType.REJECT:
        _add(found, "bacapp.reject_reason", apdu.reason)
    if apdu.type == PduType.ABORT:
        _add(found, "bacapp.abort_reason", apdu.reason)


def _said(apdu: Apdu, parameters: bytes, found: dict[str, list[Value]]) -> None:
    """What the parameters of an APDU say."""
    decoded = messages.decode_parameters(apdu, parameters)
    if decoded is None:
        return
    _parameters(decoded.record, None, found, 0)
    for tag in decoded.rest:
        _tag(tag, found, 0)


_NAMED: dict[str, str] = {
    "vendor-id": "bacapp.vendor_identifier",
    "device-instance-range-low-limit": "bacapp.who_is.low_limit",
    "device-instance-range-high-limit": "bacapp.who_is.high_limit",
    "object-name": "bacapp.object_name",
    "process-identifier": "bacapp.processId",
    "subscriber-process-identifier": "bacapp.processId",
    "acknowledging-process-identifier": "bacapp.processId",
    "requesting-process-identifier": "bacapp.processId",
    "from-state": "bacapp.from_state",
    "to-state": "bacapp.to_state",
}
_PROPERTY_VALUES = {"property-value", "value", "read-result", "list-of-elements", "item-data"}
"""Parameters that hold what the property spoken of holds."""

_PRESENT_VALUE = 85
_VENDOR_IDENTIFIER = 120
_OBJECT_NAME = 77


def _parameters(record: ConstructedValue, about: int | None, found: dict[str, list[Value]], depth: int) -> None:
    """Fields of named values; `about` is the property spoken of."""
    if depth > 40:
        return
    for name, value in record:
        if isinstance(value, Enumerated) and value.enumeration == "PropertyIdentifier":
            about = value.value
        named = _NAMED.get(name)
        if named is not None and isinstance(value, (int, str, Enumerated)):
            _add(found, named, escape(value) if isinstance(value, str) else int(value))
        elif name in _PROPERTY_VALUES:
            _held(value, about, found, depth + 1)
        else:
            _value(value, about, found, depth + 1)


def _value(value: Any, about: int | None, found: dict[str, list[Value]], depth: int) -> None:
    if isinstance(value, ConstructedValue):
        _parameters(value, about, found, depth)
    elif isinstance(value, (tuple, list)):
        for item in value if depth <= 40 else ():
            _value(item, about, found, depth + 1)
    elif isinstance(value, ObjectId):
        _add(found, "bacapp.objectType", value.type)
        _add(found, "bacapp.instance_number", value.instance)
    elif isinstance(value, Enumerated):
        name = _ENUMERATED.get(value.enumeration or "")
        if name is not None:
            _add(found, name, value.value)
    elif isinstance(value, Tag):
        _tag(value, found, depth)


_ENUMERATED: dict[str, str] = {
    "PropertyIdentifier": "bacapp.property_identifier",
    "ErrorClass": "bacapp.error_class",
    "ErrorCode": "bacapp.error_code",
    "EventType": "bacapp.event_type",
    "NotifyType": "bacapp.notify_type",
    "RestartReason": "bacapp.restart_reason",
}


def _held(value: Any, about: int | None, found: dict[str, list[Value]], depth: int) -> None:
    """The value of a property."""
    if about == _PRESENT_VALUE:
        kind = _kind(value)
        if kind is not None:
            _add(found, f"bacapp.present_value.{kind[0]}", kind[1])
    elif about == _VENDOR_IDENTIFIER and isinstance(value, int):
        _add(found, "bacapp.vendor_identifier", int(value))
    elif about == _OBJECT_NAME and isinstance(value, str):
        _add(found, "bacapp.object_name", escape(value))
    _value(value, about, found, depth)


def _kind(value: Any) -> tuple[str, Value] | None:
    if value is None:
        return "null", "NULL"
    if isinstance(value, bool):
        return "boolean", int(value)
    if isinstance(value, int):
        return "int" if isinstance(value, Signed) else "uint", int(value)
    if isinstance(value, float):
        return "double" if isinstance(value, Double) else "real", float(value)
    if isinstance(value, bytes):
        return "octet_string", value.hex()
    if isinstance(value, str):
        return "char_string", escape(value)
    if isinstance(value, BitString):
        return "bit_string", "".join("T" if bit else "F" for bit in value.bits)
    if isinstance(value, Enumerated):
        return "enum_index", value.value
    if isinstance(value, (Date, Time)):
        return type(value).__name__.lower(), value.plain
    return ("object_id", str(value)) if isinstance(value, ObjectId) else None


def _tag(tag: Tag, found: dict[str, list[Value]], depth: int) -> None:
    """Objects among tags whose meaning is not known."""
    if tag.children is not None:
        for child in tag.children:
            _tag(child, found, depth + 1)
    elif not tag.context and tag.number == 12 and len(tag.octets) == 4:
        _value(ObjectId.unpack(tag.octets), None, found, depth)
