"""Numbers whose unit the standard fixes stand with it, in the line, in the tree and beside points."""

from __future__ import annotations

from typing import Any

import pytest

from dissectors.bacnet import apdu as apdus
from dissectors.bacnet import codec, names, services
from dissectors.bacnet.envelope import npdu_frame
from dissectors.bacnet.fixed_units import OF_PROPERTIES
from dissectors.bacnet.packets.outlines import outlined
from dissectors.bacnet.property_types import PROPERTY_TYPES
from dissectors.bacnet.readings import readings
from dissectors.bacnet.text import parameters_text
from dissectors.bacnet.values import Signed
from dissectors.frame import Check, FoundBy, Frame
from dissectors.profiles.decoding import decode


def line(kind: int, service: int, values: dict[str, Any]) -> str:
    layout = services.parameters(kind, service)
    apdu = apdus.decode(apdus.encode(kind, service=service))
    assert layout is not None
    assert apdu is not None
    return parameters_text(apdu, codec.decode(layout, codec.encode(layout, values)))


@pytest.mark.parametrize(
    ("number", "index", "value", "words"),
    [
        ("apdu-timeout", None, 3000, "3000 ms"),
        ("utc-offset", None, Signed(-60), "-60 min"),
        ("log-interval", None, 6000, "6000 × 10 ms"),
        ("number-of-apdu-retries", None, 3, "3"),
        ("execution-delay", 0, 4, "4"),  # elements, not a delay
        ("execution-delay", 2, 4, "4 ms"),
        ("apdu-timeout", None, "soon", '"soon" (CharacterString, not Unsigned)'),
    ],
)
def test_a_property(number: str, index: int | None, value: object, words: str):
    about: dict[str, Any] = {"object-identifier": "device,1", "property-identifier": number, "property-value": value}
    about |= {} if index is None else {"property-array-index": index}
    assert line(3, 12, about).rpartition(" = ")[2] == words
    octets, outline = codec.encode(services.ACK[12], about), codec.Outline()
    codec.decode(services.ACK[12], octets, outline)
    (top,) = outlined(octets, outline)
    assert top.children[-1].text.startswith(words.partition(" (")[0]) or words.startswith('"')


@pytest.mark.parametrize(("lifetime", "words"), [(300, "lifetime=300 s"), (0, "lifetime=without end")])
def test_a_subscription(lifetime: int, words: str):
    asked = {"subscriber-process-identifier": 1, "monitored-object-identifier": "analog-input,1", "lifetime": lifetime}
    assert line(0, 5, asked).endswith(words)


def test_a_device_is_silent_for_minutes():
    assert "time-duration=5 min" in line(0, 17, {"time-duration": 5, "enable-disable": "disable"})


def test_only_numbers_have_units():
    kinds = {PROPERTY_TYPES[number] for number in OF_PROPERTIES}
    assert kinds <= {"Unsigned", "{Unsigned}", "Signed", "Real"}
    assert all(number in names.PROPERTIES for number in OF_PROPERTIES)


@pytest.mark.parametrize(
    ("number", "value", "text"), [("apdu-timeout", 3000, "3000 ms"), ("number-of-apdu-retries", 3, "3")]
)
def test_points_have_them(number: str, value: object, text: str):
    about = {"object-identifier": "device,1", "property-identifier": number, "property-value": value}
    apdu = apdus.encode(3, service=12, invoke_id=1) + codec.encode(services.ACK[12], about)
    octets = npdu_frame(1, 9, b"\x01\x00" + apdu, False)
    (told,) = readings(Frame("mstp", octets, 0, 0, Check.GOOD, FoundBy.LENGTH), None)
    (point,) = decode(None, (told,))
    assert point.text == text
