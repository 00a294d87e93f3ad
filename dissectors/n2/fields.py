"""The fields of an N2 frame by name, for filters and JSON. Wireshark has no N2, so all names are ours, under `n2.`.

n2.address  n2.command  n2.region  n2.region.name  n2.object  n2.attribute  n2.attribute.name  n2.value  n2.data
n2.acknowledge  n2.error  n2.error.name  n2.checksum  n2.checksum.status
n2.changed.tentative  n2.changed.value.tentative  n2.changed.status.tentative     what a poll's answer tells, by commas
n2.time.tentative  n2.bits.tentative     guesses; `n2.data` has the characters
"""

from __future__ import annotations

from dissectors.frame import Check, Frame, Role
from dissectors.n2.commands import Command, error_name, fields_of, parse_command
from dissectors.n2.header import error_code, meant
from dissectors.n2.interpretation import guessed_time, interpret, printable
from dissectors.n2.objects import Encoding, attribute_name, guessed_bits, number, object_name, region_name
from dissectors.n2.text import sent_and_due

Fields = dict[str, int | float | str]

CHECKSUM_STATUS = {Check.BAD: 0, Check.GOOD: 1, Check.ABSENT: 3}
"""Wireshark's numbers for a checksum: 0 bad, 1 good, 3 not present."""


def fields(frame: Frame, role: Role) -> Fields:
    """Field names to values, in frame order; total. An answer gives its raw characters only, a repaired frame what it
    was."""
    octets = meant(frame)
    if octets[:1] == b">":
        found = _command(parse_command(octets))
    elif octets[:1] == b"N":
        code = error_code(octets)
        found = {"n2.acknowledge": "N", "n2.error": printable(code)}
        if error_name(code):
            found["n2.error.name"] = error_name(code)
    else:
        found = {"n2.acknowledge": "A"}
        if data := fields_of(octets):
            found["n2.data"] = printable(data)
    sums = sent_and_due(frame.octets)
    if sums is not None:
        found["n2.checksum"] = sums[0]
    found["n2.checksum.status"] = CHECKSUM_STATUS[frame.check]
    return found


def answer_fields(request: Frame, answer: Frame) -> Fields:
    """What an answer says to its command: whose thing it is and its value; of a poll what changed, one by one."""
    told = interpret(request, answer)
    found: Fields = {} if told.station is None else {"n2.address": told.station}
    if told.error is None and told.region is not None and told.object is not None:
        found |= {"n2.region": told.region, "n2.region.name": region_name(told.region), "n2.object": told.object}
        if told.attribute is not None:
            found["n2.attribute"] = told.attribute
            if name := attribute_name(told.region, told.attribute):
                found["n2.attribute.name"] = name
    if told.error is None and told.value is not None and not told.written:
        found["n2.value"] = told.value
    if told.records:
        found["n2.changed.tentative"] = ",".join(object_name(one.region, one.object) for one in told.records)
        found["n2.changed.value.tentative"] = ",".join(
            "" if one.value is None else number(one.value) for one in told.records
        )
        found["n2.changed.status.tentative"] = ",".join(f"{one.status:02X}" for one in told.records)
    return found


def _command(command: Command) -> Fields:
    found: Fields = {}
    if command.address is not None:
        found["n2.address"] = command.address
    if command.code:
        found["n2.command"] = printable(command.code)
    if command.region is not None:
        found["n2.region"] = command.region
        found["n2.region.name"] = region_name(command.region)
    if command.object is not None:
        found["n2.object"] = command.object
    if command.attribute is not None:
        found["n2.attribute"] = command.attribute
        if name := attribute_name(command.region or 0, command.attribute):
            found["n2.attribute.name"] = name
    if command.data:
        found["n2.data"] = printable(command.data)
    value = command.value
    if value is not None:
        found["n2.value"] = value
        octet = value if isinstance(value, int) and command.encoding is Encoding.BYTE else 0
        if bits := guessed_bits(command.region or 0, command.attribute or 0, octet):
            found["n2.bits.tentative"] = ", ".join(bits)
    elif command.type.kind == "synchronise-time" and (guess := guessed_time(command.data)):
        found["n2.time.tentative"] = guess
    return found
