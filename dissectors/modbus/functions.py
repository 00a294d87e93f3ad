"""The function codes of Modbus: what the framer and `peek` ask of a message, compiled from its layout.

Beside them the numbers that have names: exceptions, diagnostics, encapsulated interfaces.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from dissectors.modbus.layout import MEI_CANOPEN, MEI_DEVICE_IDENTIFICATION, MESSAGES, SUB_FUNCTIONS
from dissectors.modbus.lengths import MIN_FRAME, MORE, NEVER, Length, Octets, length_of
from dissectors.modbus.notation import (
    CHECK,
    HEAD,
    Means,
    Message,
    Messages,
    counted,
    first,
    fixed_length,
)
from dissectors.modbus.shapes import Shape, shape_of

# --- the table -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class DirectionForm:
    """One direction of a function: how long its frame is, and how well formed a complete one looks."""

    length: Length
    shape: Shape


@dataclass(frozen=True, slots=True)
class Function:
    """A public function code, as its layout has it.

    `name`: stable, lower-case, hyphens. `short`: for one-line texts. `writes`: a write type, the only kind that may be
    broadcast (Modbus over Serial Line V1.02, 2.1). `echoes`: a normal response repeats the request octet for octet.
    """

    code: int
    name: str
    short: str
    request: DirectionForm
    response: DirectionForm
    writes: bool = False
    echoes: bool = False


def _form(message: Message) -> DirectionForm:
    return DirectionForm(length_of(message), shape_of(message))


FUNCTIONS: Final[Mapping[int, Function]] = {
    code: Function(
        code,
        messages.name,
        messages.short,
        _form(messages.request),
        _form(messages.response),
        messages.writes,
        messages.echoes,
    )
    for code, messages in MESSAGES.items()
}

EXCEPTION_BIT: Final = 0x80
EXCEPTION_LENGTH: Final = 5

EXCEPTIONS: Final[Mapping[int, str]] = {
    0x01: "illegal function",
    0x02: "illegal data address",
    0x03: "illegal data value",
    0x04: "server device failure",
    0x05: "acknowledge",
    0x06: "server device busy",
    0x07: "negative acknowledge",
    0x08: "memory parity error",
    0x0A: "gateway path unavailable",
    0x0B: "gateway target failed to respond",
}
"""Standard exception codes (V1.1b3, clause 7; 07 from older Modicon gear)."""

VENDOR_EXCEPTIONS: Final = frozenset({0x20, 0x51, 0x52})
"""Codes in the worked examples of the TECO E510 and F510 manuals, which name none of them."""

DIAGNOSTICS: Final[Mapping[int, str]] = {code: sub.name for code, sub in SUB_FUNCTIONS.items()}
"""Sub-functions of function 08."""

DIAGNOSTIC_LOOPBACK: Final = 0x0000
DIAGNOSTIC_DELIMITER: Final = 0x0003
DIAGNOSTIC_LISTEN_ONLY: Final = 0x0004

MEI_TYPES: Final[Mapping[int, str]] = {
    MEI_CANOPEN: "canopen-general-reference",
    MEI_DEVICE_IDENTIFICATION: "read-device-identification",
}

BROADCAST: Final = 0
MAX_UNIT: Final = 247
"""Highest station address of the standard; 248 … 254 are met in the field (TECO), 255 behind gateways."""


# --- questions -------------------------------------------------------------------------------------------------------


def request_length(octets: Octets, start: int = 0, end: int | None = None) -> int:
    """Octets of the request that begins at `start`, or MORE, or NEVER (also for unknown functions). Total."""
    return _length(octets, start, end, request=True)


def response_length(octets: Octets, start: int = 0, end: int | None = None) -> int:
    """Octets of the response (normal or exception) that begins at `start`, or MORE, or NEVER. Total."""
    return _length(octets, start, end, request=False)


def _length(octets: Octets, start: int, end: int | None, *, request: bool) -> int:
    end = len(octets) if end is None else min(end, len(octets))
    if end - start < 2:
        return MORE
    code = octets[start + 1]
    if code & EXCEPTION_BIT:
        return EXCEPTION_LENGTH if not request and code ^ EXCEPTION_BIT in FUNCTIONS else NEVER
    function = FUNCTIONS.get(code)
    if function is None:
        return NEVER
    return (function.request if request else function.response).length(octets, start, end)


def answer_length(request: Octets) -> int | None:
    """Octets of the normal answer to an RTU request; None when only its data can tell. Total."""
    if len(request) < MIN_FRAME:
        return None
    code = request[1]
    asked = ITEMS_ASKED.get(code)
    if asked is not None:
        at, bits = asked
        if len(request) < at + 2 + CHECK:
            return None
        return HEAD + 1 + ((request[at] << 8 | request[at + 1]) * bits + 7 >> 3) + CHECK
    return len(request) if code in COPIED else ANSWER_LENGTHS.get(code)


def _asked(messages: Messages) -> tuple[int, int] | None:
    """Where a request says how many items its answer holds, and the bits of one; None of others."""
    quantity, answer = first(messages.request, Means.QUANTITY), counted(messages.response)
    return None if quantity is None or answer is None else (quantity.at, answer.items.bits)


ITEMS_ASKED: Final[Mapping[int, tuple[int, int]]] = {
    code: asked for code, messages in MESSAGES.items() if (asked := _asked(messages)) is not None
}
"""By function: where the request says how many items its answer holds, and the bits of one."""

COPIED: Final = frozenset(code for code, messages in MESSAGES.items() if messages.request == messages.response)
"""Functions whose confirmation looks like the request."""

ANSWER_LENGTHS: Final[Mapping[int, int]] = {
    code: length for code, messages in MESSAGES.items() if (length := fixed_length(messages.response)) is not None
}
"""By function: octets of its answer, where they are always the same (diagnostics: usually)."""


def is_open_length(octets: Octets, start: int = 0) -> bool:
    """Whether only silence ends such a frame: unknown functions, loop-back data, other encapsulated interfaces."""
    code = octets[start + 1]
    if code & EXCEPTION_BIT:
        return False
    if code == 0x08:
        return octets[start + 2 : start + 4] == b"\0\0"
    if code == 0x2B:
        return octets[start + 2 : start + 3] != b"\x0e"
    return code not in FUNCTIONS


def ascii_length(length: int) -> int:
    """Characters of the ASCII frame (':' … CR LF) that carries what an RTU frame of `length` octets carries."""
    return 2 * length + 1
