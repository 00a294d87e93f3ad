"""One line for the frame list: `5 ← read AI 3 attribute 3 (current value)`, `A → 0042910000`, `N11 undefined …`.

A damaged frame that can be repaired shows what it was, and says so.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from dissectors.checksums import sum8
from dissectors.frame import Check, Frame, Header, Role
from dissectors.n2.commands import NATIVE, UNKNOWN, Command, error_text, fields_of, parse_command
from dissectors.n2.header import damage_of, error_code
from dissectors.n2.header import meant as meant_octets
from dissectors.n2.interpretation import Interpretation, guessed_time, interpret, printable
from dissectors.n2.objects import (
    BINARY,
    Encoding,
    attribute_name,
    guessed_bits,
    number,
    object_name,
    region_name,
    state_word,
)

if TYPE_CHECKING:
    from dissectors.meaning import Meaning

MOST_RAW = 40
"""Characters of an answer that follow what it means."""


def text(frame: Frame, header: Header, role: Role) -> str:
    """One line without control characters. An answer shows its raw characters: alone it means no more."""
    octets = meant_octets(frame)
    if octets[:1] == b">":
        line = _command(parse_command(octets))
    elif octets[:1] == b"N":
        line = error_text(printable(error_code(octets)))
    else:
        data = printable(fields_of(octets))
        line = f"A → {data}" if data else "A"
    return line + _damage(frame)


def meant(frame: Frame, header: Header, role: Role, meaning: Meaning) -> str:
    """The same, what it means to its device first: `5 ← output frequency 30.00 Hz — override AO 1 = 30`,
    `5 → status running — read BI 1: A → 40`. An answer is read with its request."""
    said, station = meaning.about, "?" if meaning.station is None else str(meaning.station)
    if frame.octets[:1] == b">":
        line = text(frame, header, role)
        begin, arrow, rest = line.partition(" ← ")
        return f"{begin}{arrow}{said} — {rest}" if said and arrow else line
    if meaning.request is None:
        return text(frame, header, role)
    told, asked = interpret(meaning.request, frame), parse_command(meant_octets(meaning.request))
    if told.error is not None:
        code = printable(error_code(frame.octets)) if frame.octets[:1] == b"N" else ""
        plain = f"N{code} {said}" if said and code else told.error  # the maker's words, not the public list's
        return f"{station} → {plain} ({_what(asked)}){_damage(frame)}"
    raw = told.raw if len(told.raw) <= MOST_RAW else f"{told.raw[:MOST_RAW]} … +{len(told.raw) - MOST_RAW}"
    raw = f"A {raw}" if raw else "A"
    is_ignored = _is_ignored(asked, meaning)
    said, plain = "" if is_ignored else said, _answer(told, asked, is_ignored)
    words = [said, raw] if said and told.value is None else [said, plain, raw] if said else [plain, raw]
    return f"{station} → {' — '.join(word for word in words if word)}{_damage(frame)}"


def _is_ignored(asked: Command, meaning: Meaning) -> bool:
    """Whether the device acknowledges the command and does not do it, by its manual."""
    limits = meaning.profile.limits_on("n2") if meaning.profile is not None else None
    return limits is not None and limits.ignores(asked.type.kind, region_name(asked.region or 0))


def _answer(told: Interpretation, asked: Command, is_ignored: bool) -> str:
    """What an answer says to its command, the object first: `AI 3 = 72.5`; of a poll what changed, one by one."""
    if told.value is not None and not told.written:
        what = [] if asked.region is None or asked.object is None else [object_name(asked.region, asked.object)]
        if told.status is not None and told.region in BINARY:
            return f"{' '.join(what)} {state_word(told.region, told.status)} (status {told.status:02X}h, tentative)"
        what += [told.name] if told.name and told.name != "current value" else []
        doubts = [one for one in told.tentative if one != told.name]
        doubt = f" ({'; '.join(doubts)}, tentative)" if doubts else ""
        return f"{' '.join(what)} = {number(told.value)}{doubt}"
    if told.tentative:
        return f"{'; '.join(told.tentative)} (tentative)"
    if is_ignored:
        return f"acknowledged, not executed: {_what(asked)}"
    return f"done: {_what(asked)}" if told.written or asked.type.kind == "release-override" else ""


def sent_and_due(octets: bytes) -> tuple[str, str] | None:
    """Checksum characters as sent and as they should be; None for a frame without."""
    if octets[:1] not in (b">", b"A") or not octets.endswith(b"\r") or len(octets) < 4:
        return None
    return printable(octets[-3:-1].decode("latin-1")), f"{sum8(octets[1:-3]):02X}"


def _damage(frame: Frame) -> str:
    words = damage_of(frame)
    if words is None:
        return ""
    if frame.repair is not None:
        return f" [{words}; repaired]"
    sums = sent_and_due(frame.octets)
    if frame.check is Check.BAD and sums is not None:
        return f" [{words}: {sums[0]}, {sums[1]} expected]"
    return f" [{words}]"


def _command(command: Command) -> str:
    station = "?" if command.address is None else str(command.address)
    return f"{station} ← {_what(command)}"


def _what(command: Command) -> str:
    kind = command.type
    data = printable(command.data)
    if kind in (NATIVE, UNKNOWN):
        return f"{kind.title} {printable(command.code)}" + (f": {data}" if data else "")
    words = [kind.title]
    if command.region is not None and command.object is not None:
        words.append(object_name(command.region, command.object))
        if command.attribute is not None:
            name = attribute_name(command.region, command.attribute)
            words.append(f"attribute {command.attribute}" + (f" ({name})" if name else ""))
    if not data:
        return " ".join(words)
    value = command.value
    if value is not None:
        words.append(f"= {_value(command, value)}")
    elif kind.kind == "synchronise-time":
        guess = guessed_time(command.data)
        words.append(data + (f" ({guess}?, tentative)" if guess else ""))
    else:
        words.append(data)
    return " ".join(words)


def _value(command: Command, value: int | float) -> str:
    """A value; configuration and status octets in hex with the bit names that are only guessed."""
    if command.encoding is not Encoding.BYTE or not isinstance(value, int) or command.attribute is None:
        return number(value)
    if command.region == 7 and command.attribute == 2:
        return number(value)
    bits = guessed_bits(command.region or 0, command.attribute, value)
    return f"{value:02X}h" + (f" ({', '.join(bits)}?, tentative)" if bits else "")
