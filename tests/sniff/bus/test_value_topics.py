"""Samples as messages of a recording."""

from __future__ import annotations

import importlib.util
import json
import math
from pathlib import Path
from typing import Any

import pytest

from dissectors.profiles import Devices
from dissectors.profiles.decoding import decode
from dissectors.profiles.packaged import packaged
from dissectors.readings import Origin, Reading
from sniff.analysis.point_reader import Sample
from sniff.bus import value_topics as value_channels
from sniff.bus.value_topics import ValueChannels
from sniff.recording.derived_message import DerivedMessage
from sniff.recording.topics import SCHEMAS

DEVICES = Devices({5: packaged("teco-f510")})


def load(name: str) -> Any:
    spec = importlib.util.spec_from_file_location(name, Path(__file__).with_name(f"{name}.py"))
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


flat = load("flat_schema")


def samples(*readings: Reading, device: int | None = 5, time: int = 7) -> list[Sample]:
    return [Sample(time, device, value, 12) for value in decode(DEVICES.at(device), readings)]


def holding(address: int, value: int) -> Reading:
    return Reading("holding", address, value, value, Origin.READ)


def write(*given: Sample, bus: str = "boiler room") -> list[DerivedMessage]:
    channels = ValueChannels(bus, DEVICES)
    return [message for sample in given if (message := channels.message(sample)) is not None]


def test_a_value_as_the_design_has_it() -> None:
    (message,) = write(*samples(holding(0x2524, 6000)))
    assert message.topic == "/values/boiler-room/5/output-frequency"
    assert json.loads(message.data) == {"value": 60.0, "raw": 6000, "quality": 0, "frame": 12}
    assert (message.schema, message.log_time) == ("sniff485.Value", 7)
    assert message.metadata["unit"] == "Hz"
    assert message.metadata["profile"] == "teco-f510"


@pytest.mark.parametrize("name", ["sniff485.Value", "sniff485.TextValue"])
def test_schemas_are_flat(name: str) -> None:
    assert flat.faults(json.loads(SCHEMAS[name].text)) == []


def test_the_check_itself_finds_what_it_should() -> None:
    wrong = {"type": "object", "properties": {"a": {"type": ["number", "null"]}, "b": {"$ref": "#/x"}}}
    assert len(flat.faults(wrong)) == 4
    assert flat.faults({"type": "array"}) == ["the root is no object"]
    schema = json.loads(SCHEMAS["sniff485.Value"].text)
    assert len(flat.misfits(schema, {"raw": 1.5, "x": 1})) == 3


def test_every_message_fits_its_schema() -> None:
    readings = [
        *(holding(address, 0xFFFF) for address in range(0x2500, 0x2530)),
        Reading("AI", 10, 0x42340000, 45.0, Origin.READ),
        Reading("device", 5, None, "TECO \x1b[2J", Origin.READ, "object-name"),
        Reading("analog-input", 4, 0x7FC00000, math.nan, Origin.READ),
        Reading("holding", 1, 2, 2, Origin.READ),
    ]
    messages = write(*samples(*readings), *samples(*readings, device=None))
    assert len(messages) > 60
    for message in messages:
        value = json.loads(message.data, parse_constant=lambda word: pytest.fail(f"{word} is no JSON"))
        assert flat.misfits(json.loads(SCHEMAS[message.schema].text), value) == []
        assert all(isinstance(word, str) for word in message.metadata.values())
        assert message.topic.isprintable()
        assert " " not in message.topic


def test_states_are_in_the_metadata() -> None:
    status, *bits = write(*samples(holding(0x2520, 1)))
    assert status.topic.endswith("/status")
    running = next(message for message in bits if message.topic.endswith("/status.running"))
    assert running.metadata["states"] == "0=stopped; 1=running"
    (fault,) = write(*samples(holding(0x2521, 1)))
    assert "17=external fault 01" in fault.metadata["states"]


def test_a_bit_is_written_when_it_changes() -> None:
    given = [sample for raw in (1, 1, 3) for sample in samples(holding(0x2520, raw))]
    topics = [message.topic.rpartition("/")[2] for message in write(*given)]
    assert topics.count("status") == 3
    assert topics.count("status.running") == 1
    assert topics.count("status.reverse") == 2


def test_a_channel_has_one_schema_and_there_are_not_too_many(monkeypatch: pytest.MonkeyPatch) -> None:
    name = Reading("device", 5, None, "x", Origin.READ, "object-name")
    number = Reading("device", 5, 1, 1, Origin.READ, "object-name")
    assert len(write(*samples(name, number))) == 1
    monkeypatch.setattr(value_channels, "MOST_CHANNELS", 2)
    assert len(write(*samples(*(holding(address, 1) for address in range(9))))) == 2
