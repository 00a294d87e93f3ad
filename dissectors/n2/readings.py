"""Readings of N2 exchanges: objects with their values.

A binary object answers its status octet; that bit 6 of it is the state no public source confirms, so such a reading is
not sure. Reports of changes are tentative altogether.
"""

from __future__ import annotations

import struct

from dissectors.frame import Frame
from dissectors.n2.commands import Command, parse_command
from dissectors.n2.header import error_code
from dissectors.n2.interpretation import ChangeOfState, Interpretation, interpret
from dissectors.n2.objects import REGIONS, Encoding, attribute_name, is_hex, region_name
from dissectors.readings import Origin, Reading

_STATE_BIT = 6
_BINARY = (2, 4)


def readings(request: Frame | None, response: Frame | None) -> tuple[Reading, ...]:
    """See `dissectors.readings.Readings`."""
    if request is None or not request.ok or request.octets[:1] != b">":
        return ()
    command = parse_command(request.octets)
    if response is None:
        return _commanded(command)
    if not response.ok or response.octets[:1] != b"A":
        return ()
    told = interpret(request, response)
    if told.error is not None:
        return ()
    if told.written:
        return _commanded(command)
    if told.kind == "read-attribute":
        return _read(told)
    return tuple(map(_change, told.records))


def asks(frame: Frame) -> tuple[Reading, ...]:
    """See `dissectors.readings.Asks`."""
    if not frame.ok or frame.octets[:1] != b">":
        return ()
    command = parse_command(frame.octets)
    if command.type.kind != "read-attribute" or command.region is None or command.object is None:
        return ()
    part = part_of(command.region, command.attribute)
    return (Reading(region_name(command.region), command.object, None, "", Origin.READ, part),)


def refusal(frame: Frame) -> tuple[str, int] | None:
    """The error code after N, 10 whether it came as 10 or 0A; None of any other frame."""
    code = error_code(frame.octets) if frame.octets[:1] == b"N" else ""
    if not code or not is_hex(code):
        return None
    return "n2", int(code) if code.isdigit() else int(code, 16)


def _change(record: ChangeOfState) -> Reading:
    raw: int = record.status
    value: int | float = record.status >> _STATE_BIT & 1
    if record.value is not None:
        raw, value = _raw(record.value), record.value
    return Reading(region_name(record.region), record.object, raw, value, Origin.REPORT, sure=False)


def _commanded(command: Command) -> tuple[Reading, ...]:
    """The value that a write or override carries."""
    value = command.value
    if value is None or command.region is None or command.object is None:
        return ()
    space, part = region_name(command.region), part_of(command.region, command.attribute)
    if command.attribute is not None and command.region in _BINARY and not part and isinstance(value, int):
        state = value >> _STATE_BIT & 1  # a write to the attribute writes the octet that a read of it answers
        return (Reading(space, command.object, value, state, Origin.WRITE, sure=False),)
    return (Reading(space, command.object, _raw(value), value, Origin.WRITE, part),)


def _read(told: Interpretation) -> tuple[Reading, ...]:
    if told.value is None or told.region is None or told.object is None:
        return ()
    part, value = part_of(told.region, told.attribute), told.value
    space = region_name(told.region)
    if told.region in _BINARY and not part and isinstance(value, int):
        return (Reading(space, told.object, value, value >> _STATE_BIT & 1, Origin.READ, sure=False),)
    return (Reading(space, told.object, _raw(value), value, Origin.READ, part),)


def part_of(region: int, attribute: int | None) -> str:
    """Empty for the value itself, else the attribute's name."""
    known = REGIONS.get(region)
    if attribute is None or (known is not None and attribute == known.current):
        return ""
    return attribute_name(region, attribute).split(",")[0].replace(" ", "-") or f"attribute-{attribute}"


def _raw(value: int | float) -> int:
    """The bits as they were on the wire."""
    if isinstance(value, float):
        return int.from_bytes(struct.pack(">f", value), "big")
    return value & (1 << 4 * Encoding.INTEGER.width) - 1
