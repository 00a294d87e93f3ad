"""What BACnet exchanges tell."""

from __future__ import annotations

import struct
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dissectors.bacnet import apdu as apdus
from dissectors.bacnet import codec, services
from dissectors.bacnet.application import confirmed
from dissectors.bacnet.envelope import npdu_frame
from dissectors.bacnet.f510 import f510
from dissectors.bacnet.frame_types import FrameType
from dissectors.bacnet.questions import question
from dissectors.bacnet.readings import asks, readings
from dissectors.bacnet.text import parameters_text
from dissectors.bacnet.values import Double, Enumerated, show
from dissectors.frame import Check, FoundBy, Frame
from dissectors.single_reals import shortest

MASTER, DRIVE = 1, 5


def frame(source: int, destination: int, npdu: bytes, expecting: bool = False) -> Frame:
    octets = npdu_frame(destination, source, npdu, expecting)
    return Frame("mstp", octets, 0, 1, Check.GOOD, FoundBy.DELIMITER)


def exchange(request: bytes) -> list[tuple[Any, ...]]:
    drive = f510(510)
    answer = drive.answer(MASTER, request)
    assert answer is not None
    found = readings(frame(MASTER, DRIVE, request, True), frame(DRIVE, MASTER, answer))
    return [(r.space, r.address, r.value, r.how.value, r.part, r.station) for r in found]


def read(thing: str, prop: str = "present-value") -> bytes:
    return confirmed(1, 12, {"object-identifier": thing, "property-identifier": prop})


def test_read_property() -> None:
    assert exchange(read("analog-input,10")) == [("analog-input", 10, 60.0, "read", "", DRIVE)]
    assert exchange(read("binary-input,0")) == [("binary-input", 0, 0, "read", "", DRIVE)]
    assert exchange(read("device,510", "vendor-name")) == [("device", 510, "TECO F510", "read", "vendor-name", DRIVE)]
    assert exchange(read("analog-input,99")) == []


def test_write_property() -> None:
    write = {"object-identifier": "analog-output,0", "property-identifier": "present-value", "property-value": 42.5}
    request = confirmed(2, 15, write)
    assert exchange(request) == [("analog-output", 0, 42.5, "write", "", DRIVE)]
    alone = readings(frame(MASTER, DRIVE, request, True), None)
    assert [(r.address, r.value, r.station) for r in alone] == [(0, 42.5, DRIVE)]
    assert exchange(confirmed(3, 15, {**write, "property-value": 999.0})) == []


def test_read_property_multiple() -> None:
    spec = {
        "object-identifier": "analog-input,11",
        "list-of-property-references": [{"property-identifier": "present-value"}, {"property-identifier": "priority"}],
    }
    request = confirmed(4, 14, {"list-of-read-access-specs": [spec]})
    assert exchange(request) == [("analog-input", 11, 4.0, "read", "", DRIVE)]


def test_change_of_value() -> None:
    values = {
        "subscriber-process-identifier": 1,
        "initiating-device-identifier": "device,510",
        "monitored-object-identifier": "analog-input,4",
        "time-remaining": 0,
        "list-of-values": [
            {"property-identifier": "present-value", "value": 59.9},
            {"property-identifier": "status-flags", "value": Enumerated(1)},
        ],
    }
    layout = services.parameters(1, 2)
    assert layout is not None
    npdu = b"\x01\x00" + apdus.encode(1, service=2) + codec.encode(layout, values)
    found = readings(frame(DRIVE, 255, npdu), None)
    assert [(r.space, r.address, r.value, r.how.value, r.part, r.station) for r in found] == [
        ("analog-input", 4, 59.9, "report", "", DRIVE),
        ("analog-input", 4, 1, "report", "status-flags", DRIVE),
    ]


def test_changes_of_several_objects_at_once() -> None:
    values = {
        "subscriber-process-identifier": 1,
        "initiating-device-identifier": "device,510",
        "time-remaining": 60,
        "list-of-cov-notifications": [
            {
                "monitored-object-identifier": f"analog-input,{number}",
                "list-of-values": [{"property-identifier": "present-value", "value": float(number)}],
            }
            for number in (4, 5)
        ],
    }
    layout = services.parameters(1, 11)
    assert layout is not None
    npdu = b"\x01\x00" + apdus.encode(1, service=11) + codec.encode(layout, values)
    found = readings(frame(DRIVE, 255, npdu), None)
    assert [(r.address, r.value, r.how.value, r.station) for r in found] == [
        (4, 4.0, "report", DRIVE),
        (5, 5.0, "report", DRIVE),
    ]


@pytest.mark.parametrize(("seconds", "words"), [(0, "without end"), (60, "remaining 60 s")])
def test_a_subscription_of_no_time_has_no_end(seconds: int, words: str) -> None:
    values = {
        "subscriber-process-identifier": 1,
        "initiating-device-identifier": "device,510",
        "monitored-object-identifier": "analog-input,4",
        "time-remaining": seconds,
        "list-of-values": [{"property-identifier": "present-value", "value": 59.9}],
    }
    layout = services.parameters(1, 2)
    assert layout is not None
    apdu = apdus.decode(apdus.encode(1, service=2))
    assert apdu is not None
    assert parameters_text(apdu, codec.decode(layout, codec.encode(layout, values))).endswith(f"=59.9 {words}")


def test_tokens_tell_nothing() -> None:
    token = bytes.fromhex("55ff0010050000 8c".replace(" ", ""))
    assert readings(Frame("mstp", token, 0, 1, Check.GOOD, FoundBy.DELIMITER), None) == ()


@given(st.binary(max_size=40), st.none() | st.binary(max_size=40))
def test_any_octets(request: bytes, response: bytes | None) -> None:
    for kind in (FrameType.DATA_EXPECTING_REPLY, FrameType.DATA_NOT_EXPECTING_REPLY):
        asked = frame(MASTER, DRIVE, b"\x01\x00" + request, kind == FrameType.DATA_EXPECTING_REPLY)
        readings(asked, None if response is None else frame(DRIVE, MASTER, b"\x01\x00" + response))


def test_the_device_whoever_it_is() -> None:
    """4194303 is the instance of a device that is asked by one that does not know its number (clause 15.5)."""
    asked = frame(MASTER, DRIVE, read("device,*", "object-name"), True)
    assert [(one.space, one.address, one.part, one.station) for one in asks(asked)] == [
        ("device", 4194303, "object-name", DRIVE)
    ]
    assert [(one.space, one.address, one.part) for one in question(asked).spans] == [("device", 4194303, "object-name")]


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (16777215.0, "16777215"),
        (12345678.0, "12345678"),
        (0.1234567, "0.1234567"),
        (59.9, "59.9"),
        (-3.0, "-3"),
        (0.0, "0"),
        (3.4e38, "3.4e+38"),
        (1e-7, "1e-07"),
        (float("inf"), "inf"),
        (Double(123456789.123), "123456789.123"),
        (Double(0.1), "0.1"),
        (Double(2.0**53), "9007199254740992"),
    ],
)
def test_a_number_is_shown_with_all_its_digits(value: float, shown: str) -> None:
    single = value if isinstance(value, Double) else struct.unpack(">f", struct.pack(">f", value))[0]
    assert show(single) == shown


@given(st.floats(width=32, allow_nan=False))
def test_the_shortest_decimal_means_the_same_single(single: float) -> None:
    assert struct.pack(">f", shortest(single)) == struct.pack(">f", single)
    assert len(repr(shortest(single)).split("e")[0].strip("-").replace(".", "").strip("0")) <= 9
