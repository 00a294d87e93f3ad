"""The committed tables are what the generator makes of bacpypes3 and of its list of corrections."""

from __future__ import annotations

import pytest

from dissectors.bacnet import layout
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
        assert not set(table) & set(ENUMERATIONS[enumeration])
        assert not set(table.values()) & set(ENUMERATIONS[enumeration].values())


def test_every_property_type_is_known():
    for name in {*PROPERTY_TYPES.values(), *BY_OBJECT.values()}:
        assert layout.exists(name), name
