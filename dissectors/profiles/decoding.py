"""Readings to named values: scale, unit, quality, and what they say in words. Without a profile: plain numbers.

Register numbers of points without a profile are those of the field: holding 0x006B is "holding/40108".
"""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import IntEnum

from dissectors.profiles.model import WORD_SPACES, Entry, EntryRole, Kind, Profile
from dissectors.readings import Origin, Reading

MOST_WORDS = 128
"""Values that one line of words names: all registers of one read."""

NO_BITS = "none"
"""What a register says whose bits are all 0 without a word for that."""

_FLOATS = {Kind.F32: ">f", Kind.F64: ">d"}
_EXACT = 1e15
"""Below it a float holds every whole number."""

_SINGLE, _DOUBLE = 7, 15
"""Significant digits that floats of 32 and of 64 bits always have."""

_SMALL, _PLACES = 0.01, 4
"""So many places of a scaled number are shown; of one below that, three significant digits where it has them."""

_FIRST = {"coil": 0, "discrete": 1, "input": 3, "holding": 4}
_ASIDE = re.compile(r" \([^()]*\)$")
"""Behind a title: which parameter of the device the thing is, or what else. A line has no room for it, the tree has."""
_PARAMETER = re.compile(r"[A-Za-z]+2?\.\d+|\d\d-\d\d")


class Quality(IntEnum):
    """How far a value is to be trusted."""

    GOOD = 0
    UNCERTAIN = 1  # no public source for its layout, or the manual contradicts itself
    BAD = 2  # outside the range that the device can have


@dataclass(frozen=True, slots=True)
class Value:
    """One value with its name. `value`: scaled, in `unit`; `raw`: as on the wire, None for text.

    `entry`: what the profile says of it, None for a point without profile; `bit`: True for a single bit or a part of
    that entry. `reading`: the place it is from.
    """

    name: str
    value: int | float | str
    raw: int | None
    unit: str
    quality: Quality
    reading: Reading
    entry: Entry | None = None
    bit: bool = False
    words: str = ""

    @property
    def how(self) -> Origin:
        return self.reading.how

    @property
    def says_nothing(self) -> bool:
        """Whether all its bits are 0, and there is no word for that; a state may be called "none"."""
        return self.words == NO_BITS and self.entry is not None and bool(self.entry.bits or self.entry.parts)

    @property
    def text(self) -> str:
        """For people: "60.00 Hz", "run, forward", "17"."""
        return self.words or number(self.value, self.entry, self.unit)


def decode(profile: Profile | None, readings: Sequence[Reading]) -> tuple[Value, ...]:
    """The values that the readings of one exchange make, in their order; named bits follow their register."""
    if profile is None:
        return tuple(map(_plain, readings))
    there = {(reading.how, reading.space, reading.address): reading for reading in readings if not reading.part}
    values: list[Value] = []
    for reading in readings:
        entry = None if reading.part else profile.at(reading.space, reading.address)
        is_along = reading.how is Origin.READ or not profile.forbids(reading.space, reading.address, reading.raw)
        if not reading.part and is_along and profile.is_reserved(reading.space, reading.address):
            continue  # read or written along with its neighbours
        if entry is None or entry.reserved:
            values.append(_attribute(profile, reading) if reading.part else _plain(reading))
            continue
        if entry.kind.registers == 1 or reading.space not in WORD_SPACES:
            values += _values(entry, reading, (reading.raw,))
            continue
        steps = range(entry.kind.registers)
        words = [there.get((reading.how, reading.space, entry.address + step)) for step in steps]
        whole = [word for word in words if word is not None]
        if len(whole) < len(words):
            values += _values(entry.word_of(reading.address), reading, (reading.raw,))  # part of a value is none
        elif whole[0] is reading:
            values += _values(entry, reading, [word.raw for word in whole])
    return tuple(values)


def say(profile: Profile | None, readings: Sequence[Reading]) -> str:
    """What an exchange says: "run, reverse", "frequency command 60.00 Hz"; empty when the profile knows nothing."""
    return joined([text for _, text in phrases(profile, readings)])


def phrases(profile: Profile | None, readings: Sequence[Reading]) -> Iterable[tuple[Value, str]]:
    """The values that an exchange tells, each in words with its name."""
    for value in decode(profile, readings):
        if value.entry is not None and not value.bit and not value.says_nothing:
            yield value, phrase(value)
        elif value.reading.part and profile is not None:
            about = profile.at(value.reading.space, value.reading.address)
            if about is not None and not about.reserved:
                yield value, _attribute_phrase(value, about)


def phrase(value: Value) -> str:
    """A value with its name; a command word says what to do by itself."""
    entry = value.entry
    if entry is None:
        return f"{value.name} {value.text}"
    if entry.role is EntryRole.COMMAND and entry.bits:
        return value.text
    if value.words == f"no {entry.title}":
        return value.words  # which says what of
    return _told(brief_title(entry), value.text) + mark(value)


def _told(title: str, text: str) -> str:
    """ "output frequency 30.00 Hz"; of two numbers it must be plain which is the value: "analog output 1: 5.00 V"."""
    return f"{title}: {text}" if title[-1:].isdigit() and text[:1] in "-0123456789" else f"{title} {text}"


def _attribute_phrase(value: Value, about: Entry) -> str:
    """An attribute or property of a known object with its name: "output frequency units degrees-celsius"."""
    return f"{brief_title(about)} {value.reading.part.replace('.', ' ')} {value.text}"


def mark(value: Value) -> str:
    """What stands behind a value that is not to be taken for granted: " (?)", " (out of range)"."""
    entry = value.entry
    if entry is None:
        return ""
    if _is_doubtful(value, entry):
        return " (?)"
    return "" if in_range(entry, value.value) else " (out of range)"


def _is_doubtful(value: Value, entry: Entry) -> bool:
    """Whether a value is to be marked as doubtful: its words may mark what is doubtful of it themselves."""
    if value.text.endswith("(?)"):
        return False
    return not value.reading.sure or (bool(entry.doubt) and "(?)" not in value.text)


def brief_title(entry: Entry) -> str:
    """The same for a line: without what stands behind it in brackets."""
    return _ASIDE.sub("", said_title(entry))


def said_title(entry: Entry) -> str:
    """What an entry is called in words; a parameter with its number: "02-01 motor rated current"."""
    if _PARAMETER.fullmatch(entry.name) and entry.name not in entry.title:
        return f"{entry.name} {entry.title}"
    return entry.title


def number(value: int | float | str, entry: Entry | None = None, unit: str = "") -> str:
    """A value with its unit and the digits that its scale makes."""
    if isinstance(value, str):
        return '"' + "".join(c if c.isprintable() else f"\\x{ord(c):02x}" for c in value) + '"'
    if entry is not None and entry.hexadecimal and isinstance(value, int):
        return f"{value:04X}h"
    scaled = entry is not None and entry.scale != 1 and isinstance(value, float) and math.isfinite(value)
    if scaled and entry is not None and entry.kind not in (*_FLOATS, Kind.REAL):
        text = f"{value:.{_places(value, entry.decimals)}f}"
    else:
        text = digits(value, _SINGLE if entry is not None and entry.kind is Kind.F32 else None)
    return f"{text} {unit}".rstrip()


def _places(value: float, made: int) -> int:
    """How many of the places that a scale has `made` are worth reading."""
    places = min(made, _PLACES)
    return max(places, min(made, 2 - math.floor(math.log10(abs(value))))) if 0 < abs(value) < _SMALL else places


def digits(value: int | float, significant: int | None = None) -> str:
    """A whole number with all its digits, another with as many `significant` ones; where nobody says how many, as its
    float has."""
    if isinstance(value, int) or (value.is_integer() and abs(value) < _EXACT):
        return str(int(value))
    return f"{value:.{significant or (_SINGLE if _is_single(value) else _DOUBLE)}g}"


def _is_single(value: float) -> bool:
    """Whether a float of 32 bits holds it."""
    try:
        return bool(struct.unpack(">f", struct.pack(">f", value))[0] == value)
    except OverflowError:
        return False


def plain_name(space: str, address: int) -> str:
    """ "holding/40108" for Modbus, with six digits from 410000 on; "AI/9" else."""
    first = _FIRST.get(space)
    if first is None:
        return f"{space}/{address}"
    return f"{space}/{first}{address + 1:0{4 if address < 9999 else 5}d}"


def point_name(space: str, address: int, part: str = "") -> str:
    """The same with an attribute or property: "AI/9/priority"."""
    return plain_name(space, address) + (f"/{part}" if part else "")


def state_words(entry: Entry, value: int) -> str:
    """The state or code in the maker's words, empty when it has none."""
    return entry.states.get(value, "")


def _code_words(entry: Entry, value: int) -> str:
    """The same; of a list of faults or alarms a code without a word, too."""
    words = state_words(entry, value)
    if words or not entry.states or not (entry.role in (EntryRole.FAULT, EntryRole.ALARM) or entry.states_from):
        return words
    return f"code {value}" + (", reserved" if value in entry.reserved_codes else "")


def bit_words(entry: Entry, raw: int) -> str:
    """What the bits of a register say; empty when it has no named bits."""
    said = ", ".join(words for words, _ in each_bit(entry, raw))
    return said or (NO_BITS if entry.bits or entry.parts else "")


def each_bit(entry: Entry, raw: int) -> list[tuple[str, EntryRole]]:
    """What each of the bits says, and whether that is a fault or a warning; without those that say nothing."""
    ons = [(bit, raw >> bit.number & 1) for bit in entry.bits]
    words = [(bit.on, bit.role) if on else (bit.off, EntryRole.VALUE) for bit, on in ons]
    held = [(part, part.of(raw)) for part in entry.parts]
    words += [(part.states.get(at, f"{part.name} {at}"), part.roles.get(at, EntryRole.VALUE)) for part, at in held]
    words += [(f"reserved bit {bit:X}", EntryRole.VALUE) for bit in entry.reserved_in(raw)]
    return [one for one in words if one[0]]


def _plain(reading: Reading) -> Value:
    name = point_name(reading.space, reading.address, reading.part)
    quality = _quality(reading, reading.value)
    return Value(name, reading.value, reading.raw, reading.unit, quality, reading, words=_spoken(reading))


def _spoken(reading: Reading) -> str:
    """The protocol's own words for a number; a text speaks for itself."""
    return "" if isinstance(reading.value, str) else reading.words


def _attribute(profile: Profile, reading: Reading) -> Value:
    """An attribute or property of a known object has the object's name."""
    entry = profile.at(reading.space, reading.address)
    base = plain_name(reading.space, reading.address) if entry is None or entry.reserved else entry.name
    quality, words = _quality(reading, reading.value), _spoken(reading)
    return Value(f"{base}/{reading.part}", reading.value, reading.raw, reading.unit, quality, reading, words=words)


def _values(entry: Entry, reading: Reading, raws: Sequence[int | None]) -> Iterable[Value]:
    value, raw = _scaled(entry, reading, raws)
    quality = _quality(reading, value, entry)
    words = ""
    if isinstance(value, int) or (isinstance(value, float) and value.is_integer()):
        words = _code_words(entry, int(value))
        if entry.written and reading.how is Origin.WRITE:
            words = f"{entry.written} {number(value, entry)}"
    if raw is not None and (entry.bits or entry.parts):
        words = bit_words(entry, raw)
    if raw is not None and entry.version:
        words = f"{raw >> 8:x}.{raw & 0xFF:02x}"
    yield Value(entry.name, value, raw, entry.unit, quality, reading, entry, words=words)
    if raw is None:
        return
    for bit in entry.bits:
        on = raw >> bit.number & 1
        yield Value(f"{entry.name}.{bit.name}", on, on, "", quality, reading, entry, True, bit.on if on else bit.off)
    for part in entry.parts:
        held = part.of(raw)
        yield Value(
            f"{entry.name}.{part.name}", held, held, "", quality, reading, entry, True, part.states.get(held, "")
        )


def _scaled(entry: Entry, reading: Reading, raws: Sequence[int | None]) -> tuple[int | float | str, int | None]:
    """The value of an entry and its bits on the wire, in the order of significance; as read where it has none."""
    if entry.kind in (Kind.REAL, Kind.BIT, Kind.TEXT) or reading.space not in WORD_SPACES or None in raws:
        value = reading.value
        if isinstance(value, str) or (entry.scale == 1 and not entry.offset):
            return value, reading.raw
        return _rounded(value, entry), reading.raw
    words = [raw & 0xFFFF for raw in raws if raw is not None]
    if entry.little:
        words = [word >> 8 | (word & 0xFF) << 8 for word in words]
    raw = 0
    for word in reversed(words) if entry.swapped else words:
        raw = raw << 16 | word
    form = _FLOATS.get(entry.kind)
    if form is not None:
        return float(struct.unpack(form, raw.to_bytes(2 * len(words), "big"))[0]) * entry.scale + entry.offset, raw
    width = 16 * len(words)
    signed = raw - (1 << width) if entry.kind.signed and raw >> width - 1 else raw
    return (signed if entry.scale == 1 and not entry.offset else _rounded(signed, entry)), raw


def _rounded(value: float, entry: Entry) -> float:
    """raw · scale + offset without the noise of binary fractions."""
    scaled = value * entry.scale + entry.offset
    return round(scaled, max(entry.decimals, 6)) if math.isfinite(scaled) else scaled


def _quality(reading: Reading, value: int | float | str, entry: Entry | None = None) -> Quality:
    if isinstance(value, float) and not math.isfinite(value):
        return Quality.BAD
    if entry is not None and not in_range(entry, value):
        return Quality.BAD
    return Quality.GOOD if reading.sure and (entry is None or not entry.doubt) else Quality.UNCERTAIN


def in_range(entry: Entry, value: int | float | str) -> bool:
    """Whether the profile allows a value; one that it says nothing of is allowed."""
    if isinstance(value, str):
        return True
    below = entry.low is not None and value < entry.low and not _is_limit(entry, value, entry.low)
    return not (below or (entry.high is not None and value > entry.high and not _is_limit(entry, value, entry.high)))


def _is_limit(entry: Entry, value: int | float, limit: float) -> bool:
    """Whether a float of 32 bits is a limit as near as it can be: 0.1 is 0.100000001 there."""
    return entry.kind in (Kind.F32, Kind.REAL) and math.isclose(value, limit, rel_tol=2**-23)


def bare_range(entry: Entry) -> str:
    """The values that the profile allows, without their unit: "0 … 400"; empty where it says nothing of them."""
    if entry.low is None and entry.high is None:
        return ""
    low, high = ("" if end is None else f"{end:.12g}" for end in (entry.low, entry.high))
    return f"{low} … {high}".strip()


def range_words(entry: Entry) -> str:
    """The same with the unit: "0 … 400 Hz"."""
    span = bare_range(entry)
    return f"{span} {entry.unit}".rstrip() if span else ""


def joined(said: Sequence[str]) -> str:
    """All of it in one line of words."""
    more = len(said) - MOST_WORDS
    shown = said[:MOST_WORDS]
    return "; ".join(shown) + (f"; +{more}" if more > 0 else "")
