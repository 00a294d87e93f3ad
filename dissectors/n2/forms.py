"""The form of an answer: whether it is what a command asks for. An answer names neither station nor object."""

from __future__ import annotations

from dissectors.n2.commands import Command, fields_of
from dissectors.n2.objects import holds_current_value, is_hex

ACKNOWLEDGED = frozenset(
    ("synchronise-time", "warm-reset", "write-attribute", "write-value", "override", "release-override")
)
"""Kinds of commands whose answer carries no data."""

RECORD_LEAST = 5
"""Fewest characters of a report of changes: region, object and status (Nidec H300 10.5 names the fields)."""


def fits(command: Command, answer: bytes) -> bool | None:
    """Whether an answer has the form that a command asks for; None where any form may be right."""
    if answer[:1] != b"A":
        return None
    return fits_data(command, len(fields_of(answer)))


def fits_data(command: Command, length: int) -> bool | None:
    """The same of an answer with so many characters of data."""
    kind = command.type.kind
    if kind in ACKNOWLEDGED:
        return length == 0
    if kind == "identify":
        return length == 2
    if kind == "read-attribute" and command.encoding is not None:
        width = command.encoding.width
        current = holds_current_value(command.region or 0, command.attribute or 0)
        return length == width or (current and length == width + 2)
    return None


def may_answer(command: Command, answer: bytes) -> bool:
    """Whether an answer may be one to this command: `fits`, and what little is known of the other commands.

    A poll is answered with `A` alone or with records of hex digits, a read with data.
    """
    if answer[:1] != b"A":
        return True
    told = fits(command, answer)
    if told is not None:
        return told
    data = fields_of(answer)
    kind = command.type.kind
    if kind in ("poll", "poll-acknowledge"):
        return not data or (len(data) >= RECORD_LEAST and is_hex(data))
    return bool(data) if kind == "read-attribute" else True
