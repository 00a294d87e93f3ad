"""Every field and every kind that a capture holds is declared, with the type of what it holds."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from dissectors.field_types import Kind, plain_word
from dissectors.frame import Frame, Role
from sniff.bus.offline import outputs
from sniff.engine.engine import Output
from sniff.engine.follow_settings import dissector_for
from sniff.formats import read
from tests.seeds import IS_SEARCH

CAPTURES = Path(__file__).parents[2] / "captures"
NAMES = sorted(CAPTURES.rglob("*.cap.txt"))[:: 3 if IS_SEARCH else 5] + sorted(CAPTURES.glob("mstp*.cap.txt"))
WHOLE = re.compile(r"-?[0-9]+(,-?[0-9]+)*")


@pytest.mark.parametrize("path", NAMES, ids=lambda path: path.name)
def test_what_a_capture_holds_is_declared(path: Path) -> None:
    capture = read(path)
    dissector = dissector_for(capture.session)
    assert dissector.field_types is not None
    types = dissector.field_types()
    kinds = types["kind"]
    for output in outputs(capture.items(), capture.session):
        for row in output.rows if isinstance(output, Output) else ():
            if not isinstance(row.event, Frame) or row.header is None or row.header.protocol != dissector.name:
                continue
            kind = row.header.kind
            assert kind in kinds.words or re.fullmatch(kinds.also, kind, re.IGNORECASE), kind
            role = row.placement.role if row.placement is not None else Role.UNKNOWN
            for name, value in dissector.fields(row.event, role).items():
                assert name in types, name
                if types[name].kind in (Kind.NUMBER, Kind.STATION, Kind.TRUTH) and isinstance(value, str):
                    assert WHOLE.fullmatch(value) or "." in value, (name, value)
                if types[name].kind is Kind.TEXT and types[name].closed:
                    assert str(value) in types[name].words.values(), (name, value)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("Read Holding Registers", "read-holding-registers"),
        ("confirmedCOVNotification", "confirmed-cov-notification"),
        ("readPropertyMultiple", "read-property-multiple"),
        ("i-Am", "I-Am"),
        ("BACnet Data Expecting Reply", "bacnet data expecting reply"),
        ("Get Comm. Event Log", "get comm event log"),
    ],
)
def test_names_are_compared_as_people_write_them(one: str, other: str) -> None:
    assert plain_word(one) == plain_word(other)
