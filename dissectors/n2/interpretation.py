"""The interpretation of an answer, given the command it answers.

An N2 answer carries neither address nor object, so alone it is only characters. Fields that no public source
describes (status and configuration bits, change-of-state records, the time in 0/0) are read as *tentative*: in words,
beside the raw characters, never as values.
"""

from __future__ import annotations

import calendar
from dataclasses import dataclass, replace

from dissectors.frame import Frame
from dissectors.n2.commands import VENDOR_DEVICE, Command, error_text, fields_of, parse_command
from dissectors.n2.header import error_code
from dissectors.n2.objects import (
    ATTRIBUTES,
    BINARY,
    REGIONS,
    Encoding,
    attribute_name,
    decode,
    flags_word,
    guessed_bits,
    holds_current_value,
    is_hex,
    number,
    object_name,
    state_word,
)

NO_OTHER_BIT = "no other status bit set"
"""What is said of all change records whose status octet is not."""


@dataclass(frozen=True, slots=True)
class ChangeOfState:
    """One tentative change-of-state record; `value` None where the record has none. `begin`, `end`: its characters
    in the data of the answer, end exclusive."""

    region: int
    object: int
    status: int
    value: int | float | None
    begin: int = 0
    end: int = 0


@dataclass(frozen=True, slots=True)
class Interpretation:
    """An answer read with its command.

    `raw`: the data characters as they came. `value`: what was read, or what was written or overridden and then
    acknowledged; None where nothing certain can be said. `written`: which of the two. `name`: the attribute's.
    `status`: the octet before a current value, or that a binary object is read by, None where there is none. `error`: a
    refusal or damage in words. `tentative`: readings that no public source confirms.
    """

    station: int | None
    kind: str
    region: int | None = None
    object: int | None = None
    attribute: int | None = None
    name: str = ""
    value: int | float | None = None
    written: bool = False
    raw: str = ""
    status: int | None = None
    error: str | None = None
    tentative: tuple[str, ...] = ()
    records: tuple[ChangeOfState, ...] = ()

    @property
    def text(self) -> str:
        """One line: "A → 72.5", "A", "N11 undefined or reserved field"."""
        if self.error is not None:
            return self.error
        doubt = f" ({self.raw}: {'; '.join(self.tentative)}, tentative)" if self.tentative else ""
        if self.value is not None and not self.written:
            return f"A → {number(self.value)}{doubt}"
        if self.raw:
            return f"A → {self.raw}" if not doubt else f"A →{doubt}"
        return "A"


def interpret(request: Frame, response: Frame) -> Interpretation:
    """Read an answer with the command it answers; total, whatever the two frames are.

    Of a damaged one that can be repaired what it was, marked as tentative.
    """
    if response.repair is not None or request.repair is not None:
        return _repaired(request, response)
    command = parse_command(request.octets)
    raw = printable(fields_of(response.octets)) if response.octets[:1] == b"A" else ""
    base = Interpretation(
        station=command.address,
        kind=command.type.kind,
        region=command.region,
        object=command.object,
        attribute=command.attribute,
        name=_name(command),
        raw=raw,
    )
    if response.damage is not None or request.damage is not None:
        return replace(base, error="damaged")
    if response.octets[:1] == b"N":
        return replace(base, error=error_text(printable(error_code(response.octets))))
    kind = command.type.kind
    if kind == "read-attribute":
        return _read(base, command)
    if kind in ("write-attribute", "override"):
        return replace(base, value=command.value, written=True)
    if kind == "identify":
        return _identify(base)
    if kind in ("poll", "poll-acknowledge") and raw:
        records, doubt = change_records(raw)
        return replace(base, records=records, tentative=doubt)
    return base


def _repaired(request: Frame, response: Frame) -> Interpretation:
    """The same two frames as they were meant."""
    flaws = tuple(f"{frame.repair.flaw.value}, repaired" for frame in (request, response) if frame.repair is not None)
    whole = [
        frame if frame.repair is None else replace(frame, octets=frame.repair.octets, damage=None, repair=None)
        for frame in (request, response)
    ]
    told = interpret(whole[0], whole[1])
    return replace(told, tentative=(*told.tentative, *flaws))


def printable(text: str) -> str:
    r"""Characters from the wire with everything outside printable ASCII written as \xNN."""
    return "".join(c if " " <= c <= "~" else f"\\x{ord(c):02x}" for c in text)


def _name(command: Command) -> str:
    if command.region is None:
        return ""
    if command.attribute is not None:
        return attribute_name(command.region, command.attribute)
    return "current value"


def _read(base: Interpretation, command: Command) -> Interpretation:
    """A value by the type of its attribute; before a current value one octet more may stand."""
    region, attribute = command.region or 0, command.attribute or 0
    encoding = command.encoding
    if encoding is None:
        return base
    raw, doubt = base.raw, list[str]()
    status: int | None = None
    if holds_current_value(region, attribute) and len(raw) == encoding.width + 2 and is_hex(raw):
        doubt.append(f"status {raw[:2]}h in front" + (", no bit set" if raw[:2] == "00" else ""))
        status, raw = int(raw[:2], 16), raw[2:]
    value = decode(raw, encoding, signed=REGIONS[region].signed)
    if value is None:
        return replace(base, tentative=(f"no {encoding.name.lower()}",)) if raw else base
    known = ATTRIBUTES[(region, attribute)]
    if known.otherwise:
        doubt.append(f"{known.name}, elsewhere {known.otherwise}")
    if encoding is Encoding.BYTE and isinstance(value, int):
        doubt.extend(guessed_bits(region, attribute, value))
        status = value if region in BINARY and attribute == 2 else status
    return replace(base, value=value, status=status, tentative=tuple(doubt))


def _identify(base: Interpretation) -> Interpretation:
    kind = decode(base.raw, Encoding.BYTE)
    if kind is None:
        return base
    return replace(base, value=kind, name="vendor device" if kind == VENDOR_DEVICE else "device type")


def change_records(raw: str) -> tuple[tuple[ChangeOfState, ...], tuple[str, ...]]:
    """Tentative change-of-state records, and the doubt in words.

    The Nidec H300 manual names region, point, status and value; no source gives their widths. Four grammars are tried
    (region of one or two characters, binary objects with or without a value); one that uses up all characters counts.
    """
    if not raw or not is_hex(raw):
        return (), ()
    readings = [records for grammar in ((1, 0), (1, 2), (2, 0), (2, 2)) if (records := _records(raw, *grammar))]
    distinct = list(dict.fromkeys(readings))
    if not distinct:
        return (), ("change records, layout not known",)
    if len(distinct) > 1:
        return (), (f"change records, {len(distinct)} readings fit",)
    told = distinct[0]
    silent = any(not flags_word(one.region, one.status) for one in told)
    return told, (*map(_record_text, told), *([NO_OTHER_BIT] if silent else []))


def _records(raw: str, region_width: int, binary_width: int) -> tuple[ChangeOfState, ...]:
    records, at = [], 0
    while at < len(raw):
        head = region_width + 4
        region = REGIONS.get(int(raw[at : at + region_width], 16))
        if region is None or len(raw) < at + head:
            return ()
        point = int(raw[at + region_width : at + region_width + 2], 16)
        status = int(raw[at + region_width + 2 : at + head], 16)
        width = binary_width if region.number in (2, 4) else region.value.width
        value = None
        if width:
            value = decode(raw[at + head : at + head + width], region.value, signed=region.signed)
            if value is None:
                return ()
        end = at + head + width
        records.append(ChangeOfState(region.number, point, status, value, at, end))
        at = end
    return tuple(records)


def _record_text(record: ChangeOfState) -> str:
    value = "" if record.value is None else f"= {number(record.value)}"
    words = (
        object_name(record.region, record.object),
        value or state_word(record.region, record.status),
        flags_word(record.region, record.status),
    )
    return " ".join(word for word in words if word)


_TIME_LAYOUTS = ((4, 2, 2, 2, 2, 2), (2, 2, 2, 2, 2, 2))  # year month day hour minute second


def guessed_time(data: str) -> str:
    """The data of 0/0 as a date where its digits make one; empty else. Tentative: no source gives the layout."""
    if not (data.isascii() and data.isdigit()):
        return ""
    for widths in _TIME_LAYOUTS:
        if len(data) != sum(widths):
            continue
        parts, at = [], 0
        for width in widths:
            parts.append(int(data[at : at + width]))
            at += width
        year, month, day, hour, minute, second = parts
        year += 2000 if year < 100 else 0
        day_exists = 1980 <= year < 2100 and 1 <= month <= 12 and 1 <= day <= calendar.monthrange(year, month)[1]
        if day_exists and hour < 24 and minute < 60 and second < 60:
            return f"{year:04}-{month:02}-{day:02} {hour:02}:{minute:02}:{second:02}"
    return ""
