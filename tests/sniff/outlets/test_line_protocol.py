"""InfluxDB's line protocol: a parser of somebody else reads it back, whatever names and texts hold."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sniff.analysis.sanitizing import sanitized
from sniff.outlets import line_protocol
from sniff.outlets.told import ToldBus
from tests.sniff.outlets.given import NOW, finding, numbers, state, value

parse_line = pytest.importorskip("line_protocol_parser").parse_line


def read(line: str | None) -> tuple[str, dict[str, str], dict[str, object], int]:
    """Measurement, tags, fields and time as a library of somebody else reads them."""
    assert line is not None
    found = parse_line(line)
    return found["measurement"], found["tags"], found["fields"], found["time"]


def test_a_value() -> None:
    measurement, tags, fields, time = read(line_protocol.line(value(60.0)))
    assert (measurement, time) == ("sniff485_value", NOW)
    assert tags == {"bus": "boiler", "device": "3", "point": "output-frequency", "unit": "Hz", "how": "read"}
    assert fields == {"value": 60.0, "raw": 6000, "quality": 0}


def test_a_text_is_another_measurement_so_that_a_field_has_one_type() -> None:
    measurement, _, fields, _ = read(line_protocol.line(value('say "no" \\ yes')))
    assert measurement == "sniff485_text"
    assert fields["text"] == 'say "no" \\ yes'


def test_numbers_findings_and_states() -> None:
    assert read(line_protocol.line(numbers()))[0] == "sniff485_bus"
    measurement, tags, _, _ = read(line_protocol.line(numbers(station="3")))
    assert (measurement, tags["device"]) == ("sniff485_node", "3")
    _, tags, fields, _ = read(line_protocol.line(finding()))
    assert (tags["code"], tags["subject"], tags["what"]) == ("MB001", "station 3", "new")
    assert fields["count"] == 4
    assert read(line_protocol.line(state(False, "unplugged")))[2]["listening"] is False


def test_what_the_protocol_has_no_word_for_has_no_line() -> None:
    assert line_protocol.line(value(float("nan"))) is None
    assert line_protocol.line(value(float("inf"))) is None
    assert line_protocol.point("m", {}, {"raw": 1 << 64}, NOW) is None
    assert line_protocol.point("m", {}, {"value": 1.0}, 1 << 64) is None


@given(st.text(), st.text(), st.text() | st.floats(allow_subnormal=False) | st.integers(-(1 << 70), 1 << 70))
def test_whatever_names_and_texts_hold_it_is_one_line_of_the_protocol(bus: str, name: str, told: object) -> None:
    line = line_protocol.line(value(told, name=name, bus=ToldBus(bus, "p", "x"), unit=name))
    if line is None:
        return
    assert "\n" not in line
    _, tags, fields, time = read(line)
    assert time == NOW
    for tag, text in (("bus", bus), ("point", name)):
        assert tags.get(tag, "") == sanitized(text).replace("\\", "/")
    if isinstance(told, str):
        assert fields["text"] == sanitized(told)
