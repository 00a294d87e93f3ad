"""Does this response fit that request? Both as unit and PDU, without check (see `adu.py`).

Lengths and copies are those of Modbus Application Protocol V1.1b3, clause 6.
"""

from __future__ import annotations

from collections.abc import Callable

from dissectors.modbus.functions import EXCEPTION_BIT, FUNCTIONS

_DIAGNOSTIC_COPIES = frozenset((0x00, 0x01, 0x03, 0x04, 0x0A, 0x14))  # sub-functions of 8 whose answer repeats them


def mismatch(request: bytes, response: bytes) -> str | None:
    """Why a response (same function) is not the one that the request asks for, in words; None when it fits."""
    if len(request) < 2 or len(response) < 2:
        return "too short to compare"
    if response[1] & EXCEPTION_BIT:
        return None
    rule = _RULES.get(request[1])
    return rule(request, response) if rule else None


def another_function(request: bytes, response: bytes) -> str:
    """In words: the station that was asked answered with another function code."""
    asked, answered = request[1], response[1]
    return f"function 0x{answered:02X} instead of 0x{asked:02X} or 0x{asked | EXCEPTION_BIT:02X}"


def is_listen_only(request: bytes) -> bool:
    """Whether it is Diagnostics 0004, Force Listen Only Mode, that a server does not answer (clause 6.8.1)."""
    return request[1:4] == b"\x08\x00\x04"


def is_restart(request: bytes) -> bool:
    """Whether it is Diagnostics 0001, Restart Communications, which ends listen-only mode unanswered (clause 6.8.1)."""
    return request[1:4] == b"\x08\x00\x01"


def _bits(request: bytes, response: bytes) -> str | None:
    quantity = int.from_bytes(request[4:6], "big")
    return _byte_count(response, (quantity + 7) // 8, _of(quantity, "bit"))


def _registers(request: bytes, response: bytes) -> str | None:
    quantity = int.from_bytes(request[4:6], "big")
    return _byte_count(response, 2 * quantity, _of(quantity, "register"))


def _of(count: int, thing: str) -> str:
    return f"{count} {thing}" if count == 1 else f"{count} {thing}s"


def _byte_count(response: bytes, expected: int, asked: str) -> str | None:
    there = response[2] if len(response) > 2 else 0
    return None if there == expected else f"{_of(there, 'data octet')} for {asked} asked for, expected {expected}"


def _copy(request: bytes, response: bytes) -> str | None:
    return None if request[1:] == response[1:] else "does not repeat the request"


def _range(request: bytes, response: bytes) -> str | None:
    return None if request[2:6] == response[2:6] else "names another address or quantity than the request"


def _diagnostics(request: bytes, response: bytes) -> str | None:
    if request[2:4] != response[2:4]:
        return "another sub-function than the request"
    if int.from_bytes(request[2:4], "big") in _DIAGNOSTIC_COPIES:
        return _copy(request, response)
    return None


def _file_groups(request: bytes, response: bytes) -> str | None:
    """Each group asked for (7 octets, length at 5) comes back as its length, reference type and data."""
    expected = sum(2 + 2 * int.from_bytes(request[at + 5 : at + 7], "big") for at in range(3, len(request) - 6, 7))
    return _byte_count(response, expected, _of((len(request) - 3) // 7, "record"))


def _encapsulated(request: bytes, response: bytes) -> str | None:
    return None if request[2:3] == response[2:3] else "another MEI type than the request"


_RULES: dict[int, Callable[[bytes, bytes], str | None]] = {
    1: _bits,
    2: _bits,
    3: _registers,
    4: _registers,
    8: _diagnostics,
    15: _range,
    16: _range,
    20: _file_groups,
    23: _registers,
    43: _encapsulated,
    **{code: _copy for code, function in FUNCTIONS.items() if function.echoes},
}
