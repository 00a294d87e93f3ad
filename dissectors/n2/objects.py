"""The objects of an N2 station as data: regions, attributes, value encodings, and what is only guessed about octets.

A value travels as upper-case hex characters: a float as IEEE-754 single, high octet first, 8 characters; an integer
as 16 bits, 4; a byte 2. Regions and attributes agree between several vendors (TECO F510 manual 1.2.4, Danfoss
MG.11.G1, Rockwell 20-COMM-H UM009, Nidec H300 10.5). No public source gives the positions of the status and
configuration bits: `guessed_bits` is tentative and is to be shown beside the raw characters only.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from enum import Enum

from dissectors.single_reals import shortest


class Encoding(Enum):
    """How a value is written; the value of the member is its length in characters."""

    FLOAT = 8
    INTEGER = 4
    BYTE = 2

    @property
    def width(self) -> int:
        """Characters."""
        return self.value


@dataclass(frozen=True, slots=True)
class Region:
    """A kind of object. `value`: how its current value is written; `current`: the attribute that holds it."""

    number: int
    name: str
    title: str
    value: Encoding
    current: int
    signed: bool = False


REGIONS: dict[int, Region] = {
    region.number: region
    for region in (
        Region(1, "AI", "analog input", Encoding.FLOAT, 3),
        Region(2, "BI", "binary input", Encoding.BYTE, 2),
        Region(3, "AO", "analog output", Encoding.FLOAT, 3),
        Region(4, "BO", "binary output", Encoding.BYTE, 2),
        Region(5, "ADF", "internal float", Encoding.FLOAT, 2),
        Region(6, "ADI", "internal integer", Encoding.INTEGER, 2, signed=True),
        Region(7, "BD", "internal byte", Encoding.BYTE, 2),
    )
}
"""Region number → region; TECO F510 manual 1.2.3 counts the same seven."""

INTERNAL = frozenset((5, 6, 7))
"""Regions whose write command may leave the attribute out."""


@dataclass(frozen=True, slots=True)
class Attribute:
    """One attribute of a region. `otherwise`: its meaning in products that number the limits differently."""

    name: str
    encoding: Encoding | None
    otherwise: str = ""


_CONFIGURATION = Attribute("object configuration", Encoding.BYTE)
_STATUS = Attribute("object status", Encoding.BYTE)
_JCI = Attribute("reserved by JCI", None)


def _limit(name: str, otherwise: str = "") -> Attribute:
    return Attribute(name, Encoding.FLOAT, otherwise)


ATTRIBUTES: dict[tuple[int, int], Attribute] = {
    (1, 1): _CONFIGURATION,
    (1, 2): _STATUS,
    (1, 3): Attribute("current value", Encoding.FLOAT),
    # FieldServer and digimat put the five limits at 4 … 8; Rockwell, Danfoss, ABB and Nidec at 8 … 12.
    (1, 4): Attribute("reserved by JCI", Encoding.FLOAT, "low alarm limit"),
    (1, 5): Attribute("reserved by JCI", Encoding.FLOAT, "high alarm limit"),
    (1, 6): Attribute("reserved by JCI", Encoding.FLOAT, "low warning limit"),
    (1, 7): Attribute("reserved by JCI", Encoding.FLOAT, "high warning limit"),
    (1, 8): _limit("low alarm limit", "differential"),
    (1, 9): _limit("low warning limit"),
    (1, 10): _limit("high warning limit"),
    (1, 11): _limit("high alarm limit"),
    (1, 12): _limit("differential"),
    (2, 1): _CONFIGURATION,
    (2, 2): _STATUS,
    (3, 1): _CONFIGURATION,
    (3, 2): _STATUS,
    (3, 3): Attribute("current value", Encoding.FLOAT),
    (3, 4): _JCI,
    (3, 5): _JCI,
    (4, 1): _CONFIGURATION,
    (4, 2): _STATUS,
    (4, 3): Attribute("minimum on-time", Encoding.INTEGER),
    (4, 4): Attribute("minimum off-time", Encoding.INTEGER),
    (4, 5): Attribute("maximum cycles an hour", Encoding.INTEGER),
    (4, 6): _JCI,
    (4, 7): _JCI,
    (5, 1): _STATUS,
    (5, 2): Attribute("current value", Encoding.FLOAT),
    (6, 1): _STATUS,
    (6, 2): Attribute("current value", Encoding.INTEGER),
    (7, 1): _STATUS,
    (7, 2): Attribute("current value", Encoding.BYTE),
}
"""(region, attribute) → what it is. The F510 manual prints BO 4 as a second on-time: a slip, other vendors agree."""


def region_name(region: int) -> str:
    """Short name: "AI" … "BD", else "region N"."""
    known = REGIONS.get(region)
    return known.name if known else f"region {region}"


def object_name(region: int, number: int) -> str:
    """ "AI 3"."""
    return f"{region_name(region)} {number}"


def attribute_name(region: int, attribute: int) -> str:
    """Name of an attribute, both readings where the vendors' numbering differs; empty when unknown."""
    known = ATTRIBUTES.get((region, attribute))
    if known is None:
        return ""
    return f"{known.name}, elsewhere {known.otherwise}" if known.otherwise else known.name


def holds_current_value(region: int, attribute: int) -> bool:
    """Whether the attribute is the analog or internal current value: its answer may carry one octet in front.

    digimat.n2 skips that octet unnamed; most probably it is the object status. BI and BO answer the status itself.
    """
    known = REGIONS.get(region)
    return known is not None and attribute == known.current and region not in (2, 4)


def decode(characters: str, encoding: Encoding, *, signed: bool = False) -> int | float | None:
    """The value in hex characters; None when the length is wrong or a character is no hex digit.

    A float is the shortest decimal that means the same single, so that 72.1 reads 72.1 and not 72.0999985.
    """
    if len(characters) != encoding.width or not is_hex(characters):
        return None
    octets = bytes.fromhex(characters)
    if encoding is Encoding.FLOAT:
        return shortest(struct.unpack(">f", octets)[0])
    return int.from_bytes(octets, "big", signed=signed and encoding is Encoding.INTEGER)


def encode(value: float, encoding: Encoding) -> str:
    """Hex characters of a value; an integer wraps to its width, a float outside single range becomes infinite."""
    if encoding is Encoding.FLOAT:
        try:
            return struct.pack(">f", value).hex().upper()
        except OverflowError:
            return struct.pack(">f", math.copysign(math.inf, value)).hex().upper()
    return f"{int(value) & (1 << 4 * encoding.width) - 1:0{encoding.width}X}"


_HEX = frozenset("0123456789ABCDEFabcdef")


def is_hex(characters: str) -> bool:
    """Whether all are ASCII hex digits (int() and fromhex() allow more: signs, spaces, underscores)."""
    return _HEX.issuperset(characters)


def number(value: float) -> str:
    """A value for people: "72.5", "50", "-10"."""
    if isinstance(value, int):
        return str(value)
    return f"{value:.9g}"


STATE_BIT = 6
"""Of the status octet of a binary object: its state. Tentative."""

BINARY = frozenset((2, 4))
"""Regions of which the status octet holds the state."""

_ANALOG_CONFIGURATION = ((0, "change of state reported"), (2, "alarm enabled"), (3, "warning enabled"))
_BINARY_CONFIGURATION = ((0, "change of state reported"), (1, "normal state on"), (2, "alarm enabled"))
_BITS: dict[tuple[int, int], tuple[tuple[int, str], ...]] = {
    (1, 1): _ANALOG_CONFIGURATION,
    (2, 1): _BINARY_CONFIGURATION,
    (2, 2): ((STATE_BIT, "state on"),),
    (4, 2): ((STATE_BIT, "state on"),),
}


def state_word(region: int, status: int) -> str:
    """ "on" or "off", as the status octet of a binary object has it; empty of others. Tentative."""
    return "" if region not in BINARY else "on" if status >> STATE_BIT & 1 else "off"


def flags_word(region: int, status: int) -> str:
    """The status octet beside the state of a binary object: "status 41h"; empty where no other bit is set."""
    others = status & ~(1 << STATE_BIT) if region in BINARY else status
    return f"status {status:02X}h" if others else ""


def guessed_bits(region: int, attribute: int, octet: int) -> tuple[str, ...]:
    """Names of the bits set in a configuration or status octet. Tentative: no public source gives the positions."""
    return tuple(name for bit, name in _BITS.get((region, attribute), ()) if octet >> bit & 1)
