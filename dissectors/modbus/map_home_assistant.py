"""Register maps as Home Assistant has them (`modbus:` in configuration.yaml), after the YAML was read. Pure, total.

Source: home-assistant.io, integrations/modbus: addresses are those of the wire; `input_type`, `data_type`, `swap`,
`scale`, `offset` and `unit_of_measurement` of sensors; `write_type`, `command_on`, `command_off` of switches.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import islice
from typing import Any

from dissectors.profiles.checked import MOST
from dissectors.profiles.model import Access, Kind
from dissectors.register_maps import MOST_ENTRIES, Mapped, RegisterMap, kind_of

PARTS = ("sensors", "binary_sensors", "switches", "lights", "fans", "covers", "climates")
_SPACES = {
    "holding": "holding",
    "holdings": "holding",
    "input": "input",
    "coil": "coil",
    "coils": "coil",
    "discrete_input": "discrete",
}
_SWAPS = {"none": (False, False), "byte": (False, True), "word": (True, False), "word_byte": (True, True)}
_TEMPERATURES = (("address", "current temperature"), ("target_temp_register", "target temperature"))
_HUGE = 1 << 64  # no number of a register, a station or a code; of thousands of digits none can even be written
_LONGEST_LIST = 16  # registers of a climate's list of target temperatures


def read_home_assistant(data: object) -> RegisterMap | None:
    """The map in a document; None where it has no hub of that integration."""
    found = RegisterMap(said=["addresses are those of Home Assistant: of the wire, from 0"])
    hubs = [hub for hub in islice(_hubs(data), MOST_ENTRIES) if any(part in hub for part in PARTS)]
    if not hubs:
        return None
    things = ((part, thing) for hub in hubs for part in PARTS for thing in _list(hub.get(part)))
    for part, thing in islice(things, MOST_ENTRIES):  # names may stand for lists of lists of lists
        if isinstance(thing, Mapping):
            _take(found, part, thing)
        else:
            found.left_out["entries that are included from elsewhere"] += 1
    return found


def _hubs(data: object) -> Iterator[Mapping[str, Any]]:
    """`modbus:` of a whole configuration, or what stands under it, or the lists of one hub alone."""
    if isinstance(data, Mapping) and "modbus" in data:
        data = data["modbus"]
    for hub in _list(data):
        if isinstance(hub, Mapping):
            yield hub


def _list(value: object) -> list[Any]:
    return value if isinstance(value, list) else [] if value is None else [value]


def _take(found: RegisterMap, part: str, thing: Mapping[str, Any]) -> None:
    if part == "climates":
        for key, what in _TEMPERATURES:
            for address in _list(thing.get(key))[:_LONGEST_LIST]:
                _add(found, thing, address, f"{_text(thing.get('name'))} {what}", access=_of_climate(key))
        for key in ("hvac_mode_register", "fan_mode_register", "swing_mode_register", "hvac_onoff_register"):
            if key in thing:
                found.left_out[f"{key.replace('_', ' ')}s of climates"] += 1
        return
    states: dict[int, str] = {}
    codes: dict[str, object] = {}
    access = Access.READ
    if part in ("switches", "lights", "fans"):
        access = Access.BOTH
        codes = {"on": thing.get("command_on", 1), "off": thing.get("command_off", 0)}
    elif part == "covers":
        access = Access.BOTH
        usual = (("open", 1), ("closed", 0), ("opening", 2), ("closing", 3))
        codes = {key: thing.get(f"state_{key}", code) for key, code in usual}
    for words, value in codes.items():
        code = _whole(value)
        if code is not None:
            states.setdefault(code, words)
    _add(found, thing, thing.get("address"), _text(thing.get("name")), states, access, part)


def _of_climate(key: str) -> Access:
    return Access.READ if key == "address" else Access.BOTH


def _add(
    found: RegisterMap,
    thing: Mapping[str, Any],
    address: object,
    title: str,
    states: Mapping[int, str] | None = None,
    access: Access = Access.READ,
    part: str = "climates",
) -> None:
    """One register of a thing; what cannot be said of it is counted."""
    where = _whole(address)
    usual = "coil" if part == "binary_sensors" else "holding"
    told = _text(thing.get("write_type" if part in ("switches", "lights", "fans") else "input_type", usual))
    space = _SPACES.get(told)
    if where is None or space is None:
        found.left_out["entries without an address or a table that can be read"] += 1
        return
    kind = _kind(found, thing, part, space)
    if kind is None:
        return
    swapped, little = _SWAPS.get(_text(thing.get("swap", "none")), (False, False))
    station = _whole(thing.get("slave", thing.get("device_address")))
    words = space in ("holding", "input")
    found.entries.append(
        Mapped(
            space,
            where,
            title,
            kind,
            swapped and kind.registers > 1,
            little and words,
            _real(thing.get("scale")) or 1.0,
            _real(thing.get("offset")) or 0.0,
            _text(thing.get("unit_of_measurement") or thing.get("temperature_unit")),
            access=Access.READ if space in ("input", "discrete") else access,
            states=dict(states or {}),
            station=station,
        )
    )
    for key, what in (("virtual_count", "copies of an entry"), ("slave_count", "copies of an entry")):
        if _whole(thing.get(key)):
            found.left_out[what] += _whole(thing.get(key)) or 0


def _kind(found: RegisterMap, thing: Mapping[str, Any], part: str, space: str) -> Kind | None:
    if space in ("coil", "discrete"):
        return Kind.BIT
    if part not in ("sensors", "climates"):
        return Kind.U16
    told = _text(thing.get("data_type", "int16")).lower()
    kind = kind_of(told, _whole(thing.get("count")))
    if kind is None or kind is Kind.BIT or told == "float16":
        found.left_out[f"data type {told}"] += 1
        return None
    return kind


def _text(value: object) -> str:
    """What a plain value says; nothing where it is a list, which names may make longer than memory."""
    if isinstance(value, str):
        return value
    return str(value) if _whole(value) is not None or isinstance(value, bool | float) else ""


def _whole(value: object) -> int | None:
    if isinstance(value, str) and value.isascii() and value.isdigit() and len(value) < 8:
        return int(value)
    return value if isinstance(value, int) and not isinstance(value, bool) and abs(value) < _HUGE else None


def _real(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if abs(number) < MOST else None
