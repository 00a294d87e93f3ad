"""The quick look at an N2 frame.

    command   destination from its address, kind and function from its command, object from region and number
    answer    no address: the tracker knows whose it is

`function` is command and sub-command as one octet: 04 is 0/4, 10 is read, 72 is override, F0 is identify. `address`
is region and object as one number: 0x0103 is AI 3.
"""

from __future__ import annotations

from dissectors.frame import Check, Damage, Frame, Header, Role
from dissectors.n2.commands import Command, characters, error_text, fields_of, parse_command

BROADCAST = 0
"""Address 00 as broadcast: one vendor only (Nidec H300 manual 10.5), so an answer to it is no surprise."""

DAMAGES: dict[Damage, str] = {
    Damage.CHECK: "bad checksum",
    Damage.SHORT: "too short",
    Damage.LONG: "too long",
    Damage.HEADER: "bad header",
    Damage.FORM: "characters that N2 does not allow",
    Damage.TIMEOUT: "no end, silence",
    Damage.RESTARTED: "no end, a new command began",
}


def peek(frame: Frame) -> Header:
    """What a frame is, to whom, and about which object; total."""
    error, octets = damage_of(frame), meant(frame)
    if octets[:1] == b">":
        return _peek_command(parse_command(octets), error)
    if octets[:1] == b"N":
        code = error_code(octets)
        return _answer("negative-acknowledge", error, error_text(code) if error is None else error)
    return _answer("answer" if fields_of(octets) else "acknowledge", error, error)


def meant(frame: Frame) -> bytes:
    """The octets of a frame; of a damaged one what they were, where one thing put right shows it."""
    return frame.octets if frame.repair is None else frame.repair.octets


def error_code(octets: bytes) -> str:
    """The characters after N, the code of a refusal; it has no checksum."""
    return characters(octets[1:].removesuffix(b"\r"))


def damage_of(frame: Frame) -> str | None:
    """What is wrong with the frame itself, in words; None when nothing is."""
    if frame.repair is not None:
        return frame.repair.flaw.value
    if frame.damage is not None:
        return DAMAGES[frame.damage]
    return "bad checksum" if frame.check is Check.BAD else None


def function_of(command: Command) -> int | None:
    """Command and sub-command as one octet; None when a character is no hex digit."""
    try:
        return int(command.code.ljust(2, "0"), 16) if command.code else None
    except ValueError:
        return None


def _peek_command(command: Command, error: str | None) -> Header:
    address = None
    if command.region is not None and command.object is not None:
        address = command.region << 8 | command.object
    return Header(
        protocol="n2",
        source=None,
        destination=command.address,
        role=Role.BROADCAST if command.address == BROADCAST else Role.REQUEST,
        kind="write-value"
        if command.type.attribute and command.data and command.attribute is None
        else command.type.kind,
        function=function_of(command),
        address=address,
        ok=error is None,
        error=error,
    )


def _answer(kind: str, damage: str | None, error: str | None) -> Header:
    return Header("n2", None, None, Role.RESPONSE, kind, ok=damage is None, error=error)
