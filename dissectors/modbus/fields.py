"""Field names and values for filters, `-T fields` and JSON: Wireshark's names where Wireshark has the field.

A layout is a row of steps, each a name and how many octets it takes; the walk ends where the frame does, so a cut
frame gives the fields that are there. A field that repeats (registers, objects) has its values joined by commas.
Wireshark has no Modbus ASCII: there the envelope's fields are `mbascii.*`.
"""

from __future__ import annotations

from collections.abc import Callable

from dissectors.frame import Check, Frame, Role
from dissectors.modbus.adu import ASCII_NAME, ascii_check, readable, readable_adu, rtu_check
from dissectors.modbus.functions import EXCEPTION_BIT, FUNCTIONS
from dissectors.modbus.header import peek_ascii, peek_rtu
from dissectors.modbus.text import printable

Value = int | float | str
Fields = dict[str, Value]
Step = tuple[str, int]  # field name after "modbus.", octets
Layout = tuple[Step, ...]

_NUMBERED = "regnum16"
_DIAGNOSTIC_FIELDS = {
    0x01: ("restart_communication_option", 2),
    0x03: ("ascii_input_delimiter", 1),
    0x0A: ("clear_ctr_diag_reg", 2),
}
_DIAGNOSTIC_ANSWERS = {
    0x02: "return_diag_register",
    0x0B: "bus_message_count",
    0x0C: "bus_comm_error_count",
    0x0D: "bus_exception_error_count",
    0x0E: "slave_message_count",
    0x0F: "no_slave_response_count",
    0x10: "slave_nak_count",
    0x11: "slave_busy_count",
    0x12: "bus_char_overrun_count",
}


def fields(frame: Frame, role: Role) -> Fields:
    """The fields of a frame in frame order; role as the tracker gave it. Total."""
    is_ascii = frame.protocol == ASCII_NAME
    envelope = "mbascii" if is_ascii else "mbrtu"
    found: Fields = {}
    octets = readable_adu(frame)
    if octets:
        found[f"{envelope}.unit_id"] = octets[0]
    if len(octets) > 1:
        if role in (Role.EITHER, Role.UNKNOWN):
            role = (peek_ascii if is_ascii else peek_rtu)(readable(frame)).role
        _pdu(found, octets, role)
    check = ascii_check(frame) if is_ascii else rtu_check(frame)
    if check is not None and frame.check is not Check.ABSENT:
        name = "mbascii.lrc" if is_ascii else "mbrtu.crc16"
        found[name] = check[0]
        found[f"{name}.status"] = int(check[0] == check[1])
    if frame.repair is not None:
        found["modbus.repaired"] = frame.repair.flaw.value
    return found


def _pdu(found: Fields, octets: bytes, role: Role) -> None:
    code = octets[1]
    _put(found, "func_code", code & ~EXCEPTION_BIT)
    at = 2
    if code & EXCEPTION_BIT:
        at = _walk(found, octets, 2, (("exception_code", 1),))
    elif code in FUNCTIONS and role is not Role.UNKNOWN:
        layouts = _RESPONSES if role is Role.RESPONSE else _REQUESTS
        layout, rest = layouts.get(code, ((), _nothing))
        at = rest(found, octets, _walk(found, octets, 2, layout))
    if at < len(octets):
        _put(found, "data", _hex(octets[at:]))


def _put(found: Fields, name: str, value: Value) -> None:
    name = f"modbus.{name}"
    found[name] = f"{found[name]},{value}" if name in found else value


def _hex(octets: bytes) -> str:
    return octets.hex(":")


def _walk(found: Fields, octets: bytes, at: int, layout: Layout) -> int:
    """Put the steps that are wholly there; give where the next begins."""
    for name, size in layout:
        if at + size > len(octets):
            break
        _put(found, name, int.from_bytes(octets[at : at + size], "big"))
        at += size
    return at


def _nothing(found: Fields, octets: bytes, at: int) -> int:
    return at


def _registers(found: Fields, octets: bytes, at: int) -> int:
    """Registers to the end; numbered where the frame itself names the first of them."""
    count = (len(octets) - at) // 2
    first = found.get("modbus.reference_num")
    if count and isinstance(first, int):
        found[f"modbus.{_NUMBERED}"] = ",".join(str(first + i) for i in range(count)) if count > 1 else first
    values = [octets[i] << 8 | octets[i + 1] for i in range(at, at + 2 * count, 2)]
    if values:
        found["modbus.regval_uint16"] = ",".join(map(str, values)) if count > 1 else values[0]
    return at + 2 * count


def _value(found: Fields, octets: bytes, at: int) -> int:
    """One register written: Wireshark gives octets only; the number is what one filters on."""
    if at + 2 <= len(octets):
        _put(found, "data", _hex(octets[at : at + 2]))
        _put(found, "regval_uint16", octets[at] << 8 | octets[at + 1])
        return at + 2
    return at


def _bits(found: Fields, octets: bytes, at: int) -> int:
    """Bits of the answer in address order, unused ones of the last octet too, as Wireshark has them."""
    values = [octets[i] >> bit & 1 for i in range(at, len(octets)) for bit in range(8)]
    if values:
        found["modbus.bitval"] = ",".join(map(str, values))
    return len(octets)


def _diagnostics(found: Fields, octets: bytes, at: int, answer: bool = False) -> int:
    sub = int.from_bytes(octets[2:4], "big")
    if sub == 0:
        if at < len(octets):
            _put(found, f"diagnostic.return_query_data.{'echo' if answer else 'request'}", _hex(octets[at:]))
        return len(octets)
    if sub in _DIAGNOSTIC_FIELDS:
        name, size = _DIAGNOSTIC_FIELDS[sub]
        after = _walk(found, octets, at, ((f"diagnostic.{name}", size),))
        return after + 1 if size == 1 and octets[after : after + 1] == b"\0" else after
    if answer and sub in _DIAGNOSTIC_ANSWERS:
        return _walk(found, octets, at, ((f"diagnostic.{_DIAGNOSTIC_ANSWERS[sub]}", 2),))
    return at


def _diagnostics_answer(found: Fields, octets: bytes, at: int) -> int:
    return _diagnostics(found, octets, at, answer=True)


def _events(found: Fields, octets: bytes, at: int) -> int:
    for octet in octets[at:]:
        _put(found, "event", octet)
    return len(octets)


_GROUP: Layout = (("reference_type", 1), ("reference_num_32", 4), ("word_cnt", 2))


def _file_requests(found: Fields, octets: bytes, at: int) -> int:
    while at + 7 <= len(octets):
        at = _walk(found, octets, at, _GROUP)
    return at


def _file_writes(found: Fields, octets: bytes, at: int) -> int:
    while at + 7 <= len(octets):
        size = 2 * (octets[at + 5] << 8 | octets[at + 6])
        at = _walk(found, octets, at, _GROUP)
        if octets[at : at + size]:
            _put(found, "data", _hex(octets[at : at + size]))
        at = min(at + size, len(octets))
    return at


def _file_answers(found: Fields, octets: bytes, at: int) -> int:
    while at + 2 <= len(octets) and octets[at]:
        end = min(at + 1 + octets[at], len(octets))
        at = _walk(found, octets, at, (("byte_cnt", 1), ("reference_type", 1)))
        if octets[at:end]:
            _put(found, "data", _hex(octets[at:end]))
        at = max(at, end)
    return at


def _identification_request(found: Fields, octets: bytes, at: int) -> int:
    return _walk(found, octets, at, (("read_device_id", 1), ("object_id", 1))) if octets[2:3] == b"\x0e" else at


def _identification(found: Fields, octets: bytes, at: int) -> int:
    if octets[2:3] != b"\x0e":
        return at
    at = _walk(found, octets, at, _IDENTIFICATION)
    while at + 2 <= len(octets):
        size = octets[at + 1]
        at = _walk(found, octets, at, (("object_id", 1), ("objects_len", 1)))
        _put(found, "object_str_value", printable(octets[at : at + size]))
        at = min(at + size, len(octets))
    return at


_IDENTIFICATION: Layout = (
    ("read_device_id", 1),
    ("conformity_level", 1),
    ("more_follows", 1),
    ("next_object_id", 1),
    ("num_objects", 1),
)
_BIT_RANGE: Layout = (("reference_num", 2), ("bit_cnt", 2))
_WORD_RANGE: Layout = (("reference_num", 2), ("word_cnt", 2))
_BYTES: Layout = (("byte_cnt", 1),)
_REFERENCE: Layout = (("reference_num", 2),)
_MASK: Layout = (("reference_num", 2), ("and_mask", 2), ("or_mask", 2))
_SUB: Layout = (("diagnostic_code", 2),)
_MEI: Layout = (("mei", 1),)
_STATUS: Layout = (("ev_status", 2), ("ev_count", 2))
_READ_WRITE: Layout = (
    ("read_reference_num", 2),
    ("read_word_cnt", 2),
    ("write_reference_num", 2),
    ("write_word_cnt", 2),
    ("byte_cnt", 1),
)

Rest = Callable[[Fields, bytes, int], int]

_REQUESTS: dict[int, tuple[Layout, Rest]] = {
    0x01: (_BIT_RANGE, _nothing),
    0x02: (_BIT_RANGE, _nothing),
    0x03: (_WORD_RANGE, _nothing),
    0x04: (_WORD_RANGE, _nothing),
    0x05: (_REFERENCE, _nothing),
    0x06: (_REFERENCE, _value),
    0x08: (_SUB, _diagnostics),
    0x0F: (_BIT_RANGE + _BYTES, _nothing),
    0x10: (_WORD_RANGE + _BYTES, _registers),
    0x14: (_BYTES, _file_requests),
    0x15: (_BYTES, _file_writes),
    0x16: (_MASK, _nothing),
    0x17: (_READ_WRITE, _registers),
    0x18: (_REFERENCE, _nothing),
    0x2B: (_MEI, _identification_request),
}

_RESPONSES: dict[int, tuple[Layout, Rest]] = {
    0x01: (_BYTES, _bits),
    0x02: (_BYTES, _bits),
    0x03: (_BYTES, _registers),
    0x04: (_BYTES, _registers),
    0x05: (_REFERENCE, _nothing),
    0x06: (_REFERENCE, _value),
    0x08: (_SUB, _diagnostics_answer),
    0x0B: (_STATUS, _nothing),
    0x0C: (_BYTES + _STATUS + (("ev_msg_count", 2),), _events),
    0x0F: (_BIT_RANGE, _nothing),
    0x10: (_WORD_RANGE, _nothing),
    0x14: (_BYTES, _file_answers),
    0x15: (_BYTES, _file_writes),
    0x16: (_MASK, _nothing),
    0x17: (_BYTES, _registers),
    0x18: ((("byte_cnt_16", 2), ("word_cnt", 2)), _registers),
    0x2B: (_MEI, _identification),
}
