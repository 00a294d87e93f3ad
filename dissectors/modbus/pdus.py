"""The PDUs of Modbus as scapy packets: the full layout of every message, to look at one and to craft one.

    bytes(ReadHoldingRegistersRequest(startAddr=0x2520, quantity=2))  ==  bytes.fromhex("0325200002")

Layouts and field names are those of `scapy.contrib.modbus` where they are right. Ours, with the same names, are those
that it lacks or that lose octets there (scapy 2.8): lists of over 100 coils or registers (it raises), a write-file
request (cannot be built again), the server id (cannot be read), the event log (fixed count), the exception status
(named startAddr), diagnostics with an odd octet, exceptions (no vendor codes, two names for the code).

A message cut short has the fields that are there and the rest as `Cut`; octets too many are `Raw`. Nothing is lost:
`bytes(packet)` gives back what was dissected.
"""

from __future__ import annotations

import struct
from typing import Any, ClassVar

from scapy.contrib import modbus as contrib
from scapy.fields import (
    BitFieldLenField,
    ByteEnumField,
    ByteField,
    Field,
    FieldListField,
    StrField,
    StrLenField,
    XByteField,
    XShortEnumField,
    XShortField,
)
from scapy.packet import Packet, Raw

from dissectors.modbus.functions import DIAGNOSTICS, EXCEPTION_BIT, EXCEPTIONS
from dissectors.modbus.header import kind_of


class Cut(Raw):
    """What remains of a message that ends in the middle of a field."""

    name = "Cut short"


class Pdu(Packet):
    """Dissects as far as the octets go, and keeps those that follow."""

    def do_dissect(self, s: bytes) -> bytes:
        read = []
        for field in self.fields_desc:
            try:
                s, self.fields[field.name] = field.getfield(self, s)
            except (struct.error, IndexError):
                break
            read.append(field)
        if len(read) < len(self.fields_desc):
            object.__setattr__(self, "fields_desc", read)  # a field that is not there has no value to show
        self.explicit = 1
        return s

    def extract_padding(self, s: bytes) -> tuple[bytes, None]:
        return s, None

    def guess_payload_class(self, payload: bytes) -> type[Packet]:
        return Cut if len(self.fields_desc) < len(type(self).fields_desc) else Raw


def _list(name: str, item: Field, count: Any) -> FieldListField:
    return _WholeItems(name, [], item, count_from=count)


class _WholeItems(FieldListField):
    """A list of any length that leaves half an item, at the end of a cut message, to what follows."""

    def getfield(self, pkt: Packet, s: bytes) -> tuple[bytes, list[int]]:
        size = struct.calcsize(self.field.fmt)
        there = len(s) // size
        wanted = there if self.count_from is None else min(there, self.count_from(pkt))
        values = [self.field.getfield(pkt, s[i * size : (i + 1) * size])[1] for i in range(wanted)]
        return s[wanted * size :], values


def _octets(name: str, count: Any = None) -> FieldListField:
    return _list(name, XByteField("", 0), count)


def _registers(name: str, count: Any = None) -> FieldListField:
    return _list(name, XShortField("", 0), count)


def _byte_count(of: str, size: int, more: int = 0) -> BitFieldLenField:
    """A byte count computed from a list of items of `size` octets, `more` octets on top."""
    return BitFieldLenField("byteCount", None, 8, count_of=of, adjust=lambda pkt, n: n * size + more)


def _pdu(name: str, *layout: Any) -> Any:
    """A message without groups: a class named like it, without the blanks. A class of scapy's gives its fields."""
    class_name = name.replace(" ", "").replace("/", "").replace("ID", "Id").replace("FIFO", "Fifo")
    return type(class_name, (Pdu,), {"name": name, "fields_desc": list(layout)})


def _code(code: int) -> XByteField:
    return XByteField("funcCode", code)


def _bits_read(code: int, name: str) -> tuple[Any, ...]:
    return _code(code), _byte_count(name, 1), _octets(name, lambda pkt: pkt.byteCount)


def _registers_read(code: int) -> tuple[Any, ...]:
    return _code(code), _byte_count("registerVal", 2), _registers("registerVal", lambda pkt: pkt.byteCount // 2)


_DIAGNOSTICS = (_code(8), XShortEnumField("subFunc", 0, dict(DIAGNOSTICS)), _registers("data"))

# --- bits and registers

ReadCoilsRequest = _pdu("Read Coils Request", contrib.ModbusPDU01ReadCoilsRequest)
ReadCoilsResponse = _pdu("Read Coils Response", *_bits_read(1, "coilStatus"))
ReadDiscreteInputsRequest = _pdu("Read Discrete Inputs Request", contrib.ModbusPDU02ReadDiscreteInputsRequest)
ReadDiscreteInputsResponse = _pdu("Read Discrete Inputs Response", *_bits_read(2, "inputStatus"))
ReadHoldingRegistersRequest = _pdu("Read Holding Registers Request", contrib.ModbusPDU03ReadHoldingRegistersRequest)
ReadHoldingRegistersResponse = _pdu("Read Holding Registers Response", *_registers_read(3))
ReadInputRegistersRequest = _pdu("Read Input Registers Request", contrib.ModbusPDU04ReadInputRegistersRequest)
ReadInputRegistersResponse = _pdu("Read Input Registers Response", *_registers_read(4))
WriteSingleCoilRequest = _pdu("Write Single Coil Request", contrib.ModbusPDU05WriteSingleCoilRequest)
WriteSingleCoilResponse = _pdu("Write Single Coil Response", contrib.ModbusPDU05WriteSingleCoilResponse)
WriteSingleRegisterRequest = _pdu("Write Single Register Request", contrib.ModbusPDU06WriteSingleRegisterRequest)
WriteSingleRegisterResponse = _pdu("Write Single Register Response", contrib.ModbusPDU06WriteSingleRegisterResponse)
WriteMultipleCoilsRequest = _pdu(
    "Write Multiple Coils Request",
    _code(15),
    XShortField("startAddr", 0),
    XShortField("quantityOutput", 1),
    _byte_count("outputsValue", 1),
    _octets("outputsValue", lambda pkt: pkt.byteCount),
)
WriteMultipleCoilsResponse = _pdu("Write Multiple Coils Response", contrib.ModbusPDU0FWriteMultipleCoilsResponse)
WriteMultipleRegistersRequest = _pdu(
    "Write Multiple Registers Request",
    _code(16),
    XShortField("startAddr", 0),
    BitFieldLenField("quantityRegisters", None, 16, count_of="outputsValue"),
    _byte_count("outputsValue", 2),
    _registers("outputsValue", lambda pkt: pkt.byteCount // 2),
)
WriteMultipleRegistersResponse = _pdu(
    "Write Multiple Registers Response", contrib.ModbusPDU10WriteMultipleRegistersResponse
)
MaskWriteRegisterRequest = _pdu("Mask Write Register Request", contrib.ModbusPDU16MaskWriteRegisterRequest)
MaskWriteRegisterResponse = _pdu("Mask Write Register Response", contrib.ModbusPDU16MaskWriteRegisterResponse)
ReadWriteMultipleRegistersRequest = _pdu(
    "Read/Write Multiple Registers Request",
    _code(23),
    XShortField("readStartingAddr", 0),
    XShortField("readQuantityRegisters", 1),
    XShortField("writeStartingAddr", 0),
    BitFieldLenField("writeQuantityRegisters", None, 16, count_of="writeRegistersValue"),
    _byte_count("writeRegistersValue", 2),
    _registers("writeRegistersValue", lambda pkt: pkt.byteCount // 2),
)
ReadWriteMultipleRegistersResponse = _pdu("Read/Write Multiple Registers Response", *_registers_read(23))
ReadFifoQueueRequest = _pdu("Read FIFO Queue Request", contrib.ModbusPDU18ReadFIFOQueueRequest)
ReadFifoQueueResponse = _pdu("Read FIFO Queue Response", contrib.ModbusPDU18ReadFIFOQueueResponse)

# --- serial line functions

ReadExceptionStatusRequest = _pdu("Read Exception Status Request", contrib.ModbusPDU07ReadExceptionStatusRequest)
ReadExceptionStatusResponse = _pdu("Read Exception Status Response", _code(7), XByteField("status", 0))
DiagnosticsRequest = _pdu("Diagnostics Request", *_DIAGNOSTICS)
DiagnosticsResponse = _pdu("Diagnostics Response", *_DIAGNOSTICS)
GetCommEventCounterRequest = _pdu("Get Comm Event Counter Request", contrib.ModbusPDU0BGetCommEventCounterRequest)
GetCommEventCounterResponse = _pdu("Get Comm Event Counter Response", contrib.ModbusPDU0BGetCommEventCounterResponse)
GetCommEventLogRequest = _pdu("Get Comm Event Log Request", contrib.ModbusPDU0CGetCommEventLogRequest)
GetCommEventLogResponse = _pdu(
    "Get Comm Event Log Response",
    _code(12),
    _byte_count("event", 1, more=6),
    XShortField("status", 0),
    XShortField("eventCount", 0),
    XShortField("messageCount", 0),
    _octets("event", lambda pkt: max(0, pkt.byteCount - 6)),
)
ReportServerIdRequest = _pdu("Report Server ID Request", contrib.ModbusPDU11ReportSlaveIdRequest)
# identifier, run indicator and more are in one string: only the vendor knows where each ends
ReportServerIdResponse = _pdu(
    "Report Server ID Response",
    _code(17),
    BitFieldLenField("byteCount", None, 8, length_of="serverId"),
    StrLenField("serverId", b"", length_from=lambda pkt: pkt.byteCount),
)


# --- files


class FileRecordRequest(Pdu):
    """One group of a read file record request; groups follow each other as payloads."""

    name = "Record asked for"
    fields_desc: ClassVar = [contrib.ModbusReadFileSubRequest]

    def guess_payload_class(self, payload: bytes) -> type[Packet]:
        return FileRecordRequest if len(payload) >= 7 else super().guess_payload_class(payload)


class FileRecord(Pdu):
    """One group of a read file record response."""

    name = "Record read"
    fields_desc: ClassVar = [
        BitFieldLenField("respLength", None, 8, count_of="recData", adjust=lambda pkt, n: 2 * n + 1),
        ByteField("refType", 6),
        _registers("recData", lambda pkt: max(0, pkt.respLength - 1) // 2),
    ]

    def guess_payload_class(self, payload: bytes) -> type[Packet]:
        return FileRecord if len(payload) >= 2 else super().guess_payload_class(payload)


class FileRecordWrite(Pdu):
    """One group of a write file record request or response."""

    name = "Record written"
    fields_desc: ClassVar = [
        ByteField("refType", 6),
        XShortField("fileNumber", 1),
        XShortField("recordNumber", 0),
        BitFieldLenField("recordLength", None, 16, count_of="recordData"),
        _registers("recordData", lambda pkt: pkt.recordLength),
    ]

    def guess_payload_class(self, payload: bytes) -> type[Packet]:
        return FileRecordWrite if len(payload) >= 7 else super().guess_payload_class(payload)


class _FileMessage(Pdu):
    """Function code and the octets of all groups; the count is computed when None."""

    group: type[Packet] = Raw

    def guess_payload_class(self, payload: bytes) -> type[Packet]:
        return self.group

    def post_build(self, pkt: bytes, pay: bytes) -> bytes:
        if len(self.fields_desc) > 1 and self.byteCount is None:
            pkt = pkt[:1] + bytes((len(pay) & 0xFF,))
        return pkt + pay


class ReadFileRecordRequest(_FileMessage):
    name = "Read File Record Request"
    fields_desc: ClassVar = [_code(20), ByteField("byteCount", None)]
    group = FileRecordRequest


class ReadFileRecordResponse(_FileMessage):
    name = "Read File Record Response"
    fields_desc: ClassVar = [_code(20), ByteField("byteCount", None)]
    group = FileRecord


class WriteFileRecordRequest(_FileMessage):
    name = "Write File Record Request"
    fields_desc: ClassVar = [_code(21), ByteField("byteCount", None)]
    group = FileRecordWrite


class WriteFileRecordResponse(WriteFileRecordRequest):
    name = "Write File Record Response"


# --- encapsulated interfaces, exceptions, the unknown

ReadDeviceIdentificationRequest = _pdu(
    "Read Device Identification Request", contrib.ModbusPDU2B0EReadDeviceIdentificationRequest
)


class IdentificationObject(Pdu):
    name = "Object"
    fields_desc: ClassVar = [contrib.ModbusObjectId]

    def guess_payload_class(self, payload: bytes) -> type[Packet]:
        return IdentificationObject if len(payload) >= 2 else super().guess_payload_class(payload)


class ReadDeviceIdentificationResponse(Pdu):
    name = "Read Device Identification Response"
    fields_desc: ClassVar = [contrib.ModbusPDU2B0EReadDeviceIdentificationResponse]

    def guess_payload_class(self, payload: bytes) -> type[Packet]:
        whole = len(self.fields_desc) == len(type(self).fields_desc)
        return IdentificationObject if whole and self.objCount else super().guess_payload_class(payload)


class EncapsulatedInterface(Pdu):
    """Function 43 with another MEI type than 14, either direction."""

    name = "Encapsulated Interface"
    fields_desc: ClassVar = [_code(43), XByteField("MEIType", 13), StrField("data", b"")]


class ExceptionResponse(Pdu):
    """Function code with bit 7 set, and why. Codes that the standard does not name are a vendor's."""

    name = "Exception Response"
    fields_desc: ClassVar = [
        ByteEnumField("funcCode", 0x83, {c | EXCEPTION_BIT: f"exception of {kind_of(c)}" for c in range(128)}),
        ByteEnumField("exceptCode", 1, {c: EXCEPTIONS.get(c) or f"vendor 0x{c:02X}" for c in range(256)}),
    ]


class OtherFunction(Pdu):
    """A function code that no table knows, or a message whose length fits neither direction."""

    name = "Other Function"
    fields_desc: ClassVar = [XByteField("funcCode", 0x41), StrField("data", b"")]


def _by_code(*classes: Any) -> dict[int, Any]:
    return {cls.fields_desc[0].default: cls for cls in classes}


REQUESTS = _by_code(
    ReadCoilsRequest,
    ReadDiscreteInputsRequest,
    ReadHoldingRegistersRequest,
    ReadInputRegistersRequest,
    WriteSingleCoilRequest,
    WriteSingleRegisterRequest,
    ReadExceptionStatusRequest,
    DiagnosticsRequest,
    GetCommEventCounterRequest,
    GetCommEventLogRequest,
    WriteMultipleCoilsRequest,
    WriteMultipleRegistersRequest,
    ReportServerIdRequest,
    ReadFileRecordRequest,
    WriteFileRecordRequest,
    MaskWriteRegisterRequest,
    ReadWriteMultipleRegistersRequest,
    ReadFifoQueueRequest,
    ReadDeviceIdentificationRequest,
)
RESPONSES = _by_code(
    ReadCoilsResponse,
    ReadDiscreteInputsResponse,
    ReadHoldingRegistersResponse,
    ReadInputRegistersResponse,
    WriteSingleCoilResponse,
    WriteSingleRegisterResponse,
    ReadExceptionStatusResponse,
    DiagnosticsResponse,
    GetCommEventCounterResponse,
    GetCommEventLogResponse,
    WriteMultipleCoilsResponse,
    WriteMultipleRegistersResponse,
    ReportServerIdResponse,
    ReadFileRecordResponse,
    WriteFileRecordResponse,
    MaskWriteRegisterResponse,
    ReadWriteMultipleRegistersResponse,
    ReadFifoQueueResponse,
    ReadDeviceIdentificationResponse,
)


def pdu_class(octets: bytes, response: bool) -> Any:
    """The class of the PDU that begins with these octets, in one direction. Total."""
    if not octets:
        return Raw
    code = octets[0]
    if code & EXCEPTION_BIT:
        return ExceptionResponse
    if code == 43 and octets[1:2] not in (b"\x0e", b""):
        return EncapsulatedInterface
    return (RESPONSES if response else REQUESTS).get(code, OtherFunction)
