"""Acyclic services of DP-V1 (IEC 61158-6-3; from general knowledge of the standard, no telegram of others was at hand).

    read request     5E slot index length            answer  5E slot index length data…
    write request    5F slot index length data…      answer  5F slot index length
    alarm ack        5C slot type specifier          answer  the same
    refused          DE, DF, DC: function with bit 7, then decode (80h: DP-V1), class and code, a second code
    idle 48   data transport 51   resource manager 56   initiate 57   abort 58   of connections of a master of class 2

A slave's access points: 51 and 50 for the master of class 1 that owns it (read and write, alarms), 49 the resource
manager and 0 … 48 the connections of masters of class 2.
"""

from __future__ import annotations

from dataclasses import dataclass

READ, WRITE, ALARM, TRANSPORT = 0x5E, 0x5F, 0x5C, 0x51
RESOURCE, INITIATE, ABORT, IDLE = 0x56, 0x57, 0x58, 0x48
REFUSED = 0x80

FUNCTIONS = {
    IDLE: "idle",
    TRANSPORT: "data transport",
    RESOURCE: "resource manager",
    INITIATE: "initiate",
    ABORT: "abort",
    ALARM: "alarm acknowledgement",
    READ: "read",
    WRITE: "write",
}
SERVERS = frozenset(range(49)) | {49, 50, 51}
"""Access points at which a slave may have them."""

_DPV1 = 0x80
_ERRORS = {
    0xA0: "read error",
    0xA1: "write error",
    0xA2: "module failure",
    0xA8: "version conflict",
    0xA9: "feature not supported",
    0xB0: "invalid index",
    0xB1: "wrong length",
    0xB2: "invalid slot",
    0xB3: "type conflict",
    0xB4: "invalid area",
    0xB5: "state conflict",
    0xB6: "access denied",
    0xB7: "invalid range",
    0xB8: "invalid parameter",
    0xB9: "invalid type",
    0xC0: "cannot be read at the moment",
    0xC1: "cannot be written at the moment",
    0xC2: "busy",
    0xC3: "unavailable",
}
_CLASSES = {0xA: "application error", 0xB: "access error", 0xC: "resource error"}
ALARM_TYPES = {
    1: "diagnosis alarm",
    2: "process alarm",
    3: "pull alarm",
    4: "plug alarm",
    5: "status alarm",
    6: "update alarm",
}
SPECIFIERS = ("", "appears", "disappears", "disappears, others remain")


@dataclass(frozen=True, slots=True)
class Acyclic:
    """One PDU. `function`: without the bit of a refusal. `slot`, `index`, `length`: as the function has them; `length`
    is what is asked for or told, `data` what is there. `error`: why it is refused. `is_cut`: it ends too early."""

    function: int
    slot: int | None = None
    index: int | None = None
    length: int | None = None
    data: bytes = b""
    error: str | None = None
    is_cut: bool = False

    @property
    def name(self) -> str:
        """The function in words."""
        return FUNCTIONS[self.function]

    @property
    def words(self) -> str:
        """All of it in one line."""
        if self.error is not None:
            return f"{self.name} refused: {self.error}"
        parts = [self.name]
        if self.slot is not None:
            parts.append(f"slot {self.slot}")
        if self.function == ALARM:
            parts += _alarm(self.data)
        elif self.index is not None:
            parts.append(f"index {self.index}")
            if self.length is not None:
                parts.append(f"{self.length} octet{'' if self.length == 1 else 's'}")
        said = ", ".join(parts)
        if self.data and self.function != ALARM:
            said += f": {self.data.hex(' ')}"
        return f"{said} (cut off)" if self.is_cut else said


def parse_acyclic(data: bytes, is_request: bool) -> Acyclic | None:
    """The PDU in the data of a telegram; None where the first octet is no function of DP-V1."""
    if not data:
        return None
    function = data[0] & ~REFUSED
    if function not in FUNCTIONS or (is_request and data[0] & REFUSED):
        return None
    if data[0] & REFUSED:
        return Acyclic(function, error=_error(data[1:4]), is_cut=len(data) < 4)
    if function in (READ, WRITE, TRANSPORT):
        return _addressed(function, data, is_request)
    if function == ALARM:
        return Acyclic(function, data[1] if len(data) > 1 else None, data=data[2:4], is_cut=len(data) < 4)
    return Acyclic(function, data=data[1:])


def _addressed(function: int, data: bytes, is_request: bool) -> Acyclic:
    slot, index, length = (data[at] if len(data) > at else None for at in (1, 2, 3))
    carried = data[4:]
    carries = function == TRANSPORT or (function == WRITE) == is_request
    is_cut = length is None or (carries and len(carried) != length)
    return Acyclic(function, slot, index, length, carried, is_cut=is_cut)


def _error(octets: bytes) -> str:
    if len(octets) < 2:
        return "without a reason"
    if octets[0] != _DPV1:
        return f"code {octets.hex(' ')}"
    code = octets[1]
    known = _ERRORS.get(code) or f"{_CLASSES.get(code >> 4, 'error')} {code & 0x0F}"
    return known if len(octets) < 3 or not octets[2] else f"{known} (maker's code {octets[2]:02X}h)"


def _alarm(data: bytes) -> list[str]:
    """Type and specifier of an alarm."""
    told = []
    if data:
        told.append(ALARM_TYPES.get(data[0] & 0x7F, f"alarm {data[0] & 0x7F}"))
    if len(data) > 1:
        told += specifier(data[1])
    return told


def specifier(octet: int) -> list[str]:
    """What the specifier of an alarm says: whether it comes or goes, whether more than one may be open, its number."""
    told = [SPECIFIERS[octet & 3]] if octet & 3 else []
    if octet & 4:
        told.append("with a further acknowledgement")
    return [*told, f"number {octet >> 3}"]


_STATUS_TYPES = {
    0x81: "status message",
    0x83: "state of links between slaves",
    0x9E: "acknowledged parameter command",
    0x9F: "redundancy state",
}
_PDU_STATES = ("good", "data invalid", "wrong module", "no module")


def device_block(content: bytes) -> str | None:
    """What a device block of a diagnosis says if its slave is of DP-V1: an alarm or a status; None where it has no such
    form. Whether the slave is of DP-V1 the block does not tell."""
    if len(content) < 3:
        return None
    kind, slot, octet = content[0], content[1], content[2]
    rest = f": {content[3:].hex(' ')}" if len(content) > 3 else ""
    if kind in ALARM_TYPES:
        return ", ".join((ALARM_TYPES[kind], f"slot {slot}", *specifier(octet))) + rest
    if kind in _STATUS_TYPES:
        return ", ".join((_STATUS_TYPES[kind], f"slot {slot}", *([SPECIFIERS[octet & 3]] if octet & 3 else []))) + rest
    if kind == 0x82:
        states = [octet >> shift & 3 for octet in content[3:] for shift in (0, 2, 4, 6)]
        bad = [f"slot {at} {_PDU_STATES[state]}" for at, state in enumerate(states, 1) if state]
        return "module status: " + (", ".join(bad) or "all good")
    return None
