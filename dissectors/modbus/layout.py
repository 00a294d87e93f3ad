"""Every message of Modbus, declared once: what stands where, in which order, and which counts must agree.

    MESSAGES[0x10].request
        ADDRESS 2   QUANTITY 2   BYTES 1   REGISTERS …     behind unit(1) function(1), before the check
        │           │            └ octets that follow: twice the quantity
        │           └ 1 … 123
        └ of the first register

A row is one field: what it means, its octets, Wireshark's name for it (behind "modbus."), scapy's, and what its values
are held to. Lengths, plausibility, `peek`, columns, fields, packets, pairing, readings and pseudonyms are made of these
rows; a new function code is a new entry here. A field without Wireshark's name is `modbus.data` there, with all that
follows it. Source: Modbus Application Protocol V1.1b3, clause 6; names of scapy: `scapy.contrib.modbus` 2.8.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Final

from dissectors.modbus.notation import Field, Means, Message, Messages, SubFunction

MAX_READ_BITS: Final = 2000
MAX_WRITE_BITS: Final = 1968
MAX_READ_REGISTERS: Final = 125
MAX_WRITE_REGISTERS: Final = 123
MAX_READ_WRITE_REGISTERS: Final = 121
MAX_FIFO: Final = 31
MAX_EVENTS: Final = 64

MEI_CANOPEN: Final = 0x0D
MEI_DEVICE_IDENTIFICATION: Final = 0x0E
_RECORD: Final = 6
"""The only reference type of a file record."""


def _address(scapy: str, wireshark: str = "reference_num") -> Field:
    return Field(Means.ADDRESS, 2, wireshark, scapy)


def _quantity(scapy: str, most: int, wireshark: str = "word_cnt") -> Field:
    return Field(Means.QUANTITY, 2, wireshark, scapy, range(1, most + 1), default=1)


def _byte_count(least: int, among: Collection[int] | None = None, scapy: str = "byteCount") -> Field:
    return Field(Means.BYTES, 1, "byte_cnt", scapy, among, least)


def _registers(scapy: str, wireshark: str = "regval_uint16") -> Field:
    return Field(Means.REGISTERS, 2, wireshark, scapy)


def _number(size: int, wireshark: str, scapy: str, default: int = 0, names: Mapping[int, str] | None = None) -> Field:
    return Field(Means.NUMBER, size, wireshark, scapy, default=default, names=names)


def _counter(name: str) -> Field:
    return Field(Means.VALUE, 2, f"diagnostic.{name}")


# --- sub-functions and numbers with names ---------------------------------------------------------------------------

_DELIMITER: Final = Field(Means.VALUE, 1, "diagnostic.ascii_input_delimiter")

SUB_FUNCTIONS: Final[Mapping[int, SubFunction]] = {
    0x0000: SubFunction("return query data", Field(Means.OCTETS, 1, "diagnostic.return_query_data")),
    0x0001: SubFunction("restart communications", _counter("restart_communication_option")),
    0x0002: SubFunction("return diagnostic register", counter=_counter("return_diag_register")),
    0x0003: SubFunction("change ascii input delimiter", _DELIMITER),
    0x0004: SubFunction("force listen only mode"),
    0x000A: SubFunction("clear counters and diagnostic register", _counter("clear_ctr_diag_reg")),
    0x000B: SubFunction("return bus message count", counter=_counter("bus_message_count")),
    0x000C: SubFunction("return bus communication error count", counter=_counter("bus_comm_error_count")),
    0x000D: SubFunction("return bus exception error count", counter=_counter("bus_exception_error_count")),
    0x000E: SubFunction("return server message count", counter=_counter("slave_message_count")),
    0x000F: SubFunction("return server no response count", counter=_counter("no_slave_response_count")),
    0x0010: SubFunction("return server nak count", counter=_counter("slave_nak_count")),
    0x0011: SubFunction("return server busy count", counter=_counter("slave_busy_count")),
    0x0012: SubFunction("return bus character overrun count", counter=_counter("bus_char_overrun_count")),
    0x0014: SubFunction("clear overrun counter and flag"),
}
"""Sub-functions of function 08 (V1.1b3, 6.8.1)."""

DEVICE_ID_CODES: Final[Mapping[int, str]] = {1: "basic", 2: "regular", 3: "extended", 4: "one object"}
DEVICE_ID_OBJECTS: Final[Mapping[int, str]] = {
    0x00: "VendorName",
    0x01: "ProductCode",
    0x02: "MajorMinorRevision",
    0x03: "VendorUrl",
    0x04: "ProductName",
    0x05: "ModelName",
    0x06: "UserApplicationName",
}
_CONFORMITY: Final[Mapping[int, str]] = {
    0x01: "basic, stream only",
    0x02: "regular, stream only",
    0x03: "extended, stream only",
    0x81: "basic, stream and individual access",
    0x82: "regular, stream and individual access",
    0x83: "extended, stream and individual access",
}

# --- messages that several functions have ----------------------------------------------------------------------------

_NONE: Final[Message] = ()
_READ_BITS: Final[Message] = (_address("startAddr"), _quantity("quantity", MAX_READ_BITS, "bit_cnt"))
_READ_REGISTERS: Final[Message] = (_address("startAddr"), _quantity("quantity", MAX_READ_REGISTERS))
_REGISTERS_READ: Final[Message] = (_byte_count(1), _registers("registerVal"))
_COIL: Final[Message] = (_address("outputAddr"), Field(Means.VALUE, 2, "", "outputValue", (0x0000, 0xFF00)))
_REGISTER: Final[Message] = (_address("registerAddr"), Field(Means.VALUE, 2, "regval_uint16", "registerValue"))
_MASK: Final[Message] = (
    _address("refAddr"),
    _number(2, "and_mask", "andMask", 0xFFFF),
    _number(2, "or_mask", "orMask"),
)
_DIAGNOSTIC: Final[Message] = (
    Field(
        Means.SELECTOR,
        2,
        "diagnostic_code",
        "subFunc",
        tuple(SUB_FUNCTIONS),
        names={code: sub.name for code, sub in SUB_FUNCTIONS.items()},
    ),
    Field(Means.WORD, 2, "", "data"),
)

# --- groups -----------------------------------------------------------------------------------------------------------

_TYPE: Final = Field(Means.NUMBER, 1, "reference_type", "refType", only=_RECORD, default=_RECORD)
_RECORD_ASKED: Final[Message] = (
    _TYPE,
    _number(2, "reference_num_32", "fileNumber", 1),  # Wireshark has one number of both
    _number(2, "reference_num_32", "recordNumber"),
    Field(Means.QUANTITY, 2, "word_cnt", "recordLength", default=1),
)
_RECORD_READ: Final[Message] = (
    Field(Means.BYTES, 1, "byte_cnt", "respLength", least=1),
    _TYPE,
    _registers("recData", "data"),
)
_RECORD_WRITTEN: Final[Message] = (*_RECORD_ASKED, _registers("recordData", "data"))
_OBJECT: Final[Message] = (
    _number(1, "object_id", "id", names=DEVICE_ID_OBJECTS),
    Field(Means.BYTES, 1, "objects_len", "length"),
    Field(Means.TEXT, 1, "object_str_value", "value"),
)


def _groups(group: Message, group_name: str) -> Field:
    return Field(Means.GROUPS, 0, group=group, group_name=group_name)


_FILE_WRITE: Final[Message] = (_byte_count(9), _groups(_RECORD_WRITTEN, "File Record Write"))
_INTERFACE: Final = Field(
    Means.SELECTOR, 1, "mei", "MEIType", only=MEI_DEVICE_IDENTIFICATION, default=MEI_DEVICE_IDENTIFICATION
)
_ID_CODE: Final = Field(
    Means.NUMBER, 1, "read_device_id", "readCode", tuple(DEVICE_ID_CODES), names=DEVICE_ID_CODES, default=1
)

# --- the table --------------------------------------------------------------------------------------------------------

MESSAGES: Final[Mapping[int, Messages]] = {
    messages.code: messages
    for messages in (
        Messages(
            0x01,
            "read-coils",
            "read coils",
            "Read Coils",
            request=_READ_BITS,
            response=(_byte_count(1), Field(Means.BITS, 1, "bitval", "coilStatus")),
            space="coil",
        ),
        Messages(
            0x02,
            "read-discrete-inputs",
            "read discrete",
            "Read Discrete Inputs",
            request=_READ_BITS,
            response=(_byte_count(1), Field(Means.BITS, 1, "bitval", "inputStatus")),
            space="discrete",
        ),
        Messages(
            0x03,
            "read-holding-registers",
            "read holding",
            "Read Holding Registers",
            request=_READ_REGISTERS,
            response=_REGISTERS_READ,
            space="holding",
        ),
        Messages(
            0x04,
            "read-input-registers",
            "read input",
            "Read Input Registers",
            request=_READ_REGISTERS,
            response=_REGISTERS_READ,
            space="input",
        ),
        Messages(
            0x05,
            "write-single-coil",
            "write coil",
            "Write Single Coil",
            request=_COIL,
            response=_COIL,
            space="coil",
            writes=True,
            echoes=True,
        ),
        Messages(
            0x06,
            "write-single-register",
            "write register",
            "Write Single Register",
            request=_REGISTER,
            response=_REGISTER,
            space="holding",
            writes=True,
            echoes=True,
        ),
        Messages(
            0x07,
            "read-exception-status",
            "exception status",
            "Read Exception Status",
            request=_NONE,
            response=(_number(1, "", "status"),),
        ),
        Messages(0x08, "diagnostics", "diagnostics", "Diagnostics", _DIAGNOSTIC, _DIAGNOSTIC, repeats=1),
        Messages(
            0x0B,
            "get-comm-event-counter",
            "event counter",
            "Get Comm Event Counter",
            request=_NONE,
            response=(_number(2, "ev_status", "status"), _number(2, "ev_count", "eventCount")),
        ),
        Messages(
            0x0C,
            "get-comm-event-log",
            "event log",
            "Get Comm Event Log",
            request=_NONE,
            response=(
                _byte_count(6, range(6, 6 + MAX_EVENTS + 1)),
                _number(2, "ev_status", "status"),
                _number(2, "ev_count", "eventCount"),
                _number(2, "ev_msg_count", "messageCount"),
                Field(Means.OCTETS, 1, "event", "event"),
            ),
        ),
        Messages(
            0x0F,
            "write-multiple-coils",
            "write coils",
            "Write Multiple Coils",
            request=(
                _address("startAddr"),
                _quantity("quantityOutput", MAX_WRITE_BITS, "bit_cnt"),
                _byte_count(1),
                Field(Means.BITS, 1, "", "outputsValue"),
            ),
            response=(_address("startAddr"), _quantity("quantityOutput", MAX_WRITE_BITS, "bit_cnt")),
            space="coil",
            writes=True,
            repeats=2,
        ),
        Messages(
            0x10,
            "write-multiple-registers",
            "write registers",
            "Write Multiple Registers",
            request=(
                _address("startAddr"),
                _quantity("quantityRegisters", MAX_WRITE_REGISTERS),
                _byte_count(2),
                _registers("outputsValue"),
            ),
            response=(_address("startAddr"), _quantity("quantityRegisters", MAX_WRITE_REGISTERS)),
            space="holding",
            writes=True,
            repeats=2,
        ),
        Messages(
            0x11,
            "report-server-id",
            "server id",
            "Report Server ID",
            request=_NONE,
            response=(Field(Means.BYTES, 1, "", "byteCount", least=1), Field(Means.TEXT, 1, "", "serverId")),
        ),
        Messages(
            0x14,
            "read-file-record",
            "read file",
            "Read File Record",
            request=(_byte_count(7), _groups(_RECORD_ASKED, "File Record Request")),
            response=(_byte_count(2), _groups(_RECORD_READ, "File Record")),
        ),
        Messages(
            0x15,
            "write-file-record",
            "write file",
            "Write File Record",
            request=_FILE_WRITE,
            response=_FILE_WRITE,
            writes=True,
            echoes=True,
        ),
        Messages(
            0x16,
            "mask-write-register",
            "mask write",
            "Mask Write Register",
            request=_MASK,
            response=_MASK,
            writes=True,
            echoes=True,
        ),
        Messages(
            0x17,
            "read-write-multiple-registers",
            "read/write registers",
            "Read/Write Multiple Registers",
            request=(
                _address("readStartingAddr", "read_reference_num"),
                _quantity("readQuantityRegisters", MAX_READ_REGISTERS, "read_word_cnt"),
                _address("writeStartingAddr", "write_reference_num"),
                _quantity("writeQuantityRegisters", MAX_READ_WRITE_REGISTERS, "write_word_cnt"),
                _byte_count(2),
                _registers("writeRegistersValue"),
            ),
            response=_REGISTERS_READ,
            space="holding",
        ),
        Messages(
            0x18,
            "read-fifo-queue",
            "read fifo",
            "Read FIFO Queue",
            request=(_address("FIFOPointerAddr"),),
            response=(
                Field(Means.BYTES, 2, "byte_cnt_16", "byteCount", least=2),
                Field(Means.QUANTITY, 2, "word_cnt", "FIFOCount", range(MAX_FIFO + 1)),
                _registers("FIFOVal"),
            ),
        ),
        Messages(
            0x2B,
            "encapsulated-interface",
            "device id",
            "Read Device Identification",
            request=(_INTERFACE, _ID_CODE, Field(Means.ADDRESS, 1, "object_id", "objectId", names=DEVICE_ID_OBJECTS)),
            response=(
                _INTERFACE,
                _ID_CODE,
                _number(1, "conformity_level", "conformityLevel", 1, _CONFORMITY),
                _number(1, "more_follows", "more", names={0: "no", 1: "yes"}),
                _number(1, "next_object_id", "nextObjId", names=DEVICE_ID_OBJECTS),
                Field(Means.QUANTITY, 1, "num_objects", "objCount"),
                _groups(_OBJECT, "Identification Object"),
            ),
            repeats=1,
        ),
    )
}
"""By function code."""
