"""The types of the fields of Modbus: what `fields.py` may give."""

from __future__ import annotations

from dataclasses import replace

from dissectors.field_types import FieldType, FieldTypes, Kind, named, station, table, texts, whole
from dissectors.frame import Flaw
from dissectors.modbus.functions import DIAGNOSTICS, EXCEPTIONS, FUNCTIONS, MEI_TYPES
from dissectors.modbus.layout import DEVICE_ID_CODES, DEVICE_ID_OBJECTS, MESSAGES, SUB_FUNCTIONS
from dissectors.modbus.notation import Field, Means, Message

_WIRESHARK = {
    "Get Comm. Event Counters": 11,
    "Get Comm. Event Log": 12,
    "Report Slave ID": 17,
    "Read Write Register": 23,
    "Read Write Multiple Registers": 23,
    "Encapsulated Interface Transport": 43,
}
"""Names that Wireshark has for functions, where ours differ."""

_EXCEPTIONS = {
    "slave device failure": 4,
    "slave device busy": 6,
    "gateway target device failed to respond": 11,
}

_SAYS = """
func_code number7 function code, without the exception bit
exception_code number8 why a request was refused
data octets octets of which no field says more
reference_num number16 first register, coil or reference named
read_reference_num number16 first register read
write_reference_num number16 first register written
reference_num_32 number32 file number
reference_type number8 6 for a file record
word_cnt number16 registers asked for or written
read_word_cnt number16 registers read
write_word_cnt number16 registers written
bit_cnt number16 coils or inputs asked for or written
byte_cnt number8 octets that follow
byte_cnt_16 number16 octets that follow
regnum16 number16 number of each register
regval_uint16 number16 value of each register
bitnum number16 number of each coil or input
bitval truth state of each coil or input
event octets
and_mask number16
or_mask number16
diagnostic_code number16 sub-function of diagnostics
mei number8 encapsulated interface
read_device_id number8 which objects are asked for
object_id number8 object of the device identification
num_objects number8
objects_len number8
conformity_level number8
more_follows number8
next_object_id number8
object_str_value text
object_value octets
repaired text what was wrong with a damaged frame that could be read all the same
"""


_UNIT = station(says="station spoken to, or that answers")
_CHECK: dict[str, int | str] = {"Bad": 0, "Good": 1}
"""Wireshark's words for the state of a check."""


def rtu_types() -> FieldTypes:
    """By name, of RTU."""
    envelope = {
        "mbrtu.unit_id": replace(_UNIT, octet=0),
        "mbrtu.crc16": whole(16, "check as sent"),
        "mbrtu.crc16.status": FieldType(Kind.TRUTH, "whether the check is right", _CHECK),
    }
    common = dict(_common())
    common["modbus.func_code"] = replace(common["modbus.func_code"], octet=1, mask=0x7F)
    return {**envelope, **common}


def ascii_types() -> FieldTypes:
    """By name, of ASCII."""
    return {
        "mbascii.unit_id": _UNIT,
        "mbascii.lrc": whole(8, "check as sent"),
        "mbascii.lrc.status": FieldType(Kind.TRUTH, "whether the check is right", _CHECK),
        **_common(),
    }


def _common() -> FieldTypes:
    found = table("modbus.", _SAYS)
    for messages in MESSAGES.values():
        for message in (messages.request, messages.response):
            _of_message(found, message)
    for sub in SUB_FUNCTIONS.values():
        for one in (sub.data, sub.counter):
            if one is None or not one.wireshark:
                continue
            if one.means is Means.OCTETS:
                for end in ("request", "echo"):
                    found[f"modbus.{one.wireshark}.{end}"] = FieldType(Kind.OCTETS, sub.name)
            else:
                found.setdefault(f"modbus.{one.wireshark}", whole(8 * one.size, sub.name))
    words = {
        "func_code": named({code: one.name for code, one in FUNCTIONS.items()}, _WIRESHARK),
        "exception_code": named(EXCEPTIONS, _EXCEPTIONS),
        "diagnostic_code": named(DIAGNOSTICS),
        "mei": named(MEI_TYPES),
        "read_device_id": named(DEVICE_ID_CODES),
        "object_id": named(DEVICE_ID_OBJECTS),
        "repaired": texts(flaw.value for flaw in Flaw),
    }
    for name, known in words.items():
        found[f"modbus.{name}"] = replace(found[f"modbus.{name}"], words=known)
    found["modbus.repaired"] = replace(found["modbus.repaired"], closed=True)
    found["modbus.event"] = whole(8, "entry of the event log")
    found["modbus.object_str_value"] = FieldType(Kind.TEXT, "an object of the device identification, as text")
    for name in ("modbus.regnum16", "modbus.bitnum"):
        found[name] = replace(found[name], by_request=True)
    kinds = texts((*(one.name for one in FUNCTIONS.values()), *MEI_TYPES.values()))
    return {
        **found,
        "kind": FieldType(Kind.TEXT, "what a frame is", {**kinds, "unknown": "unknown"}, True, r"function-0x[0-9a-f]+"),
        "func": whole(7, "function code", words["func_code"]),
        "addr": station(),
        "register": whole(16),
        "count": whole(16),
        "error": FieldType(Kind.TEXT, words=texts(dict.fromkeys((*EXCEPTIONS.values(), *_EXCEPTIONS)))),
    }


def _of_message(found: dict[str, FieldType], message: Message) -> None:
    for one in message:
        if isinstance(one, Field):
            if one.wireshark and f"modbus.{one.wireshark}" not in found:
                found[f"modbus.{one.wireshark}"] = whole(8 * one.size)
            _of_message(found, one.group or ())
