"""The commands and error codes of N2 as data, and the one place that takes a command apart.

    '>' AA C [S] fields … KK CR      S only after 0, 7, 8 and 9

Regions are one character in commands 1 and 2 and two characters in 7/2 and 7/3 (digimat.n2; GE AF-600 manual).
Commands that are not in the table are shown, never called errors: Johnson Controls' own controllers and Optomux
buses use the same frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

from dissectors.n2.objects import ATTRIBUTES, INTERNAL, REGIONS, Encoding, decode, is_hex


@dataclass(frozen=True, slots=True)
class CommandType:
    """A command. `region`: characters of its region field, 0 for none; `attribute`: whether one follows the object.

    `data`: whether anything may follow the named fields.
    """

    kind: str
    title: str
    region: int = 0
    attribute: bool = False
    data: bool = False


COMMANDS: dict[str, CommandType] = {
    "00": CommandType("synchronise-time", "synchronise time", data=True),
    "01": CommandType("read-memory", "read memory", data=True),
    "04": CommandType("poll", "poll"),
    "05": CommandType("poll-acknowledge", "poll, acknowledging the last report"),
    "08": CommandType("warm-reset", "warm reset"),
    "09": CommandType("status-update", "status update"),
    "1": CommandType("read-attribute", "read", region=1, attribute=True),
    "2": CommandType("write-attribute", "write", region=1, attribute=True, data=True),
    "72": CommandType("override", "override", region=2, data=True),
    "73": CommandType("release-override", "release", region=2),
    "77": CommandType("write-all-attributes", "write all attributes", data=True),
    "78": CommandType("read-all-attributes", "read all attributes", data=True),
    "80": CommandType("upload-request", "upload request", data=True),
    "81": CommandType("upload", "upload, step 1", data=True),
    "83": CommandType("upload-record", "upload record", data=True),
    "84": CommandType("upload-complete", "upload complete", data=True),
    "90": CommandType("download-request", "download request", data=True),
    "91": CommandType("download", "download, step 1", data=True),
    "93": CommandType("download-record", "download record", data=True),
    "94": CommandType("download-complete", "download complete", data=True),
    "F": CommandType("identify", "identify"),
}
"""Command and sub-command characters → command."""

NATIVE = CommandType("native-command", "JCI-native or other command", data=True)
UNKNOWN = CommandType("unknown-command", "N2-like, unknown command (Optomux family?)", data=True)

NONE = CommandType("no-command", "no command")

_WITH_SUB = frozenset("0789")

ERRORS: dict[str, str] = {
    "00": "has reset, waits for identify",
    "01": "command not supported",
    "02": "checksum error",
    "03": "message too long",
    "05": "wrong command length",
    "10": "value out of range",
    "11": "undefined or reserved field",
    "12": "read-only",
}
"""Error codes as sent (TECO F510 manual 1.2.4). Whether ten may also come as 0A is unknown: `error_name` takes both."""

VENDOR_DEVICE = 0x10
"""What `identify` answers for a device of another maker; other types are Johnson Controls' own controllers."""


def error_name(code: str) -> str:
    """Words for the two characters after N; empty for a code nobody documents."""
    if code in ERRORS:
        return ERRORS[code]
    return ERRORS.get({"0A": "10", "0B": "11", "0C": "12"}.get(code.upper(), ""), "")


def error_text(code: str) -> str:
    """ "N11 undefined or reserved field", or the code alone."""
    return f"N{code} {error_name(code)}".rstrip()


@dataclass(frozen=True, slots=True)
class Command:
    """A command taken apart. None and empty where the frame has no such field or ended before it.

    `code`: command and sub-command characters. `data`: what follows the named fields, as it came.
    """

    type: CommandType
    address: int | None
    code: str
    region: int | None = None
    object: int | None = None
    attribute: int | None = None
    data: str = ""

    @property
    def value(self) -> int | float | None:
        """The value that a write or override carries; None when there is none or it does not fit its object."""
        encoding = self.encoding
        if encoding is None or self.region is None or not self.data:
            return None
        return decode(self.data, encoding, signed=self.region == 6)

    @property
    def encoding(self) -> Encoding | None:
        """How the value of the object or attribute that it names is written; None when unknown."""
        region = REGIONS.get(self.region or 0)
        if region is None:
            return None
        if self.attribute is None:
            return region.value
        known = ATTRIBUTES.get((region.number, self.attribute))
        return known.encoding if known else None


def characters(octets: bytes) -> str:
    """Octets as text, one character each; the caller escapes what is not printable."""
    return octets.decode("latin-1")


def fields_of(octets: bytes) -> str:
    """What stands between `>` or `A` and the checksum: all the rest when the frame did not end with CR."""
    if not octets.endswith(b"\r"):
        return characters(octets[1:])
    return characters(octets[1:-3]) if len(octets) >= 4 else characters(octets[1:-1])


@lru_cache(maxsize=4096)  # a master asks the same things all day
def parse_command(octets: bytes) -> Command:
    """Take a whole command frame apart; total, also for damaged ones."""
    body = fields_of(octets)
    address = _hex(body[:2], 2)
    code = body[2:4] if body[2:3] in _WITH_SUB else body[2:3]
    kind = COMMANDS.get(code)
    rest = body[2 + len(code) :]
    if kind is None:
        other = NONE if not code else NATIVE if is_hex(code[:1]) else UNKNOWN
        return Command(other, address, code, data=rest)
    if not kind.region:
        return Command(kind, address, code, data=rest)
    region = _hex(rest[: kind.region], kind.region)
    number = _hex(rest[kind.region : kind.region + 2], 2)
    rest = rest[kind.region + 2 :]
    if not kind.attribute or _leaves_attribute_out(kind, region, len(rest)):
        return Command(kind, address, code, region, number, None, rest)
    return Command(kind, address, code, region, number, _hex(rest[:2], 2), rest[2:])


def _leaves_attribute_out(kind: CommandType, region: int | None, length: int) -> bool:
    """A write to an internal object may leave the attribute out; only the length tells (digimat.n2, Danfoss)."""
    return kind.data and region in INTERNAL and length == REGIONS[region].value.width


def expected_length(octets: bytes) -> int | None:
    """Octets, `>` to CR, that a command of this kind has; None where its first characters do not say."""
    code = characters(octets[3:5]) if octets[3:4] in (b"0", b"7", b"8", b"9") else characters(octets[3:4])
    kind = COMMANDS.get(code)
    if kind is None:
        return None
    fixed = 1 + 2 + len(code) + (kind.region + 2 if kind.region else 0) + 2 * kind.attribute + 3
    if not kind.data:
        return fixed
    if kind.kind == "override":
        region = REGIONS.get(_hex(characters(octets[5:7]), 2) or 0)
        return fixed + region.value.width if region else None
    return None


def has_other_length(octets: bytes) -> bool:
    """Whether it begins as a command that is longer or shorter: right by its sum, it may be two frames all the same."""
    expected = expected_length(octets) if octets[:1] == b">" else None
    return expected is not None and expected != len(octets)


def _hex(text: str, width: int) -> int | None:
    return int(text, 16) if len(text) == width and is_hex(text) else None
