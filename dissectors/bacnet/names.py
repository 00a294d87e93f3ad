"""Numbers to names and back: enumerations, with the ranges that vendors may use (ANSI/ASHRAE 135, 23)."""

from __future__ import annotations

from dissectors.bacnet.enumerations import BIT_STRINGS, ENUMERATIONS
from dissectors.bacnet.enumerations_later import NEWER

FIRST_VENDOR: dict[str, int] = {
    "ObjectType": 128,
    "PropertyIdentifier": 512,
    "ErrorClass": 64,
    "ErrorCode": 256,
    "EngineeringUnits": 256,
    "RejectReason": 64,
    "AbortReason": 64,
    "EventState": 64,
    "EventType": 64,
    "Reliability": 64,
    "DeviceStatus": 64,
    "LifeSafetyMode": 256,
    "LifeSafetyState": 256,
    "LifeSafetyOperation": 64,
    "ProgramError": 64,
    "VTClass": 64,
}

_TABLES: dict[str, dict[int, str]] = {
    name: {**table, **NEWER.get(name, {}), **table} for name, table in ENUMERATIONS.items()
}
_NUMBERS: dict[str, dict[str, int]] = {}

OBJECT_TYPES = _TABLES["ObjectType"]
PROPERTIES = _TABLES["PropertyIdentifier"]
CONFIRMED = _TABLES["ConfirmedServiceChoice"]
UNCONFIRMED = _TABLES["UnconfirmedServiceChoice"]
REJECT_REASONS = _TABLES["RejectReason"]
ABORT_REASONS = _TABLES["AbortReason"]
ERROR_CLASSES = _TABLES["ErrorClass"]
ERROR_CODES = _TABLES["ErrorCode"]


def is_enumeration(type_name: str) -> bool:
    """Whether there is an enumeration of that name."""
    return type_name in _TABLES


def numbered(enumeration: str) -> dict[int, str]:
    """All names of an enumeration by number."""
    return _TABLES[enumeration]


def known(enumeration: str | None, number: int) -> str | None:
    """The name of a number, None when the enumeration has none for it."""
    table = _TABLES.get(enumeration) if enumeration is not None else None
    return None if table is None else table.get(number)


def name(enumeration: str | None, number: int) -> str:
    """The name of a number; "vendor-600" in a vendor's range, else the number itself."""
    found = known(enumeration, number)
    if found is not None:
        return found
    first = FIRST_VENDOR.get(enumeration) if enumeration is not None else None
    return f"vendor-{number}" if first is not None and number >= first else str(number)


def number(enumeration: str, named: str) -> int:
    """The number of a name, of "vendor-600" or of digits. Raises ValueError for others."""
    if enumeration not in _NUMBERS:
        _NUMBERS[enumeration] = {text: value for value, text in _TABLES.get(enumeration, {}).items()}
    found = _NUMBERS[enumeration].get(named)
    if found is not None:
        return found
    digits = named.removeprefix("vendor-")
    if digits.isascii() and digits.isdigit():
        return int(digits)
    raise ValueError(f"{enumeration} {named!r}: no such name")


def bits(type_name: str) -> dict[int, str] | None:
    """Names of the bits of a bit string type, None for others."""
    return BIT_STRINGS.get(type_name)


def object_type(value: int) -> str:
    """Name of an object type."""
    return OBJECT_TYPES.get(value) or name("ObjectType", value)


def property_name(value: int) -> str:
    """Name of a property."""
    return PROPERTIES.get(value) or name("PropertyIdentifier", value)
