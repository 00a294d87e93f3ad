"""One line for the frame list: `5 ← read AI 3 attribute 3 (current value)`, `A → 0042910000`, `N11 undefined …`.

A damaged frame that can be repaired shows what it was, and says so.
"""

from __future__ import annotations

from dissectors.checksums import sum8
from dissectors.frame import Check, Frame, Header, Role
from dissectors.n2.commands import NATIVE, UNKNOWN, Command, error_text, fields_of, parse_command
from dissectors.n2.header import damage_of, error_code, meant
from dissectors.n2.interpretation import guessed_time, printable
from dissectors.n2.objects import Encoding, attribute_name, guessed_bits, number, object_name


def text(frame: Frame, header: Header, role: Role) -> str:
    """One line without control characters. An answer shows its raw characters: alone it means no more."""
    octets = meant(frame)
    if octets[:1] == b">":
        line = _command(parse_command(octets))
    elif octets[:1] == b"N":
        line = error_text(printable(error_code(octets)))
    else:
        data = printable(fields_of(octets))
        line = f"A → {data}" if data else "A"
    return line + _damage(frame)


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
