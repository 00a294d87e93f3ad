"""BACnet/IP: the framer's contract, pairing by invoke number, frames as their twins on MS/TP."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from dissectors.bacnet.ip import make_ip
from dissectors.bacnet.ip_framing import IpFramer
from dissectors.bacnet.ip_manifest import BACNET_IP
from dissectors.frame import Check, Chunk, Damage, FoundBy, Frame, Header, Role
from dissectors.line import LineSettings, Timing
from dissectors.tracker import Verdict
from sniff.testing.framer_contract import framer_contract

TIMING = Timing(LineSettings.parse("115200"), 0)
HERE, THERE = b"\xc0\x00\x02\x01\xba\xc0", b"\xc0\x00\x02\x09\xba\xc0"
EVERYBODY = b"\xc0\x00\x02\xff\xba\xc0"

TestIpContract = framer_contract(
    IpFramer, st.builds(make_ip, st.just(HERE), st.just(THERE), st.integers(0, 12), st.binary(max_size=60))
)


def asked(invoke: int) -> bytes:
    return make_ip(HERE, THERE, 0x0A, bytes.fromhex(f"01040005{invoke:02x}0c0c000000011955"))


def answered(invoke: int) -> bytes:
    return make_ip(THERE, HERE, 0x0A, bytes.fromhex(f"010030{invoke:02x}0c0c0000000119553e4441b800003f"))


def refused(invoke: int) -> bytes:
    return make_ip(THERE, HERE, 0x0A, bytes.fromhex(f"010050{invoke:02x}0c9101911f"))


def frames_of(*datagrams: bytes) -> list[Frame]:
    framer = IpFramer(TIMING)
    events = [event for no, octets in enumerate(datagrams) for event in framer.feed(Chunk(no * 1_000_000, octets))]
    return [event for event in events + framer.close() if isinstance(event, Frame)]


def verdicts_of(*datagrams: bytes) -> list[tuple[int | None, int | None, Verdict]]:
    tracker = BACNET_IP.tracker(TIMING)
    closed = []
    for no, frame in enumerate(frames_of(*datagrams)):
        closed += tracker.track(no, frame, BACNET_IP.peek(frame)).closed
    closed += tracker.close()
    return [(one.request, one.response, one.verdict) for one in closed]


def test_requests_are_paired_by_ends_and_number() -> None:
    assert verdicts_of(asked(1), asked(2), refused(2), answered(1)) == [
        (1, 2, Verdict.EXCEPTION),
        (0, 3, Verdict.ANSWERED),
    ]
    assert verdicts_of(answered(1)) == [(None, 0, Verdict.UNSOLICITED)]
    assert verdicts_of(asked(1), asked(1), answered(1)) == [(0, None, Verdict.NO_RESPONSE), (1, 2, Verdict.RETRY)]


def test_what_a_frame_says() -> None:
    whois = make_ip(HERE, EVERYBODY, 0x0B, bytes.fromhex("0120ffff00ff1008"))
    registers = make_ip(HERE, THERE, 0x05, b"\x0e\x10")
    who, ask, answer, register = frames_of(whois, asked(1), answered(1), registers)
    assert (BACNET_IP.peek(who).source, BACNET_IP.peek(who).destination) == (1, 255)
    text = BACNET_IP.text(answer, BACNET_IP.peek(answer), Role.RESPONSE)
    assert "analog-input,1 present-value = 23" in text
    assert "192.0.2.9 → 192.0.2.1" in text
    assert BACNET_IP.peek(register).kind == "register-foreign-device"
    assert BACNET_IP.readings is not None
    (reading,) = BACNET_IP.readings(ask, answer)
    assert (reading.space, reading.address) == ("analog-input", 1)
    assert BACNET_IP.field_types is not None
    for frame in (who, ask, answer, register):
        assert set(BACNET_IP.fields(frame, Role.REQUEST)) <= set(BACNET_IP.field_types())
        assert bytes(BACNET_IP.packet(frame, Role.REQUEST)) == frame.octets
    assert BACNET_IP.packet(ask, Role.REQUEST).haslayer("NPDU")


def test_a_broadcast_that_a_router_passes_on_is_of_the_device_that_sent_it() -> None:
    i_am = bytes.fromhex("0120ffff00ff1000c4020000052201e0910021ff")
    passed_on, plain = frames_of(make_ip(HERE, EVERYBODY, 0x04, THERE + i_am), make_ip(THERE, EVERYBODY, 0x0B, i_am))
    header, itself = BACNET_IP.peek(passed_on), BACNET_IP.peek(plain)
    assert (header.kind, header.source, header.destination) == ("i-am", 9, 255)
    assert (itself.kind, itself.source, itself.destination) == ("i-am", 9, 255)
    assert "device,5" in BACNET_IP.text(passed_on, header, Role.BROADCAST)
    cut = make_ip(HERE, EVERYBODY, 0x04, THERE)
    assert BACNET_IP.peek(frames_of(cut)[0]).kind == "forwarded-npdu"


@given(
    octets=st.one_of(
        st.binary(max_size=60),
        st.builds(make_ip, st.just(HERE), st.just(THERE), st.integers(0, 255), st.binary(max_size=40)),
    ),
    damaged=st.booleans(),
    role=st.sampled_from(Role),
)
def test_everything_is_total(octets: bytes, damaged: bool, role: Role) -> None:
    frame = Frame(BACNET_IP.name, octets, 0, 0, Check.ABSENT, FoundBy.LENGTH, Damage.SHORT if damaged else None)
    header = BACNET_IP.peek(frame)
    assert isinstance(header, Header)
    assert BACNET_IP.text(frame, header, role).isprintable()
    BACNET_IP.fields(frame, role)
    assert bytes(BACNET_IP.packet(frame, role)) == octets
    BACNET_IP.tracker(TIMING).track(0, frame, header)


def test_what_a_datagram_says_without_an_npdu() -> None:
    def said(function: int, content: str) -> tuple[str, dict[str, object]]:
        (frame,) = frames_of(make_ip(HERE, THERE, function, bytes.fromhex(content)))
        told = {name: value for name, value in BACNET_IP.fields(frame, Role.DATA).items() if name.startswith("bvlc.")}
        assert bytes(BACNET_IP.packet(frame, Role.DATA)) == frame.octets
        text = BACNET_IP.text(frame, BACNET_IP.peek(frame), Role.DATA).partition("  ")[0]
        return text.partition(" → 9 ")[2], told

    text, told = said(0x00, "0030")
    assert (text, told["bvlc.result"]) == ("result: register foreign device refused", 0x30)
    assert said(0x00, "0000")[0] == "result: done"
    assert said(0x00, "1234")[0] == "result: code 1234h"
    text, told = said(0x05, "003c")
    assert (text, told["bvlc.reg_ttl"]) == ("register foreign device for 60 s", 60)
    assert said(0x08, "c0000209bac0")[0] == "delete foreign device 192.0.2.9:47808"
    assert said(0x03, "c0000209bac0ffffff00")[0] == ("broadcast distribution table: 192.0.2.9:47808 mask 255.255.255.0")
    assert said(0x07, "c0000209bac0003c001e")[0] == "foreign device table: 192.0.2.9:47808 for 60 s, 30 s left"
    assert said(0x07, "")[0] == "foreign device table: empty"
    assert said(0x00, "00") == ("result", {"bvlc.type": 0x81, "bvlc.function": 0, "bvlc.length": 5})
    forwarded = said(0x04, "c0000207bac0" + "0120ffff00ff1008")[1]
    assert (forwarded["bvlc.fwd_ip"], forwarded["bvlc.fwd_port"]) == ("192.0.2.7", 47808)
