"""The fit of a response to a request: both as unit and PDU, without check (see `envelope.py`).

What must agree follows from the layout: a copy, leading fields that come back, a byte count that was asked for
(Modbus Application Protocol V1.1b3, clause 6).
"""

from __future__ import annotations

from collections.abc import Callable

from dissectors.modbus.functions import EXCEPTION_BIT, ITEMS_ASKED
from dissectors.modbus.layout import MESSAGES, SUB_FUNCTIONS
from dissectors.modbus.notation import CHECK, HEAD, Group, Means, Messages, counted, first, places
from dissectors.modbus.ranges import SINGLE_WRITES

_Rule = Callable[[bytes, bytes], str | None]


def mismatch(request: bytes, response: bytes) -> str | None:
    """Why a response (same function) is not the one that the request asks for, in words; None when it fits."""
    if len(request) < 2 or len(response) < 2:
        return "too short to compare"
    if response[1] & EXCEPTION_BIT:
        return None
    rule = _RULES.get(request[1])
    return rule(request, response) if rule else None


def is_answer(request: bytes, response: bytes) -> bool:
    """Whether a response is one to that request: of its function, and with what it asks for."""
    same = len(request) > 1 and len(response) > 1 and response[1] & ~EXCEPTION_BIT == request[1]
    return same and mismatch(request, response) is None


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


def _items(at: int, bits: int) -> _Rule:
    """The answer holds what so many items take; the request says how many at `at`."""
    thing = "bit" if bits == 1 else "register"

    def rule(request: bytes, response: bytes) -> str | None:
        quantity = int.from_bytes(request[at : at + 2], "big")
        return _byte_count(response, quantity * bits + 7 >> 3, _of(quantity, thing))

    return rule


def _of(count: int, thing: str) -> str:
    return f"{count} {thing}" if count == 1 else f"{count} {thing}s"


def _byte_count(response: bytes, expected: int, asked: str) -> str | None:
    there = response[HEAD] if len(response) > HEAD else 0
    if there != expected:
        return f"{_of(there, 'data octet')} for {asked} asked for, expected {expected}"
    size, own = len(response) + CHECK, HEAD + 1 + there + CHECK
    return None if size == own else f"{size} octets where its own count makes it {own}"


def _copy(request: bytes, response: bytes) -> str | None:
    if request[1:] == response[1:]:
        return None
    if request[1] in SINGLE_WRITES and request[2:4] == response[2:4]:
        return "confirms another value than was written"
    return "does not repeat the request"


def _leading(end: int, what: str) -> _Rule:
    """The fields up to `end` come back."""

    def rule(request: bytes, response: bytes) -> str | None:
        return None if request[HEAD:end] == response[HEAD:end] else f"{what} than the request"

    return rule


def _diagnostics(request: bytes, response: bytes) -> str | None:
    if request[2:4] != response[2:4]:
        return "another sub-function than the request"
    sub = SUB_FUNCTIONS.get(int.from_bytes(request[2:4], "big"))
    return _copy(request, response) if sub is not None and sub.counter is None else None


def _records(messages: Messages) -> _Rule:
    """Each group asked for comes back as the single fields of an answered one, and its registers."""
    asked, answered = (Group.of(message[-1].group) for message in (messages.request, messages.response))
    length_at = asked.size - messages.request[-1].group[-1].size

    def rule(request: bytes, response: bytes) -> str | None:
        begins = range(HEAD + 1, len(request) - asked.size + 1, asked.size)
        lengths = (int.from_bytes(request[at + length_at : at + asked.size], "big") for at in begins)
        expected = sum(answered.size + 2 * length for length in lengths)
        return _byte_count(response, expected, _of((len(request) - HEAD - 1) // asked.size, "record"))

    return rule


def _rule(messages: Messages) -> _Rule | None:
    """What an answer is held to; None where the layout asks for nothing."""
    if messages.echoes:
        return _copy
    if messages.code in ITEMS_ASKED:
        return _items(*ITEMS_ASKED[messages.code])
    if any(field.means is Means.WORD for field in messages.request):
        return _diagnostics
    if messages.repeats:
        end = places(messages.request[: messages.repeats])[-1]
        selects = first(messages.request, Means.SELECTOR) is not None
        what = "another MEI type" if selects else "names another address or quantity"
        return _leading(end.at + end.field.size, what)
    count = counted(messages.response)
    return _records(messages) if count is not None and count.items.means is Means.GROUPS else None


_RULES: dict[int, _Rule] = {code: rule for code, messages in MESSAGES.items() if (rule := _rule(messages)) is not None}
