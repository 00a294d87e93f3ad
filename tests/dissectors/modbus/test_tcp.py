"""Modbus TCP: the framer's contract, pairing by transaction number, frames as their twins on a line."""

from __future__ import annotations

import struct

from hypothesis import given
from hypothesis import strategies as st

from dissectors.frame import Check, Chunk, Damage, Frame, Header, Noise, Role
from dissectors.line import NS_PER_S, LineSettings, Timing
from dissectors.modbus.tcp import make_tcp
from dissectors.modbus.tcp_framing import TcpFramer
from dissectors.modbus.tcp_manifest import TCP
from dissectors.tracker import Verdict
from sniff.testing.framer_contract import framer_contract

TIMING = Timing(LineSettings.parse("115200"), 0)

TestTcpContract = framer_contract(
    TcpFramer,
    st.builds(
        make_tcp,
        st.integers(0, 0xFFFF),
        st.integers(0, 255),
        st.binary(min_size=2, max_size=253).filter(lambda pdu: pdu[0] & 0x7F),
    ),
)


def asked(transaction: int, unit: int = 1, count: int = 2) -> bytes:
    return make_tcp(transaction, unit, struct.pack(">BHH", 3, 0x10, count))


def answered(transaction: int, *values: int, unit: int = 1) -> bytes:
    return make_tcp(transaction, unit, struct.pack(f">BB{len(values)}H", 3, 2 * len(values), *values))


def frames_of(*reads: bytes) -> list[Frame]:
    framer = TcpFramer(TIMING)
    events = [event for no, octets in enumerate(reads) for event in framer.feed(Chunk(no * 1_000_000, octets))]
    events += framer.close()
    assert not any(isinstance(event, Noise) for event in events)
    return [event for event in events if isinstance(event, Frame)]


def verdicts_of(*reads: bytes) -> list[tuple[int | None, int | None, Verdict]]:
    tracker = TCP.tracker(TIMING)
    closed = []
    for no, frame in enumerate(frames_of(*reads)):
        closed += tracker.track(no, frame, TCP.peek(frame)).closed
    closed += tracker.close()
    return [(one.request, one.response, one.verdict) for one in closed]


def test_frames_in_one_segment_and_over_two() -> None:
    both = asked(1) + asked(2)
    for cut in range(len(both)):
        assert [frame.octets for frame in frames_of(both[:cut], both[cut:])] == [asked(1), asked(2)]


def test_a_frame_that_the_capture_cuts_is_damaged() -> None:
    (frame,) = frames_of(asked(1)[:9])
    assert (frame.damage, frame.check, frame.expected) == (Damage.SHORT, Check.ABSENT, 12)
    assert not TCP.peek(frame).ok


def test_several_open_requests_are_answered_in_any_order() -> None:
    found = verdicts_of(asked(1), asked(2, 2), answered(2, 5, 6, unit=2), answered(1, 7, 8))
    assert found == [(1, 2, Verdict.ANSWERED), (0, 3, Verdict.ANSWERED)]


def test_exceptions_missing_and_unasked_answers() -> None:
    refused = make_tcp(1, 1, b"\x83\x02")
    assert verdicts_of(asked(1), refused) == [(0, 1, Verdict.EXCEPTION)]
    assert verdicts_of(answered(9, 1, 2)) == [(None, 0, Verdict.UNSOLICITED)]
    assert verdicts_of(asked(1)) == [(0, None, Verdict.OPEN)]
    assert verdicts_of(asked(1), asked(1)) == [(0, None, Verdict.NO_RESPONSE), (1, None, Verdict.OPEN)]
    tracker = TCP.tracker(TIMING)
    (frame,) = frames_of(asked(1))
    tracker.track(0, frame, TCP.peek(frame))
    assert [one.verdict for one in tracker.advance(60 * NS_PER_S)] == [Verdict.NO_RESPONSE]


def test_a_write_and_its_answer_are_alike() -> None:
    write = make_tcp(7, 3, struct.pack(">BHH", 6, 0x30, 9))
    assert verdicts_of(write, write) == [(0, 1, Verdict.ANSWERED)]


def test_what_a_frame_says_is_what_its_twin_says() -> None:
    request, answer = frames_of(asked(0x1234), answered(0x1234, 100, 7))
    header = TCP.peek(answer)
    assert (header.protocol, header.source, header.role, header.kind) == (
        "modbus-tcp", 1, Role.RESPONSE, "read-holding-registers",
    )  # fmt: skip
    assert TCP.text(answer, header, Role.RESPONSE) == "1 → 2 registers: 100 7  #4660"
    assert TCP.fields(request, Role.REQUEST) == {
        "mbtcp.trans_id": 0x1234, "mbtcp.prot_id": 0, "mbtcp.len": 6, "mbtcp.unit_id": 1,
        "modbus.func_code": 3, "modbus.reference_num": 16, "modbus.word_cnt": 2,
    }  # fmt: skip
    assert TCP.readings is not None
    assert [(one.address, one.value) for one in TCP.readings(request, answer)] == [(16, 100), (17, 7)]
    assert TCP.spans is not None
    assert TCP.spans(answer, TCP.readings(request, answer)) == [(9, 11), (11, 13)]
    assert set(TCP.fields(answer, Role.RESPONSE)) <= set(TCP.field_types() if TCP.field_types else ())


@given(octets=st.binary(max_size=40), damaged=st.booleans(), role=st.sampled_from(Role))
def test_everything_is_total(octets: bytes, damaged: bool, role: Role) -> None:
    frame = Frame(TCP.name, octets, 0, 0, Check.ABSENT, TCP_FOUND, Damage.SHORT if damaged else None)
    header = TCP.peek(frame)
    assert isinstance(header, Header)
    assert TCP.text(frame, header, role).isprintable()
    TCP.fields(frame, role)
    assert bytes(TCP.packet(frame, role)) == octets
    assert TCP.renamer is not None
    assert len(TCP.renamer()(frame)) == len(octets)
    assert TCP.questions is not None
    TCP.questions.of(frame)


TCP_FOUND = frames_of(asked(1))[0].found
