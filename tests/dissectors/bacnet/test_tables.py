"""The committed tables are what the generator makes of bacpypes3 and of its list of corrections."""

from __future__ import annotations

import pytest

from dissectors.bacnet import layout, names
from dissectors.bacnet.enumerations import BIT_STRINGS, ENUMERATIONS
from dissectors.bacnet.enumerations_later import NEWER
from dissectors.bacnet.property_types import BY_OBJECT, PROPERTY_TYPES
from tests.dissectors.bacnet.generate_tables import FOLDER, bit_strings, enumerations, render


@pytest.mark.parametrize("name", ["enumerations.py", "sequences.py", "choices.py", "property_types.py"])
def test_the_committed_file_is_the_generated_one(name: str):
    assert (FOLDER / name).read_text(encoding="utf-8") == render()[name]


def test_the_tables_equal_bacpypes3():
    assert enumerations() == ENUMERATIONS
    assert bit_strings() == BIT_STRINGS
    assert ENUMERATIONS["PropertyIdentifier"][85] == "present-value"
    assert len(ENUMERATIONS["ErrorCode"]) > 150


def test_newer_numbers_never_contradict():
    for enumeration, table in NEWER.items():
        assert not set(table) & set(ENUMERATIONS.get(enumeration, {}))
        assert not set(table.values()) & set(ENUMERATIONS.get(enumeration, {}).values())


def test_no_number_of_the_vendors_has_a_name():
    """They are each vendor's own: whatever a table calls them was made up by its author."""
    for enumeration, ranges in names.VENDORS.items():
        assert not [n for n in names.numbered(enumeration) if any(n in numbers for numbers in ranges)], enumeration


@pytest.mark.parametrize(
    ("enumeration", "number", "name"),
    [
        ("AbortReason", 11, "apdu-too-long"),
        ("AbortReason", 64, "vendor-64"),
        ("EngineeringUnits", 47807, "vendor-47807"),
        ("EngineeringUnits", 47813, "47813"),  # the standard's again, and not used
        ("EngineeringUnits", 50000, "vendor-50000"),
        ("ObjectType", 1023, "vendor-1023"),
        ("ObjectType", 1024, "1024"),
        ("PropertyIdentifier", 4194303, "vendor-4194303"),
        ("PropertyIdentifier", 4194304, "max-bvlc-length-accepted"),
        ("PropertyIdentifier", 4200000, "4200000"),
        ("RestartReason", 64, "vendor-64"),
        ("SecurityLevel", 5, "encrypted-end-to-end"),
    ],
)
def test_whose_a_number_is(enumeration: str, number: int, name: str):
    assert names.name(enumeration, number) == name


def test_bits_of_object_types_are_the_object_types():
    bits = names.bits("ObjectTypesSupported")
    assert bits == names.OBJECT_TYPES


def test_every_property_type_is_known():
    for name in {*PROPERTY_TYPES.values(), *BY_OBJECT.values()}:
        assert layout.exists(name), name
