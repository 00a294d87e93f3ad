"""Field names and values for filters, `-T fields` and JSON: Wireshark's names where Wireshark has the field.

Made of the layout: a message is a row of steps, each a name and how many octets it takes, and what fills the rest. The
walk ends where the frame does, so a cut frame gives the fields that are there. A field that repeats (registers,
objects) has its values joined by commas. Wireshark has no Modbus ASCII: there the envelope's fields are `mbascii.*`.
"""

from __future__ import annotations

from collections.abc import Callable

from dissectors.frame import Check, Frame, Role
from dissectors.modbus.envelope import ASCII_NAME, ascii_check, readable, readable_adu, rtu_check
from dissectors.modbus.functions import EXCEPTION_BIT
from dissectors.modbus.header import peek_ascii, peek_rtu
from dissectors.modbus.layout import MESSAGES, SUB_FUNCTIONS
from dissectors.modbus.notation import Field, Group, Means, Message
from dissectors.modbus.readings import readings
from dissectors.modbus.text import printable
from dissectors.readings import Origin

Value = int | float | str
Fields = dict[str, Value]
Step = tuple[str, int]  # field name after "modbus.", octets
Steps = tuple[Step, ...]
Rest = Callable[[Fields, bytes, int], int]

_NUMBERED = "regnum16"


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


def answer_fields(request: Frame, answer: Frame) -> Fields:
    """The numbers of the registers or bits that an answer holds, which only its request tells."""
    numbers = [one.address for one in readings(request, answer) if one.how is Origin.READ]
    if not numbers or not answer.ok:
        return {}
    is_bit = readable_adu(answer)[1] in (0x01, 0x02)
    name = "modbus.bitnum" if is_bit else f"modbus.{_NUMBERED}"
    return {name: ",".join(map(str, numbers)) if len(numbers) > 1 else numbers[0]}


def _pdu(found: Fields, octets: bytes, role: Role) -> None:
    code = octets[1]
    _put(found, "func_code", code & ~EXCEPTION_BIT)
    at = 2
    if code & EXCEPTION_BIT:
        at = _walk(found, octets, 2, (("exception_code", 1),))
    elif code in MESSAGES and role is not Role.UNKNOWN:
        steps, rest = (_RESPONSES if role is Role.RESPONSE else _REQUESTS)[code]
        at = rest(found, octets, _walk(found, octets, 2, steps))
    if at < len(octets):
        _put(found, "data", _hex(octets[at:]))


def _put(found: Fields, name: str, value: Value) -> None:
    name = f"modbus.{name}"
    found[name] = f"{found[name]},{value}" if name in found else value


def _hex(octets: bytes) -> str:
    return octets.hex(":")


def _walk(found: Fields, octets: bytes, at: int, steps: Steps) -> int:
    """Put the steps that are wholly there; give where the next begins."""
    for name, size in steps:
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


def _events(found: Fields, octets: bytes, at: int) -> int:
    for octet in octets[at:]:
        _put(found, "event", octet)
    return len(octets)


def _diagnostics(found: Fields, octets: bytes, at: int, answer: bool = False) -> int:
    sub = SUB_FUNCTIONS.get(int.from_bytes(octets[2:4], "big"))
    if sub is None:
        return at
    if sub.data is not None and sub.data.means is Means.OCTETS:
        if at < len(octets):
            _put(found, f"{sub.data.wireshark}.{'echo' if answer else 'request'}", _hex(octets[at:]))
        return len(octets)
    if sub.data is not None:
        after = _walk(found, octets, at, ((sub.data.wireshark, sub.data.size),))
        return after + 1 if sub.data.size == 1 and octets[after : after + 1] == b"\0" else after
    if answer and sub.counter is not None:
        return _walk(found, octets, at, ((sub.counter.wireshark, sub.counter.size),))
    return at


def _diagnostics_answer(found: Fields, octets: bytes, at: int) -> int:
    return _diagnostics(found, octets, at, answer=True)


def _selected(selector: int, steps: Steps, rest: Rest) -> Rest:
    """What follows a selector, for the one value whose layout is known."""

    def selected(found: Fields, octets: bytes, at: int) -> int:
        return rest(found, octets, _walk(found, octets, at, steps)) if octets[2:3] == bytes((selector,)) else at

    return selected


def _groups(fields: Message) -> Rest:
    """Groups, as long as the single fields of one are there, and what follows in each."""
    group, steps, last = Group.of(fields), _steps(fields), fields[-1]

    def groups(found: Fields, octets: bytes, at: int) -> int:
        while at + group.size <= len(octets) and group.whole(octets, at) >= group.size:
            end = min(at + group.whole(octets, at), len(octets))
            at = _walk(found, octets, at, steps)
            if last.means is Means.TEXT:
                _put(found, last.wireshark, printable(octets[at:end]))
            elif last.is_list and at < end:
                _put(found, last.wireshark, _hex(octets[at:end]))
            at = end
        return at

    return groups


def _steps(fields: Message) -> Steps:
    """The single fields at the beginning that Wireshark has; neighbours of one name are one number there."""
    steps: list[Step] = []
    for each in fields:
        if each.is_list or not each.wireshark or each.wireshark == _VALUE:
            break
        if steps and steps[-1][0] == each.wireshark:
            steps[-1] = each.wireshark, steps[-1][1] + each.size
        else:
            steps.append((each.wireshark, each.size))
        if each.means is Means.SELECTOR:
            break
    return tuple(steps)


_VALUE = "regval_uint16"
_RESTS: dict[Means, Rest] = {
    Means.VALUE: _value,
    Means.REGISTERS: _registers,
    Means.BITS: _bits,
    Means.OCTETS: _events,
}


def _message(message: Message, answer: bool) -> tuple[Steps, Rest]:
    """The steps of a message, and what fills the rest of it."""
    if not message:
        return (), _nothing
    first, last = message[0], message[-1]
    if first.means is Means.SELECTOR and first.only is not None:
        return _steps(message[:1]), _selected(first.only, *_message(message[1:], answer))
    return _steps(message), _rest(last, answer)


def _rest(last: Field, answer: bool) -> Rest:
    if last.means is Means.WORD:
        return _diagnostics_answer if answer else _diagnostics
    if last.means is Means.GROUPS:
        return _groups(last.group)
    return _RESTS.get(last.means, _nothing) if last.wireshark else _nothing


_REQUESTS = {code: _message(messages.request, answer=False) for code, messages in MESSAGES.items()}
_RESPONSES = {code: _message(messages.response, answer=True) for code, messages in MESSAGES.items()}
