"""BACnet values: what primitive tags hold, as Python values, and back (ANSI/ASHRAE 135, 20.2.2 … 20.2.14).

Null → None          Unsigned → int         Real → float        OctetString → bytes     BitString → BitString
Boolean → bool       Signed → Signed        Double → Double     CharacterString → str   Enumerated → Enumerated
Date → Date          Time → Time            ObjectIdentifier → ObjectId        (both of dates.py)
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from dissectors.bacnet import names
from dissectors.bacnet.dates import Date, Time, week_and_day
from dissectors.bacnet.fixed_units import ENDLESS, OF_PARAMETERS, unit_held
from dissectors.bacnet.station_address import mac_text
from dissectors.bacnet.tags import Tag
from dissectors.single_reals import shortest_text

APPLICATION = (
    "Null",
    "Boolean",
    "Unsigned",
    "Signed",
    "Real",
    "Double",
    "OctetString",
    "CharacterString",
    "BitString",
    "Enumerated",
    "Date",
    "Time",
    "ObjectIdentifier",
)
NUMBER_OF = {name: number for number, name in enumerate(APPLICATION)}
UNSPECIFIED_INSTANCE = 0x3FFFFF


class Signed(int):
    """A signed integer: an int that is written with the tag of Signed."""

    __slots__ = ()


class Double(float):
    """A float that is written in 64 bits."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class ObjectId:
    """An object: `type` 0 … 1023, `instance` 0 … 4194303 (the last means unspecified)."""

    type: int
    instance: int

    def __str__(self) -> str:
        instance = "*" if self.instance == UNSPECIFIED_INSTANCE else self.instance
        return f"{self.kind},{instance}"

    @property
    def kind(self) -> str:
        """The type by its name."""
        return names.object_type(self.type)

    def pack(self) -> bytes:
        """Four octets."""
        return struct.pack(">I", (self.type & 0x3FF) << 22 | self.instance & UNSPECIFIED_INSTANCE)

    @classmethod
    def unpack(cls, octets: bytes) -> ObjectId:
        """From four octets."""
        number = int.from_bytes(octets, "big")
        return cls(number >> 22, number & UNSPECIFIED_INSTANCE)

    @classmethod
    def parse(cls, text: str) -> ObjectId:
        """From "device,1234". Raises ValueError."""
        kind, _, instance = text.partition(",")
        number = UNSPECIFIED_INSTANCE if instance == "*" else int(instance)
        return cls(names.number("ObjectType", kind), number)


@dataclass(frozen=True, slots=True)
class Enumerated:
    """A number of an enumeration; `enumeration` is None where the type is not known. Equal by number alone."""

    value: int
    enumeration: str | None = None

    def __str__(self) -> str:
        return names.name(self.enumeration, self.value)

    def __int__(self) -> int:
        return self.value

    def __eq__(self, other: object) -> bool:
        if isinstance(other, (Enumerated, int)):
            return self.value == int(other)
        return NotImplemented

    def __hash__(self) -> int:
        return hash(self.value)


@dataclass(frozen=True, slots=True)
class BitString:
    """Bits in the order of the standard (bit 0 first); `type` names them where it is known."""

    bits: tuple[bool, ...]
    type: str | None = None

    def __str__(self) -> str:
        table = names.bits(self.type) if self.type is not None else None
        if table is None:
            return "".join("1" if bit else "0" for bit in self.bits)
        return "{" + " ".join(table.get(n, str(n)) for n, bit in enumerate(self.bits) if bit) + "}"

    def __eq__(self, other: object) -> bool:
        return self.bits == other.bits if isinstance(other, BitString) else NotImplemented

    def __hash__(self) -> int:
        return hash(self.bits)


@dataclass(frozen=True, slots=True)
class ConstructedValue:
    """A sequence or a choice: named values in wire order. `type` is its name in the tables, None for a service."""

    type: str | None
    entries: tuple[tuple[str, Any], ...]

    def __getitem__(self, name: str) -> Any:
        for key, value in self.entries:
            if key == name:
                return value
        raise KeyError(name)

    def get(self, name: str, default: Any = None) -> Any:
        """The value of that name."""
        return next((value for key, value in self.entries if key == name), default)

    def __contains__(self, name: object) -> bool:
        return any(key == name for key, _ in self.entries)

    def __iter__(self) -> Iterator[tuple[str, Any]]:
        return iter(self.entries)

    def __str__(self) -> str:
        return show(self)


def primitive(type_name: str, octets: bytes) -> Any:
    """The value of a primitive's content. Raises ValueError when the octets are no such value."""
    kind = base(type_name)
    size = len(octets)
    if kind in _FIXED and size != _FIXED[kind]:
        raise ValueError(f"{kind} of {size} octets")
    if kind in ("Unsigned", "Signed", "Enumerated") and not 1 <= size <= 8:
        raise ValueError(f"{kind} of {size} octets")
    match kind:
        case "Null":
            return None
        case "Boolean":
            return octets != b"\x00"
        case "Unsigned":
            return int.from_bytes(octets, "big")
        case "Signed":
            return Signed(int.from_bytes(octets, "big", signed=True))
        case "Real":
            return float(struct.unpack(">f", octets)[0])
        case "Double":
            return Double(struct.unpack(">d", octets)[0])
        case "OctetString":
            return octets
        case "CharacterString":
            return text(octets)
        case "BitString":
            return _bits(octets, None if type_name == "BitString" else type_name)
        case "Enumerated":
            return Enumerated(int.from_bytes(octets, "big"), None if type_name == "Enumerated" else type_name)
        case "Date":
            return Date(*octets)
        case "Time":
            return Time(*octets)
        case "ObjectIdentifier":
            return ObjectId.unpack(octets)
    raise ValueError(f"{type_name} is no primitive type")


_FIXED = {"Null": 0, "Boolean": 1, "Real": 4, "Double": 8, "Date": 4, "Time": 4, "ObjectIdentifier": 4}


def base(type_name: str) -> str | None:
    """The application type that a type is made of; None for sequences, choices, lists and Any."""
    if type_name in NUMBER_OF:
        return type_name
    if names.is_enumeration(type_name):
        return "Enumerated"
    return "BitString" if names.bits(type_name) is not None else None


_JIS = b"\x1b$B"
_CHARSETS = {3: "utf-32-be", 4: "utf-16-be", 5: "latin-1"}
_LITTLE_ENDIAN = b"\x04\xff\xfe"


def is_misnamed(octets: bytes) -> bool:
    """Whether a character string says that it is UTF-8 (or ASCII, as it was before) and is not."""
    if octets[:1] != b"\0" or octets.isascii():
        return False
    try:
        octets[1:].decode("utf-8")
    except UnicodeDecodeError:
        return True
    return False


def text(octets: bytes) -> str:
    """A character string from its character set and octets. What the set cannot say becomes U+FFFD; octets that are no
    UTF-8 stay themselves (`\\xe9`): they may be of any other set. Marks of the order of octets go."""
    if octets[:1] == b"\0":
        return octets[1:].decode("utf-8", "backslashreplace")
    if octets.startswith(_LITTLE_ENDIAN):
        return octets[3:].decode("utf-16-le", "replace")
    if not octets:
        raise ValueError("CharacterString of 0 octets")
    if octets[0] == 1:  # DBCS: two octets of code page first
        page = int.from_bytes(octets[1:3], "big")
        codec = {850: "cp850", 932: "cp932", 936: "cp936", 949: "cp949", 950: "cp950"}.get(page, "latin-1")
        return octets[3:].decode(codec, "replace")
    if octets[0] == 2:  # JIS X 0208: two octets a character, without the escapes that texts have around it
        return (_JIS + octets[1:]).decode("iso2022_jp", "replace")
    return octets[1:].decode(_CHARSETS.get(octets[0], "latin-1"), "replace").removeprefix("\ufeff")


def _bits(octets: bytes, type_name: str | None) -> BitString:
    if not octets or octets[0] > 7 or (len(octets) == 1 and octets[0]):
        raise ValueError("BitString without a valid count of unused bits")
    count = (len(octets) - 1) * 8 - octets[0]
    number = int.from_bytes(octets[1:], "big") >> octets[0]
    return BitString(tuple(bool(number >> (count - 1 - n) & 1) for n in range(count)), type_name)


def pack(type_name: str, value: Any) -> bytes:
    """The content octets of a primitive value. Raises ValueError or TypeError when it does not fit the type."""
    match base(type_name):
        case "Null":
            return b""
        case "Boolean":
            return b"\x01" if value else b"\x00"
        case "Unsigned":
            number = int(value)
            return number.to_bytes(max(1, (number.bit_length() + 7) // 8), "big")
        case "Signed":
            number = int(value)
            return number.to_bytes(((number + (number < 0)).bit_length() + 8) // 8, "big", signed=True)
        case "Real":
            return struct.pack(">f", float(value))
        case "Double":
            return struct.pack(">d", float(value))
        case "OctetString":
            return bytes(value)
        case "CharacterString":
            return b"\x00" + str(value).encode("utf-8", "surrogatepass")
        case "BitString":
            return _pack_bits(type_name, value)
        case "Enumerated":
            number = names.number(type_name, value) if isinstance(value, str) else int(value)
            return number.to_bytes(max(1, (number.bit_length() + 7) // 8), "big")
        case "Date":
            return bytes((value.year, value.month, value.day, value.weekday))
        case "Time":
            return bytes((value.hour, value.minute, value.second, value.hundredths))
        case "ObjectIdentifier":
            return (ObjectId.parse(value) if isinstance(value, str) else value).pack()
    raise ValueError(f"{type_name} is no primitive type")


def _pack_bits(type_name: str, value: Any) -> bytes:
    bits = value.bits if isinstance(value, BitString) else tuple(value)
    unused = -len(bits) % 8
    number = 0
    for bit in bits:
        number = number << 1 | bool(bit)
    return bytes((unused,)) + (number << unused).to_bytes((len(bits) + unused) // 8, "big")


def type_of(value: Any) -> str:
    """The application type that a Python value is written as. Raises TypeError."""
    if value is None:
        return "Null"
    for cls, name in _TYPES:
        if isinstance(value, cls):
            return name
    raise TypeError(f"{value!r} has no application tag")


_TYPES: tuple[tuple[type, str], ...] = (
    (bool, "Boolean"),
    (Signed, "Signed"),
    (int, "Unsigned"),
    (Double, "Double"),
    (float, "Real"),
    (bytes, "OctetString"),
    (str, "CharacterString"),
    (BitString, "BitString"),
    (Enumerated, "Enumerated"),
    (Date, "Date"),
    (Time, "Time"),
    (ObjectId, "ObjectIdentifier"),
)


def show(value: Any, depth: int = 0) -> str:
    """A value for people, in one line; character strings quoted and escaped."""
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return shortest_text(value) if type(value) is float else repr(float(value)).removesuffix(".0")
    if isinstance(value, bytes):
        return value.hex() if len(value) <= 32 else f"{value[:32].hex()}… ({len(value)} octets)"
    if isinstance(value, str):
        return '"' + escape(value) + '"'
    if isinstance(value, ConstructedValue):
        if depth > 16:
            return "…"
        inner = " ".join(f"{name}={show_part(name, entry, depth + 1)}" for name, entry in value.entries)
        return inner if len(value.entries) == 1 else "(" + inner + ")"
    if isinstance(value, (tuple, list)):
        return "[" + ", ".join(show(entry, depth + 1) for entry in value) + "]" if depth <= 16 else "…"
    if isinstance(value, Tag):
        return show_tag(value)
    return str(value)


def show_part(name: str, value: Any, depth: int = 0) -> str:
    """The value of a named part: station addresses as their network writes them, days of a calendar, numbers with the
    unit that the standard fixes for them, else as `show`."""
    if isinstance(value, bytes) and name.endswith("mac-address"):
        return mac_text(value) or "broadcast"
    if isinstance(value, bytes) and name == "week-n-day":
        return week_and_day(value) or show(value, depth)
    if name in OF_PARAMETERS and isinstance(value, int | float):
        return "without end" if name in ENDLESS and not value else f"{show(value)} {OF_PARAMETERS[name]}"
    return show(value, depth)


def show_held(which: int, index: int | None, value: Any) -> str:
    """What a property, or an element of it, holds: numbers with the unit that the standard fixes for it."""
    unit = unit_held(which, index, value)
    return f"{show(value)} {unit}" if unit else show(value)


def show_tag(tag: Tag, depth: int = 0) -> str:
    """A tag whose meaning is not known."""
    if tag.children is not None:
        inner = " ".join(show_tag(child, depth + 1) for child in tag.children) if depth <= 16 else "…"
        return f"[{tag.number}]{{{inner}}}"
    if tag.context:
        return f"[{tag.number}]{tag.octets.hex() or '∅'}"
    if tag.number < len(APPLICATION):
        try:
            return show(primitive(APPLICATION[tag.number], tag.octets))
        except ValueError:
            pass
    return f"app{tag.number}:{tag.octets.hex()}"


def escape(text: str) -> str:
    """Text from the wire made harmless: control, format and unassigned characters as \\x1b or \\u202e."""
    return text if text.isprintable() else "".join(c if c.isprintable() else _escaped(c) for c in text)


def _escaped(character: str) -> str:
    return character.encode("unicode_escape").decode("ascii")
