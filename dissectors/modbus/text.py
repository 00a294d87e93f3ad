"""One line for the frame list: `1 ← read holding 0x2520 ×2`, `1 → 2 registers: 9504 9505`, `1 → exception: …`.

`←` goes to the unit, `→` comes from it, `↔` could be either. Addresses are as on the wire (from 0), in hex.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from dissectors.findings import counted
from dissectors.frame import Check, Damage, Frame, Header, Role
from dissectors.modbus.envelope import ASCII_NAME, ascii_check, readable_adu, rtu_check
from dissectors.modbus.functions import DIAGNOSTICS, EXCEPTION_BIT, FUNCTIONS
from dissectors.modbus.header import NO_EXCEPTIONS, code_number, exception_name, kind_of
from dissectors.modbus.layout import DEVICE_ID_CODES, DEVICE_ID_OBJECTS

if TYPE_CHECKING:
    from dissectors.meaning import Meaning

_MOST_REGISTERS = 10
_MOST_BITS = 32
_MOST_OCTETS = 16
_EXCEPTION = 3
"""Unit, function and code."""

_ARROWS = {Role.RESPONSE: "→", Role.REQUEST: "←", Role.BROADCAST: "←"}


def text(frame: Frame, header: Header, role: Role) -> str:
    """One line about a frame, free of control characters and braces; role as the tracker gave it. Total."""
    return _line(frame, header, role, None)


def meant(frame: Frame, header: Header, role: Role, meaning: Meaning) -> str:
    """The same, what it means to its device first: `3 → output frequency 30.00 Hz — 1 register: 3000`. Total."""
    return _line(frame, header, role, meaning)


def _line(frame: Frame, header: Header, role: Role, meaning: Meaning | None) -> str:
    octets = readable_adu(frame)
    damage = f" [{header.error}{_check_values(frame)}]" if not header.ok and header.error else ""
    if len(octets) < 2:
        return f"{_hex(octets) or 'nothing'}{damage}"
    if role in (Role.UNKNOWN, Role.EITHER):
        role = header.role
    unit, code = octets[0], octets[1]
    arrow = _ARROWS.get(role, "↔")
    words = _words(octets, code, role)
    said = meaning.about if meaning is not None else ""
    if said and code & EXCEPTION_BIT and code not in NO_EXCEPTIONS and len(octets) > 2:
        number = code_number(octets[2])  # the maker's words, not the standard's
        words = f"exception: {said} (code {number}, {_asked(code)})"
    elif said:
        words = f"{said} — {words.removeprefix('read ')}" if said.startswith("read ") else f"{said} — {words}"
    if role is Role.BROADCAST:
        words = f"broadcast: {words}"
    if frame.repair is not None and header.error:
        damage = f" [repaired: {header.error}]"
    if header.ok and header.error and (not code & EXCEPTION_BIT or code in NO_EXCEPTIONS):
        words += f" [{header.error}]"
    return f"{unit} {arrow} {words}{damage}"


def _check_values(frame: Frame) -> str:
    """The check of a frame that is damaged by it alone, as it came and as it should be."""
    if frame.damage not in (None, Damage.CHECK) or frame.check is not Check.BAD or frame.repair is not None:
        return ""
    is_ascii = frame.protocol == ASCII_NAME
    check, digits = (ascii_check(frame), 2) if is_ascii else (rtu_check(frame), 4)
    return "" if check is None else f": 0x{check[0]:0{digits}X}, computed 0x{check[1]:0{digits}X}"


def printable(octets: bytes) -> str:
    """Text from the wire: printable ASCII as it is; quotes, backslashes, braces and all the rest as \\xNN."""
    return "".join(chr(o) if 0x20 <= o < 0x7F and chr(o) not in '"\\{}' else f"\\x{o:02X}" for o in octets)


def _words(octets: bytes, code: int, role: Role) -> str:
    if code in NO_EXCEPTIONS:
        return _with(f"function 0x{code:02X}", _hex(octets[2:]))
    if code & EXCEPTION_BIT and len(octets) > _EXCEPTION:
        return f"exception of {len(octets) - 2} octets where it has 1: {_hex(octets[2:])} ({_asked(code)})"
    if code & EXCEPTION_BIT:
        name = exception_name(octets[2]) if len(octets) > 2 else "without code"
        return f"exception: {name} ({_asked(code)})"
    function = FUNCTIONS.get(code)
    if function is None:
        return _with(f"function 0x{code:02X}", _hex(octets[2:]))
    table = _RESPONSES if role is Role.RESPONSE else _REQUESTS
    write = table.get(code) if role is not Role.UNKNOWN else None
    if write is not None:
        try:
            return write(octets, function.short)
        except IndexError:  # cut short: what is there
            pass
    return _with(function.short, _hex(octets[2:]))


def _asked(code: int) -> str:
    """What an exception refuses."""
    asked = FUNCTIONS.get(code ^ EXCEPTION_BIT)
    return asked.short if asked else kind_of(code ^ EXCEPTION_BIT)


def _u16(octets: bytes, at: int) -> int:
    return octets[at] << 8 | octets[at + 1]


def _hex(octets: bytes) -> str:
    more = f" … +{len(octets) - _MOST_OCTETS}" if len(octets) > _MOST_OCTETS else ""
    return octets[:_MOST_OCTETS].hex(" ").upper() + more


def _with(what: str, value: str) -> str:
    return f"{what}: {value}" if value else what


def _registers(octets: bytes) -> str:
    """Register values in decimal, the first ten."""
    count = len(octets) // 2
    shown = " ".join(str(_u16(octets, at)) for at in range(0, 2 * min(count, _MOST_REGISTERS), 2))
    return shown + (f" … +{count - _MOST_REGISTERS}" if count > _MOST_REGISTERS else "")


def _bits(octets: bytes, count: int) -> str:
    """Bits in address order, the first 32, in groups of eight."""
    count = min(count, 8 * len(octets))
    shown = "".join("1" if octets[i >> 3] >> (i & 7) & 1 else "0" for i in range(min(count, _MOST_BITS)))
    groups = " ".join(shown[i : i + 8] for i in range(0, len(shown), 8))
    return groups + (f" … +{count - _MOST_BITS}" if count > _MOST_BITS else "")


def _range(octets: bytes, short: str) -> str:
    return f"{short} 0x{_u16(octets, 2):04X} ×{_u16(octets, 4)}"


def _name(octets: bytes, short: str) -> str:
    return short


def _write_coil(octets: bytes, short: str) -> str:
    value = _u16(octets, 4)
    words = {0xFF00: "on", 0x0000: "off"}.get(value, f"0x{value:04X}")
    return f"{short} 0x{_u16(octets, 2):04X} = {words}"


def _write_register(octets: bytes, short: str) -> str:
    return f"{short} 0x{_u16(octets, 2):04X} = {_u16(octets, 4)}"


def _write_coils(octets: bytes, short: str) -> str:
    return _with(_range(octets, short), _bits(octets[7:], _u16(octets, 4)))


def _write_registers(octets: bytes, short: str) -> str:
    return _with(_range(octets, short), _registers(octets[7:]))


def _mask_write(octets: bytes, short: str) -> str:
    return f"{short} 0x{_u16(octets, 2):04X} and 0x{_u16(octets, 4):04X} or 0x{_u16(octets, 6):04X}"


def _read_write(octets: bytes, short: str) -> str:
    written = _with(f"write 0x{_u16(octets, 6):04X} ×{_u16(octets, 8)}", _registers(octets[11:]))
    return f"read 0x{_u16(octets, 2):04X} ×{_u16(octets, 4)}, {written}"


def _read_fifo(octets: bytes, short: str) -> str:
    return f"{short} 0x{_u16(octets, 2):04X}"


def _groups(octets: bytes, short: str, data: bool) -> str:
    """File record groups: reference type, file(2), record(2), length(2), and data where they carry it."""
    groups, at = [], 3
    while at < len(octets):
        file, record, length = _u16(octets, at + 1), _u16(octets, at + 3), _u16(octets, at + 5)
        at += 7
        words = f"{file} record {record} ×{length}"
        if data:
            words = _with(words, _registers(octets[at : at + 2 * length]))
            at += 2 * length
        groups.append(words)
    return f"{short} {', '.join(groups)}"


def _read_files(octets: bytes, short: str) -> str:
    return _groups(octets, short, data=False)


def _write_files(octets: bytes, short: str) -> str:
    return _groups(octets, short, data=True)


def _file_data(octets: bytes, short: str) -> str:
    groups, at = [], 3
    while at < len(octets):
        groups.append(_registers(octets[at + 2 : at + 1 + octets[at]]))
        at += 1 + octets[at]
    return _with(short, " / ".join(groups))


def _diagnostics(octets: bytes, short: str) -> str:
    sub = _u16(octets, 2)
    words = f"{short}: {DIAGNOSTICS.get(sub, f'0x{sub:04X}')}"
    if sub == 0x0000:
        return f"{words} {_hex(octets[4:])}"
    if sub == 0x0003:
        return f'{words} "{printable(octets[4:5])}"'
    return f"{words} 0x{_u16(octets, 4):04X}" if octets[4:6] != b"\0\0" else words


def _diagnostics_answer(octets: bytes, short: str) -> str:
    sub = _u16(octets, 2)
    if 0x0B <= sub <= 0x12:
        return f"{short}: {DIAGNOSTICS[sub].removeprefix('return ')} {_u16(octets, 4)}"
    return _diagnostics(octets, short)


def _device_id_request(octets: bytes, short: str) -> str:
    if octets[2] != 0x0E:
        return _with(f"encapsulated interface 0x{octets[2]:02X}", _hex(octets[3:]))
    code = DEVICE_ID_CODES.get(octets[3], f"0x{octets[3]:02X}")
    return f"{short}: {code} from {_object_name(octets[4])}"


def _device_id_answer(octets: bytes, short: str) -> str:
    if octets[2] != 0x0E:
        return _device_id_request(octets, short)
    objects, at = [], 8
    for _ in range(octets[7]):
        value = octets[at + 2 : at + 2 + octets[at + 1]]
        objects.append(f'{_object_name(octets[at])} "{printable(value)}"')
        at += 2 + octets[at + 1]
    more = f", more from {_object_name(octets[6])}" if octets[5] else ""
    return f"{short}: {', '.join(objects) or 'no objects'}{more}"


def _object_name(number: int) -> str:
    return DEVICE_ID_OBJECTS.get(number, f"object 0x{number:02X}")


def _bits_answer(octets: bytes, short: str) -> str:
    count = octets[2]
    return _with(f"{8 * count} bits", _bits(octets[3 : 3 + count], 8 * count))


def _registers_answer(octets: bytes, short: str) -> str:
    count = octets[2] // 2
    return _with(counted(count, "register"), _registers(octets[3 : 3 + octets[2]]))


def _status(octets: bytes, short: str) -> str:
    return f"{short} 0x{octets[2]:02X}"


def _event_counter(octets: bytes, short: str) -> str:
    busy = ", busy" if _u16(octets, 2) == 0xFFFF else ""
    return f"{short} {_u16(octets, 4)}{busy}"


def _event_log(octets: bytes, short: str) -> str:
    counts = f"{short}: {counted(_u16(octets, 5), 'event')}, {counted(_u16(octets, 7), 'message')}"
    return _with(counts, _hex(octets[9:]))


def _server_id(octets: bytes, short: str) -> str:
    """The layout is the vendor's; the run indicator is the last octet that is 00 or FF, if it is one."""
    value = octets[3 : 3 + octets[2]]
    state = {b"\xff": ", running", b"\0": ", stopped"}.get(value[-1:], "")
    return f'{short} "{printable(value[:-1] if state else value)}"{state}'


def _fifo_answer(octets: bytes, short: str) -> str:
    return _with(f"fifo of {_u16(octets, 4)}", _registers(octets[6:]))


_REQUESTS: dict[int, Callable[[bytes, str], str]] = {
    **dict.fromkeys((0x01, 0x02, 0x03, 0x04), _range),
    0x05: _write_coil,
    0x06: _write_register,
    **dict.fromkeys((0x07, 0x0B, 0x0C, 0x11), _name),
    0x08: _diagnostics,
    0x0F: _write_coils,
    0x10: _write_registers,
    0x14: _read_files,
    0x15: _write_files,
    0x16: _mask_write,
    0x17: _read_write,
    0x18: _read_fifo,
    0x2B: _device_id_request,
}

_RESPONSES: dict[int, Callable[[bytes, str], str]] = {
    **dict.fromkeys((0x01, 0x02), _bits_answer),
    **dict.fromkeys((0x03, 0x04, 0x17), _registers_answer),
    0x05: _write_coil,
    0x06: _write_register,
    0x07: _status,
    0x08: _diagnostics_answer,
    0x0B: _event_counter,
    0x0C: _event_log,
    0x0F: _range,
    0x10: _range,
    0x11: _server_id,
    0x14: _file_data,
    0x15: _write_files,
    0x16: _mask_write,
    0x18: _fifo_answer,
    0x2B: _device_id_answer,
}
