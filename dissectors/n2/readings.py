"""Readings of N2 exchanges: objects with their values.

A binary object answers its status octet; that bit 6 of it is the state no public source confirms, so such a reading is
not sure. Reports of changes are tentative altogether.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

from dissectors.frame import Frame
from dissectors.n2.commands import Command, fields_of, parse_command
from dissectors.n2.header import error_code, meant
from dissectors.n2.interpretation import ChangeOfState, Interpretation, change_records, interpret, printable
from dissectors.n2.objects import (
    BINARY,
    REGIONS,
    STATE_BIT,
    Encoding,
    attribute_name,
    guessed_bits,
    is_hex,
    region_name,
    state_word,
)
from dissectors.readings import Origin, Reading


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
    if command.region is None or command.object is None:
        return ()
    if command.type.kind == "release-override":
        return (Reading(region_name(command.region), command.object, None, "", Origin.WRITE, words="release"),)
    if command.type.kind != "read-attribute":
        return ()
    part = part_of(command.region, command.attribute)
    return (Reading(region_name(command.region), command.object, None, "", Origin.READ, part),)


def refusal(frame: Frame) -> tuple[str, int] | None:
    """The error code after N, 10 whether it came as 10 or 0A; None of any other frame."""
    code = error_code(frame.octets) if frame.octets[:1] == b"N" else ""
    if not code or not is_hex(code):
        return None
    return "n2", int(code) if code.isdigit() else int(code, 16)


def spans(frame: Frame, readings: Sequence[Reading]) -> list[tuple[int, int] | None]:
    """The octets of each reading of an answer: of its record, or all data. Total."""
    octets = meant(frame)
    if octets[:1] != b"A" or octets != frame.octets:
        return [None] * len(readings)
    data = printable(fields_of(octets))
    records = change_records(data)[0] if len(data) == len(fields_of(octets)) else ()
    if [(region_name(one.region), one.object) for one in records] == [(one.space, one.address) for one in readings]:
        return [(1 + one.begin, 1 + one.end) for one in records]
    return [(1, 1 + len(data))] if len(readings) == 1 else [None] * len(readings)


def _change(record: ChangeOfState) -> Reading:
    raw: int = record.status
    value: int | float = record.status >> STATE_BIT & 1
    words = state_word(record.region, record.status)
    if record.value is not None:
        raw, value, words = _raw(record.value), record.value, ""
    beside = _status(record.region, record.status)
    space = region_name(record.region)
    return Reading(space, record.object, raw, value, Origin.REPORT, "", False, words=words, beside=beside)


def _status(region: int, status: int) -> tuple[tuple[str, str], ...]:
    """The status octet in words."""
    said = ", ".join(guessed_bits(region, 2, status)) or ("bits of unknown meaning" if status else "no bit set")
    return ((f"status {status:02X}h", f"{said} (tentative)"),)


def _commanded(command: Command) -> tuple[Reading, ...]:
    """The value that a write or override carries."""
    value = command.value
    if value is None or command.region is None or command.object is None:
        return ()
    space, part = region_name(command.region), part_of(command.region, command.attribute)
    if command.attribute is not None and command.region in BINARY and not part and isinstance(value, int):
        state = value >> STATE_BIT & 1  # a write to the attribute writes the octet that a read of it answers
        return (_of_status(command.region, command.object, value, state, Origin.WRITE),)
    return (Reading(space, command.object, _raw(value), value, Origin.WRITE, part),)


def _read(told: Interpretation) -> tuple[Reading, ...]:
    if told.value is None or told.region is None or told.object is None:
        return ()
    part, value = part_of(told.region, told.attribute), told.value
    space = region_name(told.region)
    if told.region in BINARY and not part and isinstance(value, int):
        return (_of_status(told.region, told.object, value, value >> STATE_BIT & 1, Origin.READ),)
    beside = () if told.status is None else _status(told.region, told.status)
    return (Reading(space, told.object, _raw(value), value, Origin.READ, part, beside=beside),)


def _of_status(region: int, number: int, status: int, state: int, how: Origin) -> Reading:
    """A binary object by its status octet."""
    words, beside = state_word(region, status), _status(region, status)
    return Reading(region_name(region), number, status, state, how, "", False, words=words, beside=beside)


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
