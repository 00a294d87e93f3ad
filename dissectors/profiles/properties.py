"""Properties that an object should have, by the profile of its device."""

from __future__ import annotations

from collections.abc import Mapping

from dissectors.profiles.model import Entry
from dissectors.pseudonyms import is_blank
from dissectors.readings import Reading

UNIT_NAMES: Mapping[str, str] = {
    "Hz": "hertz",
    "kHz": "kilohertz",
    "V": "volts",
    "A": "amperes",
    "W": "watts",
    "kW": "kilowatts",
    "kWh": "kilowatt-hours",
    "hp": "horsepower",
    "s": "seconds",
    "h": "hours",
    "%": "percent",
    "rpm": "revolutions-per-minute",
    "°C": "degrees-celsius",
}
"""Units of profiles as BACnet names them (ANSI/ASHRAE 135, BACnetEngineeringUnits)."""


def due_property(entry: Entry, reading: Reading) -> str | None:
    """What the manual has for a property that was read as something else; None where it fits, or nobody can tell.

    Object_Name is what the device calls the object; a unit is compared where the profile has one that the standard
    names, and not where the device says that there is none, or says what the manual misprints. A name that was blanked
    may have been any.
    """
    if reading.part == "object-name" and entry.label and isinstance(reading.value, str):
        same = reading.value == entry.label or is_blank(reading.value)
        return None if same else f'"{entry.label}"'
    if reading.part == "units" and reading.words not in ("", "no-units"):
        due = UNIT_NAMES.get(entry.unit)
        return None if due is None or reading.words in (due, UNIT_NAMES.get(entry.printed_unit)) else due
    return None
