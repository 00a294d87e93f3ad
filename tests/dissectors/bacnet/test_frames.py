"""The worked frames of the protocol notes, crafted packets, and whatever octets there may be."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from dissectors.bacnet import MSTP, fields, packet, peek, text
from dissectors.bacnet import message as messages
from dissectors.bacnet import packets as layers
from dissectors.bacnet.envelope import frame, npdu_frame
from dissectors.bacnet.packets import (
    NPDU,
    Abort,
    ComplexAck,
    ConfirmedRequest,
    MSTPFragment,
    Proprietary,
    Route,
    RoutingTable,
    UnconfirmedRequest,
    dissect,
    parameters,
)
from dissectors.bacnet.ring_observer import MstpRingObserver
from dissectors.frame import Check, Chunk, Event, Frame, Role
from tests.dissectors.bacnet.captures import TIMING, drive, frame_of, tagged_frames
from tests.seeds import examples

TAGGED = tagged_frames()
notes = pytest.mark.skipif(not TAGGED, reason="no protocol notes beside the project")


def rebuilt(found: Any) -> bytes:
    found.clear_cache()
    for layer in found.iterpayloads():
        layer.clear_cache()
    return bytes(found)


@notes
def test_there_are_as_many_worked_frames_as_expected():
    assert len(TAGGED) > 50
    assert sum(not good for good, _, _ in TAGGED) == 2


@notes
@pytest.mark.parametrize(("good", "octets", "note"), TAGGED, ids=[f"{n}" for n in range(len(TAGGED))])
def test_a_worked_frame(good: bool, octets: bytes, note: str):
    found = frame_of(octets)
    assert found.ok == good
    assert found.octets == octets
    header = peek(found)
    assert header.ok == good
    assert (header.function, header.destination, header.source) == (octets[2], octets[3], octets[4])
    assert (header.error is None) or not good or "rror" in note or "eject" in note or "bort" in note
    line = text(found, header, header.role)
    assert line.isprintable()
    assert "None" not in line
    assert "{" not in line.replace("{}", "")
    made = packet(found, header.role)
    assert rebuilt(made) == octets
    assert (made.frame_type, made.destination, made.source) == (octets[2], octets[3], octets[4])
    named = fields(found, header.role)
    assert named["mstp.checksum.status"] == int(good)
    message = messages.read(found)
    assert message is not None
    if good and message.apdu is not None and not message.apdu.segmented:
        decoded = messages.decode_parameters(message.apdu, message.parameters)
        assert decoded is None or (decoded.error, decoded.rest) == (None, ()), decoded


@notes
@pytest.mark.parametrize(
    ("part", "line"),
    [
        ("read property device,1234 object-name", "2 → 5 read-property device,1234 object-name"),
        ("", "2 → 5 read-property device,1234 object-list[1]"),
        ("", "5 → 2 read-property ack analog-input,0 present-value = 21.5"),
        ("", "5 → 2 read-property error object unknown-object"),
        ("", "2 → 5 write-property analog-output,1 present-value = null priority 8"),
        ("", "5 → 2 abort segmentation-not-supported of request 8"),
        ("", "1 → 2 reject-message-to-network 100: not directly connected to the network"),
        ("", "2 → 1 read-property to network 100:192.168.1.10:47808 device,55 object-name"),
        ("", '5 → * i-have device-identifier=device,1234 object-identifier=analog-input,1 object-name="AHU1"'),
        ("", "2 → * time-synchronization time=(date=2024-10-15 Tuesday time=13:30:45.00)"),
        ("", "2 → 5 proprietary-128 vendor 461, 2 octets"),
        ("", "2 → * data-not-expecting-reply [data CRC]"),
        ("", "5 → 2 read-property-multiple ack segment 0, more follow"),
    ],
)
def test_the_line_of_a_worked_frame(part: str, line: str):
    lines = [text(f, peek(f), Role.UNKNOWN) for f in (frame_of(octets) for _, octets, _ in TAGGED)]
    assert line in lines


def test_header_of_every_kind():
    cases = [
        (frame(0, 5, 2), "token", Role.TOKEN),
        (frame(1, 5, 2), "poll-for-master", Role.POLL),
        (frame(2, 5, 2), "reply-to-poll-for-master", Role.RESPONSE),
        (frame(3, 5, 2, b"abc"), "test-request", Role.REQUEST),
        (frame(4, 5, 2), "test-response", Role.RESPONSE),
        (frame(7, 5, 2), "reply-postponed", Role.RESPONSE),
        (frame(9, 5, 2), "reserved-9", Role.UNKNOWN),
        (frame(34, 5, 2, b"`" * 40), "ipv6", Role.DATA),
        (frame(200, 5, 2, b"\x01\xcdxy"), "proprietary-200", Role.DATA),
        (frame(6, 255, 2, bytes.fromhex("01001008")), "who-is", Role.BROADCAST),
        (frame(33, 255, 2, bytes.fromhex("01001008")), "who-is", Role.BROADCAST),
        (frame(5, 255, 2, bytes.fromhex("010400050c0c0c020004d2194d")), "read-property", Role.BROADCAST),
        (frame(6, 7, 2, bytes.fromhex("01005005 0c91019120")), "read-property", Role.RESPONSE),
        (frame(6, 7, 2, bytes.fromhex("0100e0")), "data-not-expecting-reply", Role.DATA),
        (frame(6, 7, 2, bytes.fromhex("0180850bcd")), "vendor-network-message-133", Role.DATA),
    ]
    for octets, kind, role in cases:
        header = peek(frame_of(octets))
        assert (header.kind, header.role, header.function) == (kind, role, octets[2]), octets.hex()
    assert peek(frame_of(frame(5, 1, 2, bytes.fromhex("010400050c0c0c020004d2194d")))).address == 1234
    monitored = bytes.fromhex("010400050c050912" + "1c00000009" + "2900")
    for process in ("0912", "0a1234", "0b123456", "0c12345678"):  # four octets look like an object
        octets = monitored[:6] + bytes.fromhex(process) + monitored[8:]
        assert peek(frame_of(frame(5, 1, 2, octets))).address == 9
        assert peek(frame_of(frame(5, 1, 2, octets[:-7]))).address == (0x345678 if process[1] == "c" else None)
    assert peek(frame_of(cases[12][0])).error == "object unknown-property"
    failed = "010050071e1e0c000000011e09551f2e910291202f1f"
    assert peek(frame_of(frame(6, 7, 2, bytes.fromhex(failed)))).error == "one subscription failed"


def test_long_npdus_travel_in_extended_frames():
    long = bytes.fromhex("01000305000c") + bytes(range(256)) * 3
    octets = npdu_frame(2, 5, long, expects_reply=True)
    assert octets[2] == 32
    assert messages.data_of(octets) == long
    found = frame_of(octets)
    assert found.check is Check.GOOD
    made = packet(found, Role.REQUEST)
    assert rebuilt(made) == octets
    assert isinstance(made, layers.MSTP)
    assert made.haslayer(NPDU)


def test_crafted_packets_are_good_frames_and_say_what_they_were_given():
    made = layers.MSTP(frame_type=5, destination=5, source=2) / NPDU(expects_reply=1)
    made /= ConfirmedRequest(invoke_id=1, service=15)
    made /= parameters(
        0,
        15,
        {
            "object-identifier": "analog-output,1",
            "property-identifier": "present-value",
            "property-value": 50.0,
            "priority": 8,
        },
    )
    found = frame_of(bytes(made))
    assert (
        text(found, peek(found), Role.REQUEST) == "2 → 5 write-property analog-output,1 present-value = 50 priority 8"
    )
    routed = NPDU(has_destination=1, dnet=100, dadr=b"\x07", has_source=1, snet=5, sadr=b"\x09")
    made = layers.MSTP(frame_type=6, destination=1, source=2) / routed / UnconfirmedRequest(service=8)
    found = frame_of(bytes(made))
    assert text(found, peek(found), Role.DATA) == "2 → 1 who-is to network 100:7 from network 5:9 all"
    table = RoutingTable(routes=[Route(network=7, port_id=1, info=b"ab"), Route(network=8)])
    made = layers.MSTP(frame_type=6, destination=1, source=2) / NPDU(network_message=1, message=6) / table
    found = frame_of(bytes(made))
    assert text(found, peek(found), Role.DATA) == "2 → 1 initialize-routing-table 7 8"
    forged = layers.MSTP(frame_type=0, destination=5, source=2, header_crc=0)
    assert not frame_of(bytes(forged)).ok
    assert frame_of(bytes(layers.MSTP(frame_type=128, destination=1, source=2) / Proprietary(vendor_id=461) / b"x")).ok
    assert (
        bytes(layers.MSTP(frame_type=6, destination=1, source=2) / NPDU() / Abort(reason=4))[8:13].hex() == "0100700004"
    )
    assert ComplexAck().segmented == 0


def test_tags_carry_their_meaning():
    octets = frame(5, 5, 2, bytes.fromhex("010400050c0c0c020004d2194d"))
    found = dissect(octets)
    assert [tag.meaning for tag in found.lastlayer().tags] == [
        "object-identifier: device,1234",
        "property-identifier: object-name (77)",
    ]


def test_text_from_the_wire_is_harmless():
    name = b"\x00\x1b[31m\x07\xe2\x80\xae{markup}"
    body = bytes.fromhex("01001001c4020004d2c400000001") + bytes((0x75, len(name))) + name
    found = frame_of(frame(6, 255, 5, body))
    line = text(found, peek(found), Role.BROADCAST)
    assert line.isprintable()
    assert "\\x1b" in line
    assert "\u202e" not in line
    assert all(str(value).isprintable() for value in fields(found, Role.BROADCAST).values())


apdus = st.sampled_from(["010000", "010030", "010010", "010050"])
npdus = st.one_of(
    st.binary(max_size=40),
    st.tuples(
        st.sampled_from(["0100", "0104", "0120000105aabbccddee07", "010800640130", "0180", "0120ffff00ff"]),
        st.binary(max_size=40),
    ).map(lambda p: bytes.fromhex(p[0]) + p[1]),
    st.tuples(
        st.sampled_from(["010000", "010030", "010010", "010050"]), st.integers(0, 34), st.binary(max_size=50)
    ).map(lambda p: bytes.fromhex(p[0]) + bytes((5, 1, p[1])) + p[2]),
)


@settings(suppress_health_check=[HealthCheck.too_slow], deadline=None, max_examples=examples(200))
@given(st.sampled_from([3, 5, 6, 9, 32, 33, 34, 90, 128, 255]), npdus)
def test_whatever_a_good_frame_carries(frame_type: int, data: bytes):
    octets = frame(frame_type, 5, 2, data)
    _stand(frame_of(octets))


@settings(suppress_health_check=[HealthCheck.too_slow], deadline=None, max_examples=examples(150))
@given(
    st.lists(st.one_of(st.binary(max_size=30), npdus.map(lambda d: frame(6, 5, 2, d)[:-1]), st.just(b"\x55\xff\x06")))
)
def test_whatever_the_octets(pieces: list[bytes]):
    events = drive([Chunk(10**18 + n * 10**7, piece) for n, piece in enumerate(pieces)])
    tracker, observer, findings = MSTP.tracker(TIMING), MstpRingObserver(TIMING), MSTP.judge(TIMING)
    for no, event in enumerate(events):
        header = None
        if isinstance(event, Frame):
            _stand(event)
            header = peek(event)
        placed = tracker.track(no, event, header)
        observer.see(no, event, header)
        findings.see(no, event, header, placed.placement)
    tracker.advance(10**19)
    tracker.close()
    observer.ring()
    findings.findings()


def _stand(event: Event) -> None:
    assert isinstance(event, Frame)
    header = peek(event)
    assert text(event, header, header.role).isprintable()
    for value in fields(event, header.role).values():
        assert isinstance(value, (int, float, str))
    found = packet(event, header.role)
    assert rebuilt(found) == event.octets
    if not isinstance(found, MSTPFragment):
        assert (found.destination, found.source) == (header.destination, header.source)


@given(st.binary(max_size=30))
def test_a_packet_of_any_octets_gives_them_back(octets: bytes):
    assert rebuilt(dissect(octets)) == octets
    assert rebuilt(dissect(b"\x55\xff" + octets)) == b"\x55\xff" + octets


def test_segments_name_their_service_and_only_the_first_names_an_object():
    target = bytes.fromhex("0c020004d2")
    for pdu, sizes in ((0x0E, b"\x03"), (0x3C, b"")):
        for sequence, address in ((0, 1234), (1, None)):
            apdu = bytes((pdu,)) + sizes + bytes((9, sequence, 4, 14)) + target
            header = peek(frame_of(frame(5, 5, 2, b"\x01\x04" + apdu)))
            assert (header.kind, header.address) == ("read-property-multiple", address)
            assert header.role is (Role.REQUEST if pdu == 0x0E else Role.RESPONSE)
