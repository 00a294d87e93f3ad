"""Numbers to names and back: enumerations, with the ranges that vendors may use (ANSI/ASHRAE 135, 23)."""

from __future__ import annotations

from dissectors.bacnet.enumerations import BIT_STRINGS, ENUMERATIONS
from dissectors.bacnet.enumerations_later import NEWER, NEWER_BITS

VENDORS: dict[str, tuple[range, ...]] = {
    "AbortReason": (range(64, 256),),
    "AccessAuthenticationFactorDisable": (range(64, 65536),),
    "AccessCredentialDisable": (range(64, 65536),),
    "AccessCredentialDisableReason": (range(64, 65536),),
    "AccessEvent": (range(512, 65536),),
    "AccessUserType": (range(64, 65536),),
    "AccessZoneOccupancyState": (range(64, 65536),),
    "AuditLevel": (range(128, 256),),
    "AuditOperation": (range(32, 64),),
    "AuthorizationException": (range(64, 256),),
    "AuthorizationMode": (range(64, 65536),),
    "BinaryLightingPV": (range(64, 256),),
    "DeviceStatus": (range(64, 65536),),
    "DoorAlarmState": (range(256, 65536),),
    "DoorStatus": (range(1024, 65536),),
    "EngineeringUnits": (range(256, 47808), range(50000, 65536)),
    "ErrorClass": (range(64, 65536),),
    "ErrorCode": (range(256, 65536),),
    "EscalatorFault": (range(1024, 65536),),
    "EscalatorMode": (range(1024, 65536),),
    "EscalatorOperationDirection": (range(1024, 65536),),
    "EventState": (range(64, 65536),),
    "EventType": (range(64, 65536),),
    "LifeSafetyMode": (range(256, 65536),),
    "LifeSafetyOperation": (range(64, 65536),),
    "LifeSafetyState": (range(256, 65536),),
    "LiftCarDirection": (range(1024, 65536),),
    "LiftCarDriveStatus": (range(1024, 65536),),
    "LiftCarMode": (range(1024, 65536),),
    "LiftFault": (range(1024, 65536),),
    "LightingOperation": (range(256, 65536),),
    "LightingTransition": (range(64, 256),),
    "LoggingType": (range(64, 256),),
    "Maintenance": (range(256, 65536),),
    "NetworkPortCommand": (range(128, 256),),
    "NetworkType": (range(64, 256),),
    "ObjectType": (range(128, 1024),),
    "ProgramError": (range(64, 65536),),
    "PropertyIdentifier": (range(512, 4194304),),
    "RejectReason": (range(64, 256),),
    "Relationship": (range(1024, 65536),),
    "Reliability": (range(64, 65536),),
    "RestartReason": (range(64, 256),),
    "SilencedState": (range(64, 65536),),
    "VTClass": (range(64, 65536),),
}
"""Numbers that vendors may give a meaning of their own; those behind them are the standard's again, or none."""

_TABLES: dict[str, dict[int, str]] = {
    name: ENUMERATIONS.get(name, {}) | NEWER.get(name, {}) for name in (*ENUMERATIONS, *NEWER)
}
_BITS: dict[str, dict[int, str]] = {name: {**NEWER_BITS.get(name, {}), **table} for name, table in BIT_STRINGS.items()}
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
    vendors = VENDORS.get(enumeration, ()) if enumeration is not None else ()
    return f"vendor-{number}" if any(number in numbers for numbers in vendors) else str(number)


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
    return _BITS.get(type_name)


def object_type(value: int) -> str:
    """Name of an object type."""
    return OBJECT_TYPES.get(value) or name("ObjectType", value)


def property_name(value: int) -> str:
    """Name of a property."""
    return PROPERTIES.get(value) or name("PropertyIdentifier", value)
