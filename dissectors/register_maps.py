"""A map of registers that somebody else wrote, as a device profile to be corrected by hand: what all maps share.

What a map says that a profile cannot say, or that is not understood, is left out and counted (`left_out`). Pure.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from dissectors.profiles.decoding import plain_name
from dissectors.profiles.model import Access, Kind

MOST_ENTRIES = 20_000
"""Entries of a map that are read: three tables of a device have no more that anybody describes."""

LONGEST_TITLE = 200

WORD_TABLES = ("holding", "input")
TABLES = ("holding", "input", "coil", "discrete")

_NOT_OF_A_NAME = re.compile(r"[^a-z0-9_.+]+")


@dataclass(frozen=True, slots=True)
class Mapped:
    """One register or coil of a map. `address`: on the wire, from 0; `title`: as the map has it; `station`: None where
    the map names none. The others as in a profile's `Entry`."""

    space: str
    address: int
    title: str
    kind: Kind = Kind.U16
    swapped: bool = False
    little: bool = False
    scale: float = 1.0
    offset: float = 0.0
    unit: str = ""
    low: float | None = None
    high: float | None = None
    access: Access = Access.BOTH
    states: Mapping[int, str] = field(default_factory=dict)
    doubt: str = ""
    station: int | None = None


@dataclass(slots=True)
class RegisterMap:
    """What was read. `said`: how it was understood, in sentences; `left_out`: what was not, in words, how often."""

    entries: list[Mapped] = field(default_factory=list)
    said: list[str] = field(default_factory=list)
    left_out: Counter[str] = field(default_factory=Counter)

    @property
    def stations(self) -> list[int]:
        """Those that it names."""
        return sorted({one.station for one in self.entries if one.station is not None})

    def of_station(self, station: int) -> RegisterMap:
        """What it says of one station, and of none in particular."""
        entries = [one for one in self.entries if one.station in (None, station)]
        return RegisterMap(entries, self.said, self.left_out)


class MapError(ValueError):
    """No map that can be read; the message says why, and the way out."""


MapReader = Callable[[str, bytes, str, str | None], RegisterMap]
"""(name of the file, its octets, one of `NUMBERINGS`, table) → the map; raises MapError. The table is that of registers
whose map does not say it."""

NUMBERINGS = ("auto", "40001", "0", "1")
"""How numbers are to be read: 40001-style where all can be, else of the wire; 40001-style; of the wire; one more."""


def document(name: str, source: str, said: RegisterMap, family: str, protocols: Sequence[str]) -> tuple[str, int]:
    """The map as a TOML document, and how many entries are in it. `source`: where it is from, for people; `family`,
    `protocols`: as in a profile.

    Of two entries that share a register the first is kept, the other counted.
    """
    entries = _without_overlap(said)
    tables = [space for space in TABLES if any(one.space == space for one in entries)] or ["holding"]
    names = _names(entries)
    lines = [
        "# Imported from a register map: read it through before you trust it; `sniff485 profile check` says what is",
        "# wrong with the document. Addresses are those of the wire, from 0.",
        *(f"# {_comment(sentence)}" for sentence in said.said),
        *(f"# left out: {_comment(what)} ({count})" for what, count in sorted(said.left_out.items())),
        "",
        f"name = {_quoted(name)}",
        f"title = {_quoted(f'{name} (imported)')}",
        f"protocols = [{', '.join(map(_quoted, protocols))}]",
        f"source = {_quoted(source)}",
        "",
        f"[{family}]",
        f"tables = [{', '.join(map(_quoted, tables))}]",
    ]
    for entry, point in zip(entries, names, strict=True):
        lines += ["", *_entry(family, entry, point, of_table=len(tables) > 1)]
    return "\n".join(lines) + "\n", len(entries)


def _without_overlap(said: RegisterMap) -> list[Mapped]:
    kept: list[Mapped] = []
    taken: set[tuple[str, int]] = set()
    for entry in sorted(said.entries, key=lambda one: (TABLES.index(one.space), one.address)):
        width = entry.kind.registers if entry.space in WORD_TABLES else 1
        places = {(entry.space, entry.address + step) for step in range(width)}
        if entry.address + width > 0x10000 or entry.address < 0:
            said.left_out["numbers beyond 0 … 65535"] += 1
        elif places & taken:
            said.left_out["registers that are described twice"] += 1
        else:
            taken |= places
            kept.append(entry)
    return kept


def _names(entries: Sequence[Mapped]) -> list[str]:
    """A name for each that no other has."""
    used: set[str] = set()
    newest: Counter[str] = Counter()  # the last number behind a name: thousands of entries may be called "reserved"
    names = []
    for entry in entries:
        slug = _NOT_OF_A_NAME.sub("-", entry.title.lower()).strip("-_.+")[:60].rstrip("-_.+")
        wanted = slug or plain_name(entry.space, entry.address).replace("/", "-")
        name, number = wanted, max(newest[wanted], 1)
        while name in used:
            number += 1
            name = f"{wanted}-{number}"
        newest[wanted] = number
        used.add(name)
        names.append(name)
    return names


def _entry(family: str, entry: Mapped, name: str, of_table: bool) -> list[str]:
    lines = [f"[[{family}.register]]", f"address = 0x{entry.address:04X}", f"name = {_quoted(name)}"]
    if entry.title:
        lines.append(f"title = {_quoted(entry.title[:LONGEST_TITLE])}")
    if of_table:
        lines.append(f"tables = [{_quoted(entry.space)}]")
    if entry.kind is not Kind.U16:
        lines.append(f"type = {_quoted(entry.kind.value)}")
    if entry.swapped:
        lines.append('word-order = "low-first"')
    if entry.little:
        lines.append('octet-order = "low-first"')
    for key, value, usual in (("scale", entry.scale, 1.0), ("offset", entry.offset, 0.0)):
        if value != usual:
            lines.append(f"{key} = {_number(value)}")
    if entry.unit:
        lines.append(f"unit = {_quoted(entry.unit)}")
    if entry.low is not None and entry.high is not None and entry.low <= entry.high:
        lines.append(f"range = [{_number(entry.low)}, {_number(entry.high)}]")
    if entry.access is not Access.BOTH:
        lines.append(f"access = {_quoted(entry.access.value)}")
    if entry.doubt:
        lines.append(f"doubt = {_quoted(entry.doubt)}")
    if entry.states:
        lines.append(f"[{family}.register.states]")
        lines += [f"{code} = {_quoted(words)}" for code, words in sorted(entry.states.items())]
    return lines


def _number(value: float) -> str:
    """As TOML has it: whole numbers without a point, small ones without loss."""
    return str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)


def _quoted(text: str) -> str:
    """A TOML basic string: what JSON escapes, TOML reads; what is no text of its own (half a pair) is marked."""
    clean = text.encode("utf-8", "replace").decode()
    return json.dumps("".join(c if c.isprintable() else "?" for c in clean), ensure_ascii=False)


def _comment(text: str) -> str:
    return "".join(c if c.isprintable() else "?" for c in text.encode("utf-8", "replace").decode())


# --- words that all maps use ---

_KINDS: dict[Kind, str] = {
    Kind.U16: "u16 uint16 word ushort unsignedshort unsigned16 unsignedint16 uint unsigned unsigned16bit 16bitunsigned",
    Kind.S16: "s16 int16 i16 short signed16 sint16 int signed integer signedint16 signed16bit 16bitsigned signedshort",
    Kind.U32: "u32 uint32 dword udint ulong unsigned32 unsignedint32 unsignedlong unsigned32bit 32bitunsigned longword",
    Kind.S32: "s32 int32 i32 dint long signed32 sint32 signedint32 signedlong signed32bit 32bitsigned",
    Kind.F32: "f32 float float32 real real32 single ieee754 floatieee floatingpoint 32bitfloat float32bit ieee",
    Kind.U64: "u64 uint64 qword ulint unsigned64 unsignedint64 unsigned64bit 64bitunsigned",
    Kind.S64: "s64 int64 i64 lint signed64 sint64 signedint64 signed64bit 64bitsigned longlong",
    Kind.F64: "f64 double float64 lreal real64 64bitfloat float64bit",
    Kind.BIT: "bit bool boolean digital binary flag coil",
}
_BY_WORD = {word: kind for kind, words in _KINDS.items() for word in words.split()}
_WIDER = {
    (Kind.U16, 2): Kind.U32,
    (Kind.S16, 2): Kind.S32,
    (Kind.U16, 4): Kind.U64,
    (Kind.S16, 4): Kind.S64,
    (Kind.U32, 4): Kind.U64,
    (Kind.S32, 4): Kind.S64,
    (Kind.F32, 4): Kind.F64,
}
_ORDERS = (
    # words in a type or an order → swapped, little
    (r"dcba|wordbyte|bytewordswap|littleendianbyteswap$", (True, True)),
    (r"badc|byteswap|swappedbytes", (False, True)),
    (r"cdab|wordswap|swap|swapped|lowwordfirst|lowfirst|lsw|mixedendian|inverse|reversed?", (True, False)),
    (r"abcd|bigendian|highwordfirst|highfirst|msw|normal|none|^be$", (False, False)),
    (r"littleendian|^le$", (True, True)),
)


def kind_of(word: str, registers: int | None = None) -> Kind | None:
    """What a type in a map means; None where it is not known. `registers`: how many it takes, where the map says so."""
    plain = re.sub(r"[^a-z0-9]", "", re.sub(r"\b([abcd]{4})\b|swap(ped)?|(big|little)[ _-]?endian", "", word.lower()))
    kind = _BY_WORD.get(plain)
    if kind is None or registers is None:
        return kind
    return _WIDER.get((kind, registers), kind)


def order_of(word: str) -> tuple[bool, bool] | None:
    """Words low first, octets low first, as a word for an order says; None where it says nothing."""
    plain = re.sub(r"[^a-z]", "", word.lower())
    return next((order for pattern, order in _ORDERS if re.search(pattern, plain)), None) if plain else None
