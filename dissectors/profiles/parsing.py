"""A profile out of a TOML document. README.md describes the format; every mistake is a ProfileError with its key."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from dissectors.line import MS
from dissectors.profiles.checked import CheckedTable, ProfileError
from dissectors.profiles.gsd import response_times
from dissectors.profiles.model import Access, Bit, BitField, Entry, EntryRole, Kind, Limits, Profile, Sign

REGISTER_TABLES = ("holding", "input")
BIT_TABLES = ("coil", "discrete")
_FAMILIES = ("modbus", "n2", "bacnet", "profibus")
N2_REGIONS = ("AI", "BI", "AO", "BO", "ADF", "ADI", "BD")
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.+-]*")


def parse(data: Mapping[str, Any], origin: str) -> Profile:
    """The profile of a document; `origin` is what errors call the file. Raises ProfileError."""
    top = CheckedTable(origin, "", data)
    name = _name(top, "name")
    modbus, n2, bacnet = top.table("modbus"), top.table("n2"), top.table("bacnet")
    profibus = top.table("profibus")
    others = [top.table(word) for word in top.texts("protocols") if word in top and word not in _FAMILIES]  # plug-ins'
    registers, absent = _modbus(modbus)
    exceptions = {"modbus": modbus.words("exceptions"), "n2": n2.words("errors")}
    exceptions |= {other.path: other.words("errors") for other in others}
    objects = [_object(table, _n2_place(table), n2=True) for table in n2.tables("object")]
    objects += [_object(table, _bacnet_place(table)) for table in bacnet.tables("object")]
    objects += [_entry(table, *_word_place(table), None) for table in profibus.tables("word")]
    objects += [_object(table, _any_place(table)) for other in others for table in other.tables("object")]
    facts = _constants(profibus.table("device"))
    times = response_times({key.lower(): value for key, value in facts.items() if isinstance(value, int)})
    limits = {family.path: _limits(family.table("limits")) for family in (modbus, n2, bacnet, profibus, *others)}
    profile = Profile(
        name=name,
        title=top.text("title"),
        vendor=top.text("vendor", ""),
        models=top.texts("models", ()),
        noun=top.text("noun", "device"),
        protocols=top.texts("protocols"),
        entries=_with_shared_meaning(origin, (*registers, *objects)),
        limits={**limits, profibus.path: replace(limits[profibus.path], responses=times)},
        exceptions=exceptions,
        signs=tuple(_sign(table, modbus) for table in top.tables("sign")),
        properties=_properties(bacnet.table("properties")),
        constants=_constants(bacnet.table("device")),
        facts=facts,
        absent=absent,
        reserved=_reserved(modbus),
        address_offset=modbus.whole("address-offset", 0),
        source=top.text("source", ""),
        origin=origin,
    )
    for table in (top, modbus, n2, bacnet, profibus, *others):
        table.finish()
    _check(profile)
    return profile


# --- Modbus ----------------------------------------------------------------------------------------------------------


def _modbus(modbus: CheckedTable) -> tuple[list[Entry], tuple[str, ...]]:
    """Registers first, then the parameters that no register describes; and the parameters without a register."""
    offset = modbus.whole("address-offset", 0)
    tables = modbus.texts("tables", ("holding",))
    entries: list[Entry] = []
    unknown: set[str] = set()
    for table in modbus.tables("register"):
        own = table.texts("tables", tables)  # where a number means one thing in one table, another in the other
        unknown |= set(own)
        entries += [_register(table, space, offset, modbus) for space in own]
    described = {entry.address for entry in entries}
    absent: list[str] = []
    for table in modbus.tables("parameters"):
        more, missing = _parameters(table, offset, tables, modbus)
        entries += [entry for entry in more if entry.address not in described]
        absent += missing
    unknown = (unknown | set(tables)) - {*REGISTER_TABLES, *BIT_TABLES}
    if unknown:
        raise modbus.error("tables", f"{', '.join(sorted(unknown))}: expected holding, input, coil or discrete")
    return entries, tuple(absent)


def _register(table: CheckedTable, space: str, offset: int, modbus: CheckedTable) -> Entry:
    address = table.whole("address")
    wire = address + offset
    if not 0 <= wire <= 0xFFFF:
        raise table.error("address", f"{address} with offset {offset}: expected 0 … 65535 on the wire")
    return _entry(table, space, wire, f"{address:04X}h", modbus)


def _reserved(modbus: CheckedTable) -> tuple[tuple[int, int], ...]:
    """Spans [first, last] of registers that nobody may write, as on the wire."""
    offset, spans = modbus.whole("address-offset", 0), []
    for table in modbus.tables("reserved"):
        first, last = table.whole("first") + offset, table.whole("last") + offset
        table.finish()
        if not 0 <= first <= last <= 0xFFFF:
            raise table.error("last", "expected first … last within 0 … 65535")
        spans.append((first, last))
    return tuple(spans)


def _parameters(
    table: CheckedTable, offset: int, tables: tuple[str, ...], modbus: CheckedTable
) -> tuple[list[Entry], list[str]]:
    """A group of parameters whose register is `base` plus the parameter's number."""
    prefix, base, digits = table.text("prefix"), table.whole("base"), table.whole("digits", 2)
    if not is_name(f"{prefix}0"):
        raise table.error("prefix", f"{prefix!r}: expected letters, digits, dots and hyphens")
    if not 1 <= digits <= 9:
        raise table.error("digits", "expected 1 … 9")
    title = table.text("title", "parameter")
    access = Access(table.choice("access", [access.value for access in Access], "rw"))
    present, absent = table.numbers("present"), table.numbers("absent")
    elsewhere = {number: _whole(table, f"elsewhere.{number}", at) for number, at in table.numbered("elsewhere").items()}
    titles, described = table.words("titles"), table.tables_by_number("described")
    for number in {*titles, *elsewhere, *described} - {*present, *absent}:
        raise table.error(f"titles.{number}", "is no parameter of this group")
    if set(present) & set(absent):
        raise table.error("absent", "has a number that is also present")
    table.finish()
    entries = []
    for number in present:
        address = elsewhere.get(number, base + number)
        if not 0 <= address + offset <= 0xFFFF:
            raise table.error("base", f"register {address} does not exist")
        name = f"{prefix}{number:0{digits}d}"
        words, where = titles.get(number, f"{title} {name}"), f"{address:04X}h"
        if number in described:
            named = described[number].text("name", name)
            whole = words if named == name else f"{words} ({name})"
            told = described[number].with_usual(name=name, title=whole, access=access.value)
            entries += [_entry(told, space, address + offset, where, modbus) for space in tables]
        else:
            entries += [Entry(space, address + offset, where, name, words, access=access) for space in tables]
    return entries, [f"{prefix}{number:0{digits}d}" for number in absent]


# --- objects ---------------------------------------------------------------------------------------------------------


def _n2_place(table: CheckedTable) -> tuple[str, int]:
    space, _, number = table.text("object").partition(" ")
    if space not in N2_REGIONS or not _is_number(number, 255):
        raise table.error("object", f'expected "AI 1": one of {", ".join(N2_REGIONS)} and 0 … 255')
    return space, int(number)


def _bacnet_place(table: CheckedTable) -> tuple[str, int]:
    space, _, number = table.text("object").partition(" ")
    if not re.fullmatch(r"[a-z][a-z-]*", space) or not _is_number(number, 0x3FFFFF):
        raise table.error("object", 'expected "analog-input 0": object type and instance')
    return space, int(number)


def _any_place(table: CheckedTable) -> tuple[str, int]:
    """A place as the readings of a plug-in have it: their space, and the address in it."""
    space, _, number = table.text("object").rpartition(" ")
    if not space or not _is_number(number, 999_999_999):
        raise table.error("object", 'expected "counter 7": what the plug-in calls the kind of thing, and its number')
    return space, int(number)


def _word_place(table: CheckedTable) -> tuple[str, int, str]:
    """ "input 3" → the table of cyclic words, the place in it, and what people call it."""
    told = table.text("word")
    direction, _, number = told.partition(" ")
    if direction not in ("input", "output") or not _is_number(number, 121):
        raise table.error("word", 'expected "input 0" or "output 0": the words of cyclic data, from 0 to 121')
    return f"dp-{direction}", int(number), told


def _object(table: CheckedTable, place: tuple[str, int], n2: bool = False) -> Entry:
    space, address = place
    binary = space in ("BI", "BO") or space.startswith("binary-")
    return _entry(table, space, address, f"{space} {address}", None, Kind.BIT if binary else Kind.REAL)


# --- what registers and objects share --------------------------------------------------------------------------------


def _entry(
    table: CheckedTable,
    space: str,
    address: int,
    number: str,
    modbus: CheckedTable | None,
    usual: Kind = Kind.U16,
) -> Entry:
    orders = ("high-first", "low-first")
    word_order = modbus.choice("word-order", orders, "high-first") if modbus else "high-first"
    octet_order = modbus.choice("octet-order", orders, "high-first") if modbus else "high-first"
    reserved = table.flag("reserved")
    name = _name(table, "name") if not reserved or "name" in table else f"reserved.{number.replace(' ', '-')}"
    low, high = table.pair("range")
    states = table.words("states")
    empty = table.numbers("reserved-codes")
    if set(states) & set(empty):
        raise table.error("reserved-codes", "has a code that is also in states")
    entry = Entry(
        space=space,
        address=address,
        number=number,
        name=name,
        title=table.text("title", "reserved" if reserved else name.replace("-", " ")),
        label=table.text("label", ""),
        kind=Kind(table.choice("type", [kind.value for kind in Kind], usual.value)),
        swapped=table.choice("word-order", orders, word_order) == "low-first",
        little=table.choice("octet-order", orders, octet_order) == "low-first",
        scale=table.number("scale", 1.0),
        offset=table.number("offset", 0.0),
        unit=table.text("unit", ""),
        printed_unit=table.text("printed-unit", ""),
        low=low,
        high=high,
        access=Access(table.choice("access", [access.value for access in Access], "rw")),
        role=EntryRole(table.choice("role", [role.value for role in EntryRole], "value")),
        reserved=reserved,
        states=states,
        reserved_codes=frozenset(empty),
        reserved_bits=table.numbers("reserved-bits"),
        written=table.text("written", ""),
        version=table.flag("version"),
        hexadecimal=table.flag("hex"),
        default=table.number("default") if "default" in table else None,
        bits=_bits(table),
        parts=tuple(_part(part) for part in table.tables("part")),
        states_from=table.text("states-from", ""),
        like=table.text("like", ""),
        doubt=table.text("doubt", ""),
    )
    table.finish()
    return entry


def _bits(table: CheckedTable) -> tuple[Bit, ...]:
    roles = _roles(table, "bits")
    bits = tuple(_bit(table, number, value) for number, value in sorted(table.numbered("bits").items()))
    if unnamed := set(roles) - {bit.number for bit in bits}:
        raise table.error(f"{roles[min(unnamed)].value}-bits", f"bit {min(unnamed)} has no name in bits")
    return tuple(replace(bit, role=roles.get(bit.number, EntryRole.VALUE)) for bit in bits)


def _roles(table: CheckedTable, what: str) -> dict[int, EntryRole]:
    """Bits or states that say that the device has a fault, warns or runs: `fault-bits`, `running-states` …"""
    roles = EntryRole.FAULT, EntryRole.ALARM, EntryRole.RUNNING
    return {number: role for role in roles for number in table.numbers(f"{role.value}-{what}")}


def _bit(table: CheckedTable, number: int, value: Any) -> Bit:
    """ "S1" (named and said so), or ["run", "run", "stop"]: name, words for 1, words for 0."""
    if not 0 <= number <= 31:
        raise table.error(f"bits.{number}", "expected a bit number 0 … 31")
    if isinstance(value, str):
        return Bit(number, _slug(value), table.spoken(f"bits.{number}", value))
    if isinstance(value, list) and len(value) in (2, 3) and all(isinstance(item, str) for item in value):
        name, on, *off = (table.spoken(f"bits.{number}", word) for word in value)
        return Bit(number, name, on, "".join(off))
    raise table.error(f"bits.{number}", f'expected "name" or ["name", "on", "off"], not {value!r}')


def _part(table: CheckedTable) -> BitField:
    low, high = table.pair("bits")
    if low is None or high is None or not 0 <= low <= high <= 31 or low % 1 or high % 1:
        raise table.error("bits", "expected [lowest, highest] within 0 … 31")
    states = table.words("states")
    part = BitField(int(low), int(high), _name(table, "name"), states, _roles(table, "states"))
    table.finish()
    return part


def _with_shared_meaning(origin: str, entries: tuple[Entry, ...]) -> tuple[Entry, ...]:
    """Entries with `like` get what they do not say themselves from the entry of that name, those with `states-from`
    its states."""
    first: dict[str, Entry] = {}
    for entry in entries:
        if not entry.like:
            first.setdefault(entry.name, entry)
    for entry in entries:
        if entry.like and entry.like not in first:
            raise ProfileError(f"{origin}: {entry.number}: like: no entry {entry.like!r}")
    by_name: dict[str, Entry] = {}
    for entry in entries:  # of those that have the same name, the first
        if entry.states:
            by_name.setdefault(entry.name, entry)
    for entry in entries:
        if entry.states_from and entry.states_from not in by_name:
            raise ProfileError(f"{origin}: {entry.number}: states-from: no entry {entry.states_from!r} with states")
    first = {name: _with_states(entry, by_name) for name, entry in first.items()}
    return tuple(_like(e, first[e.like]) if e.like else _with_states(e, by_name) for e in entries)


def _with_states(entry: Entry, by_name: Mapping[str, Entry]) -> Entry:
    other = by_name.get(entry.states_from)
    return entry if other is None else replace(entry, states=other.states, reserved_codes=other.reserved_codes)


def _like(entry: Entry, other: Entry) -> Entry:
    """An entry with the unit, range and words of another where it has none of its own."""
    ranged = entry.low is not None or entry.high is not None
    low, high = (entry.low, entry.high) if ranged else (other.low, other.high)
    return replace(
        entry,
        unit=entry.unit or other.unit,
        low=low,
        high=high,
        states=entry.states or other.states,
        states_from=other.states_from,
        reserved_codes=entry.reserved_codes or other.reserved_codes,
        label=other.label,
    )


# --- the rest of a profile -------------------------------------------------------------------------------------------


def _limits(table: CheckedTable) -> Limits:
    frame = table.whole("frame") if "frame" in table else None
    response = table.number("response-ms") if "response-ms" in table else None
    if (frame is not None and frame < 1) or (response is not None and response <= 0):
        raise table.error("", "expected numbers above 0")
    lowest, highest = table.pair("stations")
    stations = None if lowest is None or highest is None else (int(lowest), int(highest))
    functions = frozenset(table.numbers("functions")) or None
    unexecuted = frozenset(table.text("unexecuted", "").split())
    read_only = frozenset(table.text("read-only", "").split())
    table.finish()
    return Limits(
        frame=frame,
        response=None if response is None else int(response * MS),
        stations=stations,
        functions=functions,
        unexecuted=unexecuted,
        read_only=read_only,
    )


def _sign(table: CheckedTable, modbus: CheckedTable) -> Sign:
    if "register" in table:
        space, address = "holding", table.whole("register") + modbus.whole("address-offset", 0)
    else:
        word, _, number = table.text("object").partition(" ")
        space, address = word, int(number) if _is_number(number, 0x3FFFFF) else -1
    value = table.data.get("value")
    if "value" in table and not isinstance(value, int | float | str):
        raise table.error("value", f"expected a number or a text, not {value!r}")
    value = table.spoken("value", value) if isinstance(value, str) else value
    sign = Sign(space, address, table.text("part", ""), value, table.text("title", ""))
    table.finish()
    return sign


def _properties(table: CheckedTable) -> dict[str, tuple[str, ...]]:
    return {key: table.texts(key) for key in table.data}


def _constants(table: CheckedTable) -> dict[str, str | int]:
    return {key: table.whole(key) if isinstance(value, int) else table.text(key) for key, value in table.data.items()}


def _check(profile: Profile) -> None:
    """What concerns several entries: a place is described once, a name means one thing."""
    places: dict[tuple[str, int], Entry] = {}
    names: dict[tuple[str, str], Entry] = {}
    units: dict[str, Entry] = {}
    for entry in profile.entries:
        for place in entry.places:
            other = places.setdefault(place, entry)
            if other is not entry:
                raise ProfileError(f"{profile.origin}: {entry.number}: is already {other.name!r} ({other.number})")
        other = names.setdefault((entry.space, entry.name), entry)
        if other is not entry:
            raise ProfileError(f"{profile.origin}: {entry.number}: name {entry.name!r} is taken by {other.number}")
        if (other := units.setdefault(entry.name, entry)).unit != entry.unit:
            raise ProfileError(
                f"{profile.origin}: {entry.number}: {entry.name!r} in {entry.unit or 'no unit'!r}, "
                f"but {other.number} has it in {other.unit or 'no unit'!r}"
            )


def _is_number(text: str, most: int) -> bool:
    """Whether a text is a number, 0 … `most`."""
    return re.fullmatch("[0-9]{1,9}", text) is not None and int(text) <= most


def is_name(text: str) -> bool:
    """Whether a profile, or something in it, can have this name."""
    return _NAME.fullmatch(text) is not None


def _name(table: CheckedTable, key: str) -> str:
    name = table.text(key)
    if not is_name(name):
        raise table.error(key, f"{name!r}: expected letters, digits, dots and hyphens")
    return name


def _slug(words: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", words.lower()).strip("-") or "bit"


def _whole(table: CheckedTable, key: str, value: Any) -> int:
    if not isinstance(value, int) or isinstance(value, bool):
        raise table.error(key, f"expected a whole number, not {value!r}")
    return value
