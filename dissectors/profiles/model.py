"""The model of a device, as data: identity, register and object maps, limits, the maker's words for errors. Frozen.

A profile is made from a TOML document (`parsing.parse`); nothing here reads a file. Places are those of the wire: an
offset between the manual's numbers and the wire is already applied. README.md has the format.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum

from dissectors.pseudonyms import is_blank
from dissectors.readings import Reading


class Kind(Enum):
    """How the bits of an entry are read. `size`: bits, 0 for what carries its own size."""

    U16 = "u16"
    S16 = "s16"
    U32 = "u32"
    S32 = "s32"
    F32 = "f32"
    U64 = "u64"
    S64 = "s64"
    F64 = "f64"
    BIT = "bit"
    REAL = "real"  # a number that the protocol itself encodes (N2, BACnet)
    TEXT = "text"

    @property
    def registers(self) -> int:
        """How many consecutive registers it takes."""
        return {"32": 2, "64": 4}.get(self.value[1:], 1)

    @property
    def signed(self) -> bool:
        """Whether it is a whole number that may be below 0."""
        return self in (Kind.S16, Kind.S32, Kind.S64)


class Access(Enum):
    """What a master may do."""

    READ = "r"
    WRITE = "w"
    BOTH = "rw"
    STOPPED = "rw-stopped"  # written only while the device is stopped

    @property
    def writable(self) -> bool:
        return self is not Access.READ


class EntryRole(Enum):
    """What an entry is for, where that matters to a rule."""

    VALUE = "value"
    COMMAND = "command"  # tells the device what to do
    FAULT = "fault"  # the device has stopped because of it
    ALARM = "alarm"  # the device warns
    RUNNING = "running"  # it runs: what may be written only while it is stopped may not be written


_OUTPUTS = "dp-output"
"""The table of cyclic outputs: a master gives all of them to a station at once, over and over."""

WORD_SPACES = ("holding", "input", "dp-input", _OUTPUTS)
"""Tables of 16-bit words, several of which may be one value."""


@dataclass(frozen=True, slots=True)
class Bit:
    """One bit of a register. `on`, `off`: what 1 and 0 say in words; empty: nothing worth saying. `role`: of a 1."""

    number: int
    name: str
    on: str
    off: str = ""
    role: EntryRole = EntryRole.VALUE


@dataclass(frozen=True, slots=True)
class BitField:
    """Several bits of a register that are one number: bits `low` … `high`, `states` its values in words.

    `roles`: those of its values that say that the device has a fault, warns, or runs.
    """

    low: int
    high: int
    name: str
    states: Mapping[int, str]
    roles: Mapping[int, EntryRole] = field(default_factory=dict)

    def of(self, raw: int) -> int:
        """The number that these bits make."""
        return raw >> self.low & (1 << self.high - self.low + 1) - 1


@dataclass(frozen=True, slots=True)
class Entry:
    """One register or object.

    `space`, `address`: its place on the wire ("holding" 0x2524, "AI" 10, "analog-input" 4). `number`: the place as the
    manual writes it. `name`: of the point, the same for the same thing in every protocol of the device; `title`: for
    people; `label`: what the device itself calls it (BACnet's Object_Name). value = raw · `scale` + `offset`, in
    `unit`, within `low` … `high` (None: not said). `states_from`: the entry whose states these are; `like`: the entry
    that says the same thing at another place. `printed_unit`: what the manual prints in place of `unit` by mistake: the
    device itself may answer either. `written`: what a master writes there, in words, where that is no state
    ("password"). `reserved_codes`: codes that the manual lists without a meaning; `reserved_bits`: bits that are to be
    written as 0. `version`: the digits are a version, 0100h is 1.00; `hexadecimal`: people write it so, 0310h.
    `default`: as the device leaves the maker, scaled. `doubt`: why its meaning is not certain, in words.
    """

    space: str
    address: int
    number: str
    name: str
    title: str
    label: str = ""
    kind: Kind = Kind.U16
    swapped: bool = False  # low register first
    little: bool = False  # low octet of a register first
    scale: float = 1.0
    offset: float = 0.0
    unit: str = ""
    printed_unit: str = ""
    low: float | None = None
    high: float | None = None
    access: Access = Access.BOTH
    role: EntryRole = EntryRole.VALUE
    reserved: bool = False
    states: Mapping[int, str] = field(default_factory=dict)
    states_from: str = ""
    like: str = ""
    reserved_codes: frozenset[int] = frozenset()
    reserved_bits: tuple[int, ...] = ()
    written: str = ""
    version: bool = False
    hexadecimal: bool = False
    default: float | None = None
    bits: tuple[Bit, ...] = ()
    parts: tuple[BitField, ...] = ()
    doubt: str = ""

    @property
    def places(self) -> tuple[tuple[str, int], ...]:
        """Where it stands: the table and the address of each of its registers."""
        count = self.kind.registers if self.space in WORD_SPACES else 1
        return tuple((self.space, self.address + step) for step in range(count))

    @property
    def decimals(self) -> int:
        """Digits after the point that scale and offset make."""
        texts = (f"{part:.11f}".rstrip("0") for part in (self.scale, self.offset))
        return max(len(text.partition(".")[2]) for text in texts)

    def reserved_in(self, raw: int) -> tuple[int, ...]:
        """The reserved bits that are 1."""
        return tuple(bit for bit in self.reserved_bits if raw >> bit & 1)

    def held(self, raw: int, address: int) -> int:
        """The bits of the register at `address`, one of those that make this value, at their place in the value."""
        word = raw >> 8 & 0xFF | (raw & 0xFF) << 8 if self.little else raw
        return word << self._below(address)

    def _below(self, address: int) -> int:
        """How many bits of the value are less than those of the register at `address`."""
        at = address - self.address
        return 16 * (at if self.swapped else self.kind.registers - 1 - at)

    def word_of(self, address: int) -> Entry:
        """The register at `address`, one of the several that make this value, by itself: its high or low word, or
        with four of them words 1 (the highest) … 4. It has the bits that stand in it; a code it is none."""
        count, below = self.kind.registers, self._below(address)
        place = count - 1 - below // 16
        word = ("high", "low")[place] if count == 2 else f"{place + 1}"
        return replace(
            self,
            address=address,
            name=f"{self.name}.{word}",
            title=f"{self.title}, {word} word" if count == 2 else f"{self.title}, word {word}",
            kind=Kind.U16,
            scale=1.0,
            offset=0.0,
            unit="",
            low=None,
            high=None,
            role=self.role if self.bits else EntryRole.VALUE,
            states={},
            states_from="",
            reserved_codes=frozenset(),
            reserved_bits=tuple(bit - below for bit in self.reserved_bits if 0 <= bit - below < 16),
            bits=tuple(replace(bit, number=bit.number - below) for bit in self.bits if 0 <= bit.number - below < 16),
            parts=tuple(
                replace(part, low=part.low - below, high=part.high - below)
                for part in self.parts
                if part.low - below >= 0 and part.high - below < 16
            ),
        )


@dataclass(frozen=True, slots=True)
class Sign:
    """What a device of this kind answers at a place. `value` None: it answers at all; `title`: for people."""

    space: str
    address: int
    part: str = ""
    value: int | float | str | None = None
    title: str = ""

    def is_of(self, reading: Reading) -> bool:
        """Whether a reading is of this place; a device object may have any instance."""
        same = reading.address == self.address or self.space == "device"
        return same and (reading.space, reading.part) == (self.space, self.part)

    def fits(self, reading: Reading) -> bool | None:
        """Whether a reading of this place is of such a device; None where a text was blanked."""
        if isinstance(reading.value, str) and is_blank(reading.value):
            return None
        return self.value is None or reading.value == self.value


@dataclass(frozen=True, slots=True)
class Limits:
    """What the device promises or cannot take; None: not said.

    `frame`: octets; `response`: ns; `stations`: the lowest and the highest number that it can be given; `functions`:
    the codes that it knows; `unexecuted`: what it acknowledges and does not do, as the kind of the exchange, or that
    and the kind of object: "release-override", "override:AI". `responses`: ns by rate (Bd), where that differs.
    `read_only`: attributes and properties that can only be read, with their kind of object: "AI:object-status"; kinds
    of exchange that do not change the value of a kind of object: "write-attribute:AO".
    """

    frame: int | None = None
    response: int | None = None
    stations: tuple[int, int] | None = None
    functions: frozenset[int] | None = None
    unexecuted: frozenset[str] = frozenset()
    read_only: frozenset[str] = frozenset()
    responses: Mapping[int, int] = field(default_factory=dict)

    def ignores(self, kind: str, space: str = "") -> bool:
        """Whether an exchange of that kind is acknowledged and not done."""
        return bool(self.unexecuted) and (kind in self.unexecuted or f"{kind}:{space}" in self.unexecuted)


@dataclass(frozen=True, slots=True)
class Profile:
    """Everything known of one kind of device.

    `noun`: what a person calls it ("drive"). `protocols`: registry names. `limits`, `exceptions`: by family ("modbus",
    "n2", "bacnet"); the exceptions are exception and error codes in the maker's words. `properties`: BACnet property →
    object types that have it. `constants`: BACnet device property → its value. `facts`: what a GSD file says of it,
    by keyword. `absent`: parameters that the manual
    lists without a register. `reserved`: spans of registers (first, last, on the wire) that the maker keeps for itself.
    `address_offset`: number on the wire less the manual's.
    `document`: the text of the TOML document that all this was read from.
    """

    name: str
    title: str
    vendor: str
    models: tuple[str, ...]
    noun: str
    protocols: tuple[str, ...]
    entries: tuple[Entry, ...]
    limits: Mapping[str, Limits] = field(default_factory=dict)
    exceptions: Mapping[str, Mapping[int, str]] = field(default_factory=dict)
    signs: tuple[Sign, ...] = ()
    properties: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    constants: Mapping[str, str | int] = field(default_factory=dict)
    facts: Mapping[str, str | int] = field(default_factory=dict)
    absent: tuple[str, ...] = ()
    reserved: tuple[tuple[int, int], ...] = ()
    address_offset: int = 0
    source: str = ""
    origin: str = ""
    document: str = field(default="", repr=False, compare=False)
    _places: Mapping[tuple[str, int], Entry] = field(init=False, repr=False, compare=False, hash=False)

    def __post_init__(self) -> None:
        places = {place: entry for entry in self.entries for place in entry.places}
        object.__setattr__(self, "_places", places)

    def at(self, space: str, address: int) -> Entry | None:
        """The entry that covers a place; None when the profile has none."""
        return self._places.get((space, address))

    def number_of(self, space: str, address: int) -> str:
        """A place as the manual writes it: "0382h", "AI 10"."""
        entry = self.at(space, address)
        if space in ("holding", "input") and (entry is None or entry.kind.registers > 1):
            return f"{address - self.address_offset:04X}h"
        return entry.number if entry is not None else f"{space} {address}"

    def is_reserved(self, space: str, address: int) -> bool:
        """Whether the maker keeps a register for itself."""
        entry = self.at(space, address)
        if entry is not None:
            return entry.reserved
        return space in ("holding", "input") and any(first <= address <= last for first, last in self.reserved)

    def forbids(self, space: str, address: int, raw: int | None) -> bool:
        """Whether the maker forbids to write `raw`: to a reserved place; but cyclic outputs are always sent whole, and
        their reserved words as 0."""
        return self.is_reserved(space, address) and not (space == _OUTPUTS and raw == 0)

    def in_space(self, *spaces: str) -> Iterator[Entry]:
        """The entries of some tables, in the order of the profile."""
        return (entry for entry in self.entries if entry.space in spaces)

    def limits_on(self, family: str) -> Limits:
        """What the device promises on the protocols of a family (`Dissector.profile_family`)."""
        return self.limits.get(family, Limits())

    def lacks(self, space: str, part: str) -> bool:
        """Whether the maker says that objects of this kind do not have a property; without a `part`, a value."""
        kinds = self.properties.get(part.partition(".")[0] or "present-value")
        return kinds is not None and space not in kinds and any(space in k for k in self.properties.values())

    def exception(self, family: str, code: int) -> str:
        """The maker's words for an exception code; empty when there are none."""
        return self.exceptions.get(family, {}).get(code, "")
