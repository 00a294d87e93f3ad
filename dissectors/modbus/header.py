"""The quick look: unit, function, role by shape, first address, count, check verdict. No objects but one Header.

Direction is not in a Modbus frame. Where its length and counts fit a request only, or a response only, the role is
said; where both fit (writes and diagnostics, whose good answer repeats the request; some reads of coils), it is
EITHER and the tracker decides. A good check with a length that fits neither is UNKNOWN and says so.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from dissectors.frame import Check, Damage, Flaw, Frame, Header, Repair, Role
from dissectors.modbus.envelope import ASCII_NAME, RTU_NAME, ascii_check, ascii_octets, readable, rtu_check
from dissectors.modbus.functions import (
    BROADCAST,
    DIAGNOSTIC_LISTEN_ONLY,
    EXCEPTION_BIT,
    EXCEPTION_LENGTH,
    EXCEPTIONS,
    FUNCTIONS,
    MEI_TYPES,
    Function,
)
from dissectors.modbus.layout import SUB_FUNCTIONS
from dissectors.modbus.notation import CHECK
from dissectors.modbus.ranges import AGREEMENTS, ANSWERED, ASKED, SHARED, Number, Range

_DAMAGE = {
    Damage.FORM: "characters that a frame may not hold",
    Damage.TIMEOUT: "silence inside the frame",
    Damage.RESTARTED: "a new start before the end",
    Damage.HEADER: "header check wrong",
}
NO_EXCEPTIONS = frozenset((EXCEPTION_BIT, 0xFF))
"""Function octets with bit 7 set that are no exception: there is no function 00, and FF is all ones rather than 7F."""

_WITH_MEI = 4  # octets of a frame of function 43 that ends before its type of interface
_COUNTERS = frozenset(code for code, sub in SUB_FUNCTIONS.items() if sub.counter)  # asked with 0000


def peek_rtu(frame: Frame) -> Header:
    """The header of an RTU frame. Total; of a damaged frame, what its first octets or its repair say."""
    if frame.repair is not None:
        return _repaired(peek_rtu(readable(frame)), frame.repair, "CRC error")
    error = None if frame.ok else _damage(frame, "CRC error", rtu_check(frame))
    return _peek(RTU_NAME, frame.octets, frame, error, frame.expected)


def peek_ascii(frame: Frame) -> Header:
    """The header of an ASCII frame. Total; of a damaged frame, what its first characters or its repair say."""
    if frame.repair is not None:
        return _repaired(peek_ascii(readable(frame)), frame.repair, "LRC error")
    octets = ascii_octets(frame)
    error = None if frame.ok else _damage(frame, "LRC error", ascii_check(frame))
    if frame.check is not Check.ABSENT:
        octets += b"\0"  # one octet more makes it as long as its RTU twin: LRC and filler stand where the CRC would
    missing = 0 if frame.expected is None else (frame.expected - len(frame.octets)) // 2
    return _peek(ASCII_NAME, octets, frame, error, len(octets) + missing if missing else None)


def code_number(code: int) -> str:
    """An exception code as people write it: those of the standard by their number, others as manuals do, 0x52."""
    return f"{code}" if code in EXCEPTIONS else f"0x{code:02X}"


def exception_name(code: int) -> str:
    """ "illegal data address", or "vendor 0x52" for a code that the standard does not name."""
    return EXCEPTIONS.get(code) or f"vendor 0x{code:02X}"


def kind_of(code: int, mei: int | None = None) -> str:
    """The stable name of a function code (no exception bit); of an encapsulated interface, of its type."""
    function = FUNCTIONS.get(code)
    if function is None:
        return f"function-0x{code:02X}"
    if code == 0x2B and mei is not None:
        return MEI_TYPES.get(mei, function.name)
    return function.name


def _repaired(header: Header, repair: Repair, wrong: str) -> Header:
    """What the frame says, and that it is damaged all the same; `wrong`: what a spoilt octet is seen by."""
    spoilt = repair.flaw in (Flaw.FIRST_SPOILT, Flaw.LAST_SPOILT, Flaw.ONE_SPOILT)
    return replace(header, ok=False, error=f"{wrong}, {repair.flaw.value}" if spoilt else repair.flaw.value)


def _peek(protocol: str, octets: bytes, frame: Frame, error: str | None, expected: int | None) -> Header:
    """`octets` as an RTU frame has them: unit, PDU, two of check where there is one."""
    size = len(octets)
    ok = error is None
    if size < 2:
        unit = octets[0] if octets else None
        return Header(protocol, None, unit, Role.UNKNOWN, "unknown", ok=ok, error=error or "too short for a frame")
    unit, code = octets[0], octets[1]
    if code & EXCEPTION_BIT:
        if code in NO_EXCEPTIONS:
            kind, code = kind_of(code), code & ~EXCEPTION_BIT
            error = error or "no exception to any function"
            return Header(protocol, unit, None, Role.RESPONSE, kind, code, None, None, ok, error)
        code ^= EXCEPTION_BIT
        if ok:
            fits = size == EXCEPTION_LENGTH
            error = exception_name(octets[2]) if fits else f"an exception of {size} octets"
        return Header(protocol, unit, None, Role.RESPONSE, kind_of(code), code, None, None, ok, error)
    function = FUNCTIONS.get(code)
    if function is None:
        kind, role = kind_of(code), Role.EITHER
    else:
        kind = function.name if code != 0x2B else kind_of(code, octets[2] if size > _WITH_MEI else None)
        role = _role(function, octets, size, expected)
        if ok and _asks_for_nothing(octets, size):
            role, expected = Role.REQUEST, size
        if role is Role.UNKNOWN and ok:
            error = f"{size} octets fit neither request nor response"
        elif ok and expected not in (None, size):
            error = f"{size} octets where its own count makes it {expected}"
        elif ok and role is Role.REQUEST:
            error = request_fault(octets) if code in AGREEMENTS else None
    if unit == BROADCAST and (role is Role.EITHER or (role is Role.REQUEST and _is_for_all(function))):
        role = Role.BROADCAST
    address, count = _address_count(code, role, octets, size if frame.check is Check.ABSENT else size - 2)
    if role is Role.RESPONSE:
        return Header(protocol, unit, None, role, kind, code, address, count, ok, error)
    return Header(protocol, None, unit, role, kind, code, address, count, ok, error)


def request_fault(octets: bytes) -> str | None:
    """What a request says that contradicts itself: its byte count against its quantity; None where nothing does.

    Of functions 15, 16 and 23 (Modbus Application Protocol V1.1b3, 6.11, 6.12, 6.17); unit first. Total.
    """
    agreement = AGREEMENTS.get(octets[1]) if len(octets) > 1 else None
    if agreement is None:
        return None
    at, count_at, bits = agreement
    if len(octets) <= count_at:
        return None
    quantity, there = octets[at] << 8 | octets[at + 1], octets[count_at]
    needed = quantity * bits + 7 >> 3
    if there == needed:
        return None
    thing = "coil" if bits == 1 else "register"
    return f"byte count {there} for {quantity} {thing}{'' if quantity == 1 else 's'}, which take {needed}"


def _asks_for_nothing(octets: bytes, size: int) -> bool:
    """Whether it is a request to write nothing: its byte count is 0, and nothing is there. No answer is as long."""
    agreement = AGREEMENTS.get(octets[1])
    return agreement is not None and size == agreement.count_at + 1 + CHECK and octets[agreement.count_at] == 0


def _is_for_all(function: Function | None) -> bool:
    """Whether a request to address 0 may be a broadcast: what reads asks for an answer, and all would give it."""
    return function is None or function.writes or function.code == 0x08


def _role(function: Function, octets: bytes, size: int, expected: int | None) -> Role:
    total = size if expected is None else expected
    request = function.request.length(octets, 0, size) == total
    response = function.response.length(octets, 0, size) == total
    if request and response:
        return _by_shape(function, octets, size) if size == total else Role.EITHER
    if request or response:
        return Role.REQUEST if request else Role.RESPONSE
    if function.code == 0x08 and octets[2:4] == b"\0\0" and size >= 6:
        return Role.EITHER  # loop-back of any length
    if function.code == 0x2B and octets[2:3] != b"\x0e" and size > _WITH_MEI:
        return Role.EITHER  # an interface that this table does not know
    return Role.UNKNOWN


def _by_shape(function: Function, octets: bytes, size: int) -> Role:
    """Request and response have the same length: does what is inside fit both?"""
    code = function.code
    if code == 0x08:
        sub = octets[2] << 8 | octets[3]
        if sub == DIAGNOSTIC_LISTEN_ONLY:
            return Role.REQUEST
        return Role.RESPONSE if sub in _COUNTERS and octets[4:6] != b"\0\0" else Role.EITHER
    if function.echoes:
        return Role.EITHER
    request = function.request.shape(octets, 0, size)
    response = function.response.shape(octets, 0, size)
    if request >= 0 and response >= 0:
        return Role.EITHER
    return Role.REQUEST if request >= response else Role.RESPONSE


def _address_count(code: int, role: Role, octets: bytes, end: int) -> tuple[int | None, int | None]:
    """First address and how many, as far as this direction of the function has them; unit and PDU end at `end`."""
    if role is Role.RESPONSE:
        read = _ANSWERED.get(code)
    elif role is Role.EITHER:
        read = _SHARED.get(code)
    else:
        read = _ASKED.get(code) if role is not Role.UNKNOWN else None
    return (None, None) if read is None else read(octets, end)


_Read = Callable[[bytes, int], tuple[int | None, int | None]]


def _reader(told: Range) -> _Read:
    """What reads address and quantity off octets."""
    address, quantity, single = told

    def read(octets: bytes, end: int) -> tuple[int | None, int | None]:
        return _number(octets, address, end), 1 if single else _number(octets, quantity, end)

    if address is None or address.size != 2 or quantity != (address.at + 2, 2, 1):
        return read
    at = address.at

    def read_words(octets: bytes, end: int) -> tuple[int | None, int | None]:
        if at + 4 > end:
            return read(octets, end)
        return octets[at] << 8 | octets[at + 1], octets[at + 2] << 8 | octets[at + 3]

    return read_words


def _number(octets: bytes, number: Number | None, end: int) -> int | None:
    if number is None:
        return None
    at, size, divisor = number
    if at + size > end:
        return None
    return octets[at] << 8 | octets[at + 1] if size == 2 else octets[at] // divisor


_ASKED, _ANSWERED, _SHARED = (
    {code: _reader(told) for code, told in ranges.items()} for ranges in (ASKED, ANSWERED, SHARED)
)


def _damage(frame: Frame, wrong: str, check: tuple[int, int] | None) -> str:
    """Why a frame is not good, in words that many frames share: its numbers are in its text. `wrong`: of a check that
    is there."""
    there = len(frame.octets)
    if frame.damage is Damage.SHORT or frame.damage is Damage.LONG:
        least = f", {frame.expected} expected" if frame.expected is not None else ""
        return f"{frame.damage.value}: {there} octet{'s' if there != 1 else ''}{least}"
    if frame.damage in _DAMAGE:
        return _DAMAGE[frame.damage]
    if frame.check is Check.BAD and check is not None:
        return wrong
    return "no check"
