"""Every MCAP that a command writes can be plotted: values, load, stations and findings, in schemas that the strictest
readers take.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader

CAPTURES = Path(__file__).parents[3] / "captures"
SCALARS = {"number": (int, float), "integer": (int,), "string": (str,), "boolean": (bool,)}
COMMANDS = (
    "convert FILE OUT",
    "cut FILE -o OUT --from +0 --to +3600",
    "merge FILE -o OUT",
    "redissect FILE -o OUT",
    "recover FILE -o OUT",
    "anonymise FILE -o OUT",
)


@pytest.mark.parametrize("words", COMMANDS)
@pytest.mark.parametrize("name", ["rtu-usual-faults", "ascii-clean", "n2-clean", "mstp-clean", "profibus-clean"])
def test_every_command_writes_what_can_be_plotted(
    words: str, name: str, tmp_path: Path, sniff485: Callable[..., Any]
) -> None:
    out = tmp_path / "out.mcap"
    put = {"FILE": str(CAPTURES / f"{name}.cap.txt"), "OUT": str(out)}
    assert sniff485(*(put.get(word, word) for word in words.split())).code == 0
    topics = checked(out)
    for begin in ("/values/", "/bus/", "/nodes/", "/findings"):
        assert any(topic.startswith(begin) for topic in topics), begin
    assert plotted(topics) >= 4


def test_two_times_the_same_channels(tmp_path: Path, sniff485: Callable[..., Any]) -> None:
    """What is read from a recording with channels, and written again, has them once."""
    one, two = tmp_path / "one.mcap", tmp_path / "two.mcap"
    sniff485("convert", CAPTURES / "rtu-usual-faults.cap.txt", one)
    sniff485("convert", one, two)
    assert checked(one) == checked(two)


def test_a_window_a_second(tmp_path: Path, sniff485: Callable[..., Any]) -> None:
    """Windows follow one another, and what they count is all there is."""
    out = tmp_path / "out.mcap"
    sniff485("convert", CAPTURES / "rtu-usual-faults.cap.txt", out)
    with out.open("rb") as stream:
        found = [message for _, channel, message in make_reader(stream).iter_messages() if channel.topic == "/bus/bus"]
    assert all(one.log_time == two.publish_time for one, two in pairwise(found))
    assert sum(json.loads(message.data)["octets"] for message in found) == 2032


def plotted(topics: dict[str, int]) -> int:
    """Channels with numbers that change over time."""
    return sum(1 for topic in topics if topic.startswith(("/values/", "/bus/", "/nodes/")))


def checked(path: Path) -> dict[str, int]:
    """Messages by topic; each JSON message is as its schema says, and the schema is flat."""
    topics: dict[str, int] = {}
    with path.open("rb") as stream:
        for schema, channel, message in make_reader(stream, validate_crcs=True).iter_messages():
            topics[channel.topic] = topics.get(channel.topic, 0) + 1
            if channel.message_encoding != "json":
                continue
            assert schema is not None
            assert schema.encoding == "jsonschema"
            _agree(json.loads(schema.data), json.loads(message.data), flat=schema.name != "foxglove.Log")
    return topics


def _agree(schema: dict[str, Any], value: object, *, flat: bool) -> None:
    assert schema["type"] == "object"
    assert isinstance(value, dict)
    assert not {"$ref", "anyOf", "oneOf", "allOf"} & schema.keys()
    assert set(schema.get("required", ())) <= value.keys() <= schema["properties"].keys()
    for name, held in value.items():
        kind = schema["properties"][name]["type"]
        if kind == "object":
            assert not flat
            _agree(schema["properties"][name], held, flat=False)
            continue
        assert isinstance(held, SCALARS[kind]), (name, held)
        assert kind == "boolean" or not isinstance(held, bool)
        assert not isinstance(held, float) or math.isfinite(held)
