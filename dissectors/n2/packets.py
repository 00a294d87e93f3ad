"""N2 messages as scapy packets: the full layout, to look at one frame and to craft frames.

    bytes(N2Read(address=1, region=1, object=10, attribute=3))  ==  b">01110A0397\\r"
    bytes(N2Override(address=1, region=3, object=1, value=50.0))  ==  b">017203014248000020\\r"

Every field is characters on the wire. A field that was dissected keeps its spelling (lower case, characters that are
no digits), so that `bytes(packet)` gives the frame back; a field cut off by the end of the frame is empty.
"""

from __future__ import annotations

from typing import Any

from scapy.fields import Field
from scapy.packet import Packet, Raw

from dissectors.checksums import sum8
from dissectors.frame import Frame, Role
from dissectors.n2.commands import error_name
from dissectors.n2.objects import (
    ATTRIBUTES,
    REGIONS,
    Encoding,
    attribute_name,
    decode,
    encode,
    is_hex,
    number,
    region_name,
)

_TRAILER = 3  # two characters of checksum and CR


def _room(remaining: bytes) -> int:
    """Characters before the checksum; without CR the frame was cut off, and everything may be data."""
    return max(0, len(remaining) - _TRAILER) if remaining.endswith(b"\r") else len(remaining)


class Spelled(int):
    """A number that remembers how it was written."""

    spelling: bytes

    def __new__(cls, value: int, spelling: bytes) -> Spelled:
        made = super().__new__(cls, value)
        made.spelling = spelling
        return made

    def __deepcopy__(self, memo: dict[int, Any]) -> Spelled:
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        return Spelled, (int(self), self.spelling)


class CharactersField(Field):
    """Characters as they are: `width` of them, or all up to the checksum when 0. Value: bytes."""

    __slots__ = ("trailer", "width")

    def __init__(self, name: str, default: int | bytes | None, width: int = 0, *, trailer: bool = True) -> None:
        super().__init__(name, default, "s")
        self.width = width
        self.trailer = trailer

    def getfield(self, pkt: Any, s: bytes) -> tuple[bytes, Any]:
        count = _room(s) if self.trailer else len(s)
        if self.width:
            count = min(count, self.width)
        return s[count:], self.m2i(pkt, s[:count])

    def addfield(self, pkt: Any, s: bytes, val: Any) -> bytes:
        return s + self.i2m(pkt, val)

    def m2i(self, pkt: Any, x: bytes) -> Any:
        return x

    def i2m(self, pkt: Any, x: Any) -> bytes:
        return x.encode("latin-1") if isinstance(x, str) else bytes(x or b"")

    def any2i(self, pkt: Any, x: Any) -> Any:
        return x.encode("latin-1") if isinstance(x, str) else x

    def i2repr(self, pkt: Any, x: Any) -> str:
        return repr(x)[1:] if isinstance(x, bytes) else str(x)


class HexField(CharactersField):
    """A number of `width` hex characters. Value: int, or bytes where the characters are no number."""

    def m2i(self, pkt: Any, x: bytes) -> Any:
        if len(x) == self.width and is_hex(x.decode("latin-1")):
            return Spelled(int(x, 16), x)
        return x

    def i2m(self, pkt: Any, x: Any) -> bytes:
        if isinstance(x, Spelled) and len(x.spelling) == self.width:
            return x.spelling
        if isinstance(x, int):
            return b"%0*X" % (self.width, x & (1 << 4 * self.width) - 1)
        return super().i2m(pkt, x)

    def i2repr(self, pkt: Any, x: Any) -> str:
        return self.words(pkt, x) if isinstance(x, int) else super().i2repr(pkt, x)

    def words(self, pkt: Any, x: int) -> str:
        """The number for people."""
        return str(int(x))


class RegionField(HexField):
    """Region of an object; one character in read and write, two in override and release."""

    def words(self, pkt: Any, x: int) -> str:
        return f"{int(x)} ({region_name(x)})"


class AttributeField(HexField):
    """Attribute of an object; None leaves it out, which a write to an internal object may do."""

    def getfield(self, pkt: Any, s: bytes) -> tuple[bytes, Any]:
        region = REGIONS.get(pkt.region if isinstance(pkt.region, int) else 0)
        if isinstance(pkt, N2Write) and region and region.number >= 5 and _room(s) == region.value.width:
            return s, None
        return super().getfield(pkt, s)

    def words(self, pkt: Any, x: int) -> str:
        name = attribute_name(int(pkt.region), x) if isinstance(pkt.region, int) else ""
        return f"{int(x)} ({name})" if name else str(int(x))


class ValueField(CharactersField):
    """A value, written as its object asks. Value: bytes as on the wire; a number when crafting."""

    def encoding(self, pkt: Any) -> Encoding | None:
        """How the value of the object that the packet names is written."""
        region = REGIONS.get(pkt.region if isinstance(pkt.region, int) else 0)
        attribute = getattr(pkt, "attribute", None)
        if region is None or attribute is None:
            return region.value if region else None
        known = ATTRIBUTES.get((region.number, attribute)) if isinstance(attribute, int) else None
        return known.encoding if known else None

    def i2m(self, pkt: Any, x: Any) -> bytes:
        if isinstance(x, (int, float)):
            return encode(x, self.encoding(pkt) or Encoding.FLOAT).encode("ascii")
        return super().i2m(pkt, x)

    def i2repr(self, pkt: Any, x: Any) -> str:
        encoding = self.encoding(pkt)
        if isinstance(x, bytes) and encoding is not None:
            value = decode(x.decode("latin-1"), encoding, signed=pkt.region == 6)
            if value is not None:
                return f"{number(value)} ({x.decode('latin-1')})"
        return super().i2repr(pkt, x)


class ErrorField(CharactersField):
    """The two characters after N."""

    def getfield(self, pkt: Any, s: bytes) -> tuple[bytes, Any]:
        count = min(self.width, len(s.removesuffix(b"\r")))
        return s[count:], s[:count]

    def i2repr(self, pkt: Any, x: Any) -> str:
        name = error_name(x.decode("latin-1")) if isinstance(x, bytes) else ""
        return f"{super().i2repr(pkt, x)} ({name})" if name else super().i2repr(pkt, x)


class ChecksumField(HexField):
    """Sum of the characters after the first, modulo 256; computed when None."""

    def __init__(self) -> None:
        super().__init__("checksum", None, 2)

    def getfield(self, pkt: Any, s: bytes) -> tuple[bytes, Any]:
        count = min(self.width, len(s) - 1) if s.endswith(b"\r") else 0
        return s[count:], self.m2i(pkt, s[:count])

    def words(self, pkt: Any, x: int) -> str:
        return f"{int(x):02X}"


class N2Message(Packet):
    """What all messages share: a start character, fields, a checksum, CR."""

    name = "N2 message"
    fields_desc: tuple[Field, ...] = ()

    def post_build(self, pkt: bytes, pay: bytes) -> bytes:
        """Put the checksum before the CR when none was given."""
        if "checksum" in self.fieldtype and self.checksum is None:
            end = len(self.end or b"")
            body = pkt[: len(pkt) - end]
            pkt = body + self.checksum_of(body) + pkt[len(pkt) - end :]
        return pkt + pay

    def checksum_of(self, body: bytes) -> bytes:
        """Checksum characters for start character and fields."""
        return b"%02X" % sum8(body[1:])

    def extract_padding(self, s: bytes) -> tuple[bytes, bytes]:
        """Nothing follows the CR; what does is shown as padding."""
        return b"", s


def _start(character: bytes) -> CharactersField:
    return CharactersField("start", character, 1, trailer=False)


def _end() -> CharactersField:
    return CharactersField("end", b"\r", trailer=False)


def _head(code: bytes) -> list[Field]:
    return [_start(b">"), HexField("address", 1, 2), CharactersField("command", code, len(code))]


def _tail(rest: str = "data") -> list[Field]:
    return [CharactersField(rest, b""), ChecksumField(), _end()]


class N2Command(N2Message):
    """A command without named fields: polls, warm reset, identify, uploads, and those nobody documents."""

    name = "N2 command"
    fields_desc = (*_head(b"F"), *_tail())


class N2SubCommand(N2Message):
    """A command of two characters without named fields."""

    name = "N2 command"
    fields_desc = (*_head(b"04"), *_tail())


class N2Read(N2Message):
    """Read an attribute."""

    name = "N2 read"
    fields_desc = (
        *_head(b"1"),
        RegionField("region", 1, 1),
        HexField("object", 1, 2),
        AttributeField("attribute", 3, 2),
        *_tail(),
    )


class N2Write(N2Message):
    """Write an attribute; without attribute the current value of an internal object."""

    name = "N2 write"
    fields_desc = (
        *_head(b"2"),
        RegionField("region", 1, 1),
        HexField("object", 1, 2),
        AttributeField("attribute", None, 2),
        ValueField("value", b""),
        ChecksumField(),
        _end(),
    )


class N2Override(N2Message):
    """Override the value of an object."""

    name = "N2 override"
    fields_desc = (
        *_head(b"72"),
        RegionField("region", 3, 2),
        HexField("object", 1, 2),
        ValueField("value", b""),
        ChecksumField(),
        _end(),
    )


class N2Release(N2Message):
    """Release an override."""

    name = "N2 release"
    fields_desc = (*_head(b"73"), RegionField("region", 3, 2), HexField("object", 1, 2), *_tail())


class N2Acknowledge(N2Message):
    """`A` CR, without checksum."""

    name = "N2 acknowledge"
    fields_desc = (_start(b"A"), _end())


class N2Answer(N2Message):
    """`A`, data, checksum, CR. What the data mean depends on the command."""

    name = "N2 answer"
    fields_desc = (_start(b"A"), *_tail())


class N2Refusal(N2Message):
    """`N`, two characters of error code, CR, without checksum."""

    name = "N2 refusal"
    fields_desc = (_start(b"N"), ErrorField("error", b"01", 2, trailer=False), _end())


_BY_CODE: dict[bytes, type[N2Message]] = {b"1": N2Read, b"2": N2Write, b"72": N2Override, b"73": N2Release}


def packet(frame: Frame, role: Role) -> Packet:
    """The packet of a frame; its role makes no difference."""
    return dissect(frame.octets)


def dissect(octets: bytes) -> Packet:
    """The packet of a frame; total: what does not parse is Raw."""
    made = _class_of(octets)
    if made is None:
        return Raw(octets)
    try:
        return made(octets)
    except Exception:  # scapy raises whatever its fields raise; a frame from the wire must always show
        return Raw(octets)


def _class_of(octets: bytes) -> type[N2Message] | None:
    if octets[:1] == b">":
        if octets[3:4] in (b"0", b"7", b"8", b"9"):
            return _BY_CODE.get(octets[3:5], N2SubCommand)
        return _BY_CODE.get(octets[3:4], N2Command)
    if octets[:1] == b"N":
        return N2Refusal
    if octets[:1] == b"A":
        return N2Acknowledge if len(octets) <= 2 else N2Answer
    return None
