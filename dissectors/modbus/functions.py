"""The function codes of Modbus as data: names, limits, predicted lengths, and how rarely chance looks like them.

Lengths count the whole RTU frame, address … CRC:  [unit][function][data …][CRC lo][CRC hi]
                                         offset:    0     1          2 …
The same frame in ASCII has `ascii_length` characters. Source: Modbus Application Protocol V1.1b3, clause 6;
lengths checked against live traffic.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

MIN_FRAME: Final = 4
MAX_FRAME: Final = 256
"""Octets of the shortest and longest RTU frame (Modbus over Serial Line V1.02, 2.5.1)."""

MORE: Final = 0
NEVER: Final = -1
"""Answers of a `Length` beside a number of octets: more octets are needed to tell; no such frame begins so."""

Octets = bytes | bytearray

Length = Callable[[Octets, int, int], int]
"""(octets, start, end) → octets of the frame that begins at `start`, or MORE, or NEVER; reads only [start, end)."""

Shape = Callable[[Octets, int, int], int]
"""(octets, start, length) → bits: how rarely random octets look so well formed (0 … 12), negative when they break
a rule that a healthy device keeps. The frame is complete: all `length` octets are there."""

IMPLAUSIBLE: Final = -6
_MOST: Final = 12

MAX_READ_BITS: Final = 2000
MAX_WRITE_BITS: Final = 1968
MAX_READ_REGISTERS: Final = 125
MAX_WRITE_REGISTERS: Final = 123
MAX_READ_WRITE_REGISTERS: Final = 121
MAX_FIFO: Final = 31


# --- lengths ---------------------------------------------------------------------------------------------------------


def _fixed(total: int) -> Length:
    def length(octets: Octets, start: int, end: int) -> int:
        return total

    return length


def _counted(at: int, least: int = 1) -> Length:
    """A byte count at offset `at` counts the octets between itself and the CRC."""

    def length(octets: Octets, start: int, end: int) -> int:
        if start + at >= end:
            return MORE
        count = octets[start + at]
        total = at + 3 + count
        return total if count >= least and total <= MAX_FRAME else NEVER

    return length


def _fifo_response(octets: Octets, start: int, end: int) -> int:
    if start + 3 >= end:
        return MORE
    count = octets[start + 2] << 8 | octets[start + 3]
    return 6 + count if 2 <= count <= 2 + 2 * MAX_FIFO else NEVER


def _encapsulated_request(octets: Octets, start: int, end: int) -> int:
    if start + 2 >= end:
        return MORE
    return 7 if octets[start + 2] == MEI_DEVICE_IDENTIFICATION else NEVER


def _encapsulated_response(octets: Octets, start: int, end: int) -> int:
    """Walk the objects: unit, 2B, 0E, code, conformity, more, next, count, then (id, length, value …) × count."""
    if start + 2 >= end:
        return MORE
    if octets[start + 2] != MEI_DEVICE_IDENTIFICATION:
        return NEVER
    if start + 7 >= end:
        return MORE
    objects = octets[start + 7]
    if 10 + 2 * objects > MAX_FRAME:
        return NEVER
    if start + 8 + 2 * objects > end:  # each has two octets at least
        return MORE
    at, before = start + 8, -1
    for _ in range(objects):
        if at + 1 - start > MAX_FRAME:
            return NEVER
        if at + 1 >= end:
            return MORE
        if octets[at] == before:  # no object twice
            return NEVER
        before = octets[at]
        at += 2 + octets[at + 1]
    total = at + 2 - start
    return total if total <= MAX_FRAME else NEVER


# --- shapes ----------------------------------------------------------------------------------------------------------


def _anything(octets: Octets, start: int, length: int) -> int:
    return 0


def _u16(octets: Octets, at: int) -> int:
    return octets[at] << 8 | octets[at + 1]


def _quantity(most: int, bits: int) -> Shape:
    """unit, function, start(2), quantity(2): the quantity is 1 … `most`."""

    def shape(octets: Octets, start: int, length: int) -> int:
        return bits if 1 <= octets[start + 4] << 8 | octets[start + 5] <= most else IMPLAUSIBLE

    return shape


def _even_count(octets: Octets, start: int, length: int) -> int:
    return 1 if not octets[start + 2] & 1 else IMPLAUSIBLE


def _coil_value(octets: Octets, start: int, length: int) -> int:
    value = _u16(octets, start + 4)
    return _MOST if value in (0x0000, 0xFF00) else IMPLAUSIBLE


def _diagnostic(octets: Octets, start: int, length: int) -> int:
    return _MOST if _u16(octets, start + 2) in DIAGNOSTICS else IMPLAUSIBLE


def _event_log(octets: Octets, start: int, length: int) -> int:
    return 2 if 6 <= octets[start + 2] <= 70 else IMPLAUSIBLE


def _write_bits(octets: Octets, start: int, length: int) -> int:
    quantity = _u16(octets, start + 4)
    fits = 1 <= quantity <= MAX_WRITE_BITS and octets[start + 6] == (quantity + 7) // 8
    return _MOST if fits else 2 * IMPLAUSIBLE


def _write_registers(octets: Octets, start: int, length: int) -> int:
    quantity = _u16(octets, start + 4)
    fits = 1 <= quantity <= MAX_WRITE_REGISTERS and octets[start + 6] == 2 * quantity
    return _MOST if fits else 2 * IMPLAUSIBLE


def _read_write_request(octets: Octets, start: int, length: int) -> int:
    written = _u16(octets, start + 8)
    fits = (
        1 <= _u16(octets, start + 4) <= MAX_READ_REGISTERS
        and 1 <= written <= MAX_READ_WRITE_REGISTERS
        and octets[start + 10] == 2 * written
    )
    return _MOST if fits else 2 * IMPLAUSIBLE


def _file_read_request(octets: Octets, start: int, length: int) -> int:
    count = octets[start + 2]
    fits = count % 7 == 0 and all(octets[at] == 6 for at in range(start + 3, start + 3 + count, 7))
    return _MOST if fits else 2 * IMPLAUSIBLE


def _file_read_response(octets: Octets, start: int, length: int) -> int:
    at, end = start + 3, start + length - 2
    while at + 1 < end and octets[at + 1] == 6 and octets[at]:
        at += 1 + octets[at]
    return _MOST if at == end else 2 * IMPLAUSIBLE


def _file_write(octets: Octets, start: int, length: int) -> int:
    at, end = start + 3, start + length - 2
    while at + 6 < end and octets[at] == 6:
        at += 7 + 2 * _u16(octets, at + 5)
    return _MOST if at == end else 2 * IMPLAUSIBLE


def _fifo_count(octets: Octets, start: int, length: int) -> int:
    return _MOST if _u16(octets, start + 2) == 2 + 2 * _u16(octets, start + 4) else IMPLAUSIBLE


def _identification_code(octets: Octets, start: int, length: int) -> int:
    return _MOST if octets[start + 3] in DEVICE_ID_CODES else IMPLAUSIBLE


# --- the table -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Form:
    """One direction of a function: how long its frame is, and how well formed a complete one looks."""

    length: Length
    shape: Shape


@dataclass(frozen=True, slots=True)
class Function:
    """A public function code.

    `name`: stable, lower-case, hyphens. `short`: for one-line texts. `writes`: a write type, the only kind that may be
    broadcast (Modbus over Serial Line V1.02, 2.1). `echoes`: a normal response repeats the request octet for octet.
    """

    code: int
    name: str
    short: str
    request: Form
    response: Form
    writes: bool = False
    echoes: bool = False


_FOUR = Form(_fixed(4), _anything)
_READ_BITS = Form(_fixed(8), _quantity(MAX_READ_BITS, 5))
_READ_REGISTERS = Form(_fixed(8), _quantity(MAX_READ_REGISTERS, 9))
_BITS = Form(_counted(2), _anything)
_REGISTERS = Form(_counted(2), _even_count)
_COIL = Form(_fixed(8), _coil_value)
_REGISTER = Form(_fixed(8), _anything)
_DIAGNOSTIC = Form(_fixed(8), _diagnostic)
_FILE_WRITE = Form(_counted(2, 9), _file_write)
_MASK = Form(_fixed(10), _anything)

FUNCTIONS: Final[Mapping[int, Function]] = {
    function.code: function
    for function in (
        Function(0x01, "read-coils", "read coils", _READ_BITS, _BITS),
        Function(0x02, "read-discrete-inputs", "read discrete", _READ_BITS, _BITS),
        Function(0x03, "read-holding-registers", "read holding", _READ_REGISTERS, _REGISTERS),
        Function(0x04, "read-input-registers", "read input", _READ_REGISTERS, _REGISTERS),
        Function(0x05, "write-single-coil", "write coil", _COIL, _COIL, writes=True, echoes=True),
        Function(0x06, "write-single-register", "write register", _REGISTER, _REGISTER, writes=True, echoes=True),
        Function(0x07, "read-exception-status", "exception status", _FOUR, Form(_fixed(5), _anything)),
        Function(0x08, "diagnostics", "diagnostics", _DIAGNOSTIC, _DIAGNOSTIC),
        Function(0x0B, "get-comm-event-counter", "event counter", _FOUR, Form(_fixed(8), _anything)),
        Function(0x0C, "get-comm-event-log", "event log", _FOUR, Form(_counted(2, 6), _event_log)),
        Function(
            0x0F,
            "write-multiple-coils",
            "write coils",
            Form(_counted(6), _write_bits),
            Form(_fixed(8), _quantity(MAX_WRITE_BITS, 5)),
            writes=True,
        ),
        Function(
            0x10,
            "write-multiple-registers",
            "write registers",
            Form(_counted(6, 2), _write_registers),
            Form(_fixed(8), _quantity(MAX_WRITE_REGISTERS, 9)),
            writes=True,
        ),
        Function(0x11, "report-server-id", "server id", _FOUR, Form(_counted(2), _anything)),
        Function(
            0x14,
            "read-file-record",
            "read file",
            Form(_counted(2, 7), _file_read_request),
            Form(_counted(2, 2), _file_read_response),
        ),
        Function(0x15, "write-file-record", "write file", _FILE_WRITE, _FILE_WRITE, writes=True, echoes=True),
        Function(0x16, "mask-write-register", "mask write", _MASK, _MASK, writes=True, echoes=True),
        Function(
            0x17,
            "read-write-multiple-registers",
            "read/write registers",
            Form(_counted(10, 2), _read_write_request),
            _REGISTERS,
        ),
        Function(0x18, "read-fifo-queue", "read fifo", Form(_fixed(6), _anything), Form(_fifo_response, _fifo_count)),
        Function(
            0x2B,
            "encapsulated-interface",
            "device id",
            Form(_encapsulated_request, _identification_code),
            Form(_encapsulated_response, _identification_code),
        ),
    )
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

DIAGNOSTICS: Final[Mapping[int, str]] = {
    0x0000: "return query data",
    0x0001: "restart communications",
    0x0002: "return diagnostic register",
    0x0003: "change ascii input delimiter",
    0x0004: "force listen only mode",
    0x000A: "clear counters and diagnostic register",
    0x000B: "return bus message count",
    0x000C: "return bus communication error count",
    0x000D: "return bus exception error count",
    0x000E: "return server message count",
    0x000F: "return server no response count",
    0x0010: "return server nak count",
    0x0011: "return server busy count",
    0x0012: "return bus character overrun count",
    0x0014: "clear overrun counter and flag",
}
"""Sub-functions of function 08 (V1.1b3, 6.8.1)."""

DIAGNOSTIC_LOOPBACK: Final = 0x0000
DIAGNOSTIC_DELIMITER: Final = 0x0003
DIAGNOSTIC_LISTEN_ONLY: Final = 0x0004

MEI_CANOPEN: Final = 0x0D
MEI_DEVICE_IDENTIFICATION: Final = 0x0E
MEI_TYPES: Final[Mapping[int, str]] = {
    MEI_CANOPEN: "canopen-general-reference",
    MEI_DEVICE_IDENTIFICATION: "read-device-identification",
}

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
    if code in _READS:
        if len(request) < 8:
            return None
        quantity = _u16(request, 4)
        return 5 + ((quantity + 7) // 8 if code <= 0x02 else 2 * quantity)
    function = FUNCTIONS.get(code)
    if function is None:
        return None
    if function.echoes or code == 0x08:
        return len(request)
    return _ANSWER_LENGTHS.get(code)


_READS: Final = frozenset({0x01, 0x02, 0x03, 0x04, 0x17})
_ANSWER_LENGTHS: Final[Mapping[int, int]] = {0x07: 5, 0x0B: 8, 0x0F: 8, 0x10: 8}


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
