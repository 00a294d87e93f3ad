"""The layout against what is known apart from it: the standard's lengths, scapy's names, octets of every function."""

from __future__ import annotations

import pytest
from hypothesis import given
from scapy.contrib import modbus as contrib

from dissectors.frame import Role
from dissectors.modbus.fields import fields
from dissectors.modbus.layout import MESSAGES, SUB_FUNCTIONS
from dissectors.modbus.notation import Group, Means, Message, counted, fixed_length, places
from dissectors.modbus.pdus import PACKETS, REQUESTS, RESPONSES
from dissectors.modbus.ranges import AGREEMENTS, ANSWERED, ASKED, RANGES_REPEATED, SHARED, SINGLE_WRITES
from dissectors.modbus.shapes import told
from tests.property.modbus_adus import requests, responses, rtu

BOTH = [
    pytest.param(message, id=f"{code:02X} {direction}")
    for code, messages in MESSAGES.items()
    for direction, message in (("request", messages.request), ("response", messages.response))
]
FIXED = {  # octets of request and response with unit and CRC (V1.1b3, clause 6); None: a count tells
    0x01: (8, None),
    0x02: (8, None),
    0x03: (8, None),
    0x04: (8, None),
    0x05: (8, 8),
    0x06: (8, 8),
    0x07: (4, 5),
    0x08: (8, 8),
    0x0B: (4, 8),
    0x0C: (4, None),
    0x0F: (None, 8),
    0x10: (None, 8),
    0x11: (4, None),
    0x14: (None, None),
    0x15: (None, None),
    0x16: (10, 10),
    0x17: (None, None),
    0x18: (6, None),
    0x2B: (7, None),
}
COUNTED = {  # where the byte count stands, and where what it counts begins
    "request": {0x0F: (6, 7), 0x10: (6, 7), 0x14: (2, 3), 0x15: (2, 3), 0x17: (10, 11)},
    "response": {
        **dict.fromkeys((0x01, 0x02, 0x03, 0x04, 0x11, 0x14, 0x15, 0x17), (2, 3)),
        0x0C: (2, 9),
        0x18: (2, 6),
    },
}


def test_lengths_are_those_of_the_standard() -> None:
    assert {code: (fixed_length(m.request), fixed_length(m.response)) for code, m in MESSAGES.items()} == FIXED


@pytest.mark.parametrize("direction", COUNTED)
def test_byte_counts_stand_where_the_standard_has_them(direction: str) -> None:
    found = {code: counted(getattr(messages, direction)) for code, messages in MESSAGES.items()}
    assert {code: (c.count.at, c.start) for code, c in found.items() if c is not None} == COUNTED[direction]


@pytest.mark.parametrize("message", BOTH)
def test_what_fills_the_rest_stands_last_and_counts_before_it(message: Message) -> None:
    lists = [field for field in message if field.is_list]
    assert len(lists) <= 1
    assert not lists or message[-1] is lists[0]
    assert not lists or lists[0].means is Means.WORD or {f.means for f in message} & {Means.BYTES, Means.QUANTITY}
    for field in message:
        assert field.size or field.means is Means.GROUPS
        assert field.means is not Means.GROUPS or Group.of(field.group).size


@pytest.mark.parametrize(
    ("code", "request_bits", "response_bits"),
    [
        (0x01, 5, 0),  # 2000 of 65536 quantities
        (0x03, 9, 1),  # 125 of 65536; an even byte count
        (0x05, 12, 12),
        (0x06, 0, 0),
        (0x0C, 0, 2),
        (0x0F, 12, 5),
        (0x10, 12, 9),
        (0x14, 12, 12),
        (0x17, 12, 1),
        (0x18, 0, 12),
        (0x2B, 12, 12),
    ],
)
def test_bits_that_a_shape_tells(code: int, request_bits: int, response_bits: int) -> None:
    assert (told(MESSAGES[code].request)[0], told(MESSAGES[code].response)[0]) == (request_bits, response_bits)


def test_what_follows_from_the_layout() -> None:
    assert set(AGREEMENTS) == {0x0F, 0x10, 0x17}
    assert {0x0F, 0x10} == RANGES_REPEATED
    assert {0x05, 0x06} == SINGLE_WRITES
    assert set(ASKED) == {1, 2, 3, 4, 5, 6, 0x0F, 0x10, 0x14, 0x16, 0x17, 0x18, 0x2B}
    assert set(ANSWERED) == {3, 4, 5, 6, 0x0F, 0x10, 0x16, 0x17, 0x18, 0x2B}
    assert set(SHARED) == {5, 6, 0x0F, 0x10, 0x16}
    assert {code for code, sub in SUB_FUNCTIONS.items() if sub.counter} == {2, *range(0x0B, 0x13)}


@pytest.mark.parametrize(("direction", "classes"), [("request", REQUESTS), ("response", RESPONSES)])
def test_packets_have_the_names_that_scapy_gives(direction: str, classes: dict[int, type]) -> None:
    theirs = getattr(contrib, f"_modbus_{direction}_classes")
    ours_only = {"data", "serverId", "status", "byteCount"}  # scapy: nothing, slaveId in parts, startAddr, dataLength
    for code, cls in theirs.items():
        names = {field.name for field in cls.fields_desc}
        missing = {field.name for field in classes[code].fields_desc} - names - ours_only
        assert not missing, f"function {code:#04x}"


def test_every_packet_can_be_imported_by_its_name() -> None:
    from dissectors.modbus import pdus

    assert len(PACKETS) == 2 * len(MESSAGES) + 4  # and four kinds of groups
    assert all(getattr(pdus, name) is cls for name, cls in PACKETS.items())
    with pytest.raises(AttributeError, match="NoSuchPacket"):
        _ = pdus.NoSuchPacket


@given(requests)
def test_packets_and_fields_read_what_stands_at_the_places_of_a_request(frame_of, pdu: bytes) -> None:
    agree(frame_of, pdu, MESSAGES[pdu[0]].request, REQUESTS[pdu[0]](pdu), Role.REQUEST)


@given(responses)
def test_packets_and_fields_read_what_stands_at_the_places_of_a_response(frame_of, pdu: bytes) -> None:
    agree(frame_of, pdu, MESSAGES[pdu[0]].response, RESPONSES[pdu[0]](pdu), Role.RESPONSE)


def agree(frame_of, pdu: bytes, message: Message, packet, role: Role) -> None:
    octets = b"\1" + pdu
    found = fields(frame_of(rtu(octets)), role)
    for place in places(message):
        if place.field.is_list:
            continue
        number = int.from_bytes(octets[place.at : place.at + place.field.size], "big")
        assert packet.getfieldval(place.field.scapy) == number
        name = f"modbus.{place.field.wireshark}"
        if place.field.wireshark and place.field.means is not Means.VALUE:
            assert str(found[name]).split(",")[0] == str(number), name
    assert bytes(packet) == pdu
