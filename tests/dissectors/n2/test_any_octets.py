"""Whatever the octets: header, text, fields, packet, interpretation, simulated stations and findings stand it."""

from __future__ import annotations

import struct

from hypothesis import given, settings
from hypothesis import strategies as st

from dissectors.checksums import sum8
from dissectors.frame import Check, Damage, FoundBy, Frame, Role
from dissectors.line import Timing
from dissectors.n2 import N2Tracker, fields, interpret, packet, peek, text
from dissectors.n2.findings import N2Findings
from dissectors.n2.framing import judge
from dissectors.n2.objects import Encoding, decode, encode
from dissectors.n2.simulated import Follower, Master, command, readings

relaxed = settings(deadline=None)
START = st.sampled_from([b">", b"A", b"N"])
CHARACTERS = st.text("0123456789ABCDEFabcdefZ\x00\x1b[]\xff", max_size=30).map(lambda t: t.encode("latin-1"))


def summed(parts: tuple[bytes, bytes]) -> bytes:
    return parts[0] + parts[1] + b"%02X\r" % sum8(parts[1])


octets = st.one_of(
    st.tuples(START, CHARACTERS).map(summed),
    st.tuples(START, CHARACTERS, st.sampled_from([b"", b"\r"])).map(b"".join),
    st.tuples(START, st.binary(max_size=20)).map(b"".join),
)


def frame_of(octets: bytes) -> Frame:
    check, damage = judge(octets) if octets.endswith(b"\r") else (Check.ABSENT, Damage.TIMEOUT)
    return Frame("n2", octets, 0, 10**6, check, FoundBy.DELIMITER, damage)


@relaxed
@given(octets)
def test_a_frame_is_always_shown(octets):
    frame = frame_of(octets)
    header = peek(frame)
    assert header.ok == frame.ok
    line = text(frame, header, header.role)
    assert line.isprintable()
    assert "None" not in line
    named = fields(frame, header.role)
    assert all(name.startswith("n2.") and isinstance(value, (int, float, str)) for name, value in named.items())
    assert all(value.isprintable() for value in named.values() if isinstance(value, str))


@relaxed
@given(octets)
def test_a_packet_is_always_made_and_gives_its_octets_back(octets):
    made = packet(frame_of(octets), Role.EITHER)
    made.clear_cache()
    assert bytes(made) == octets
    made.show(dump=True)


@relaxed
@given(octets)
def test_packet_and_peek_agree(octets):
    frame = frame_of(octets)
    header, made = peek(frame), packet(frame, Role.EITHER)
    if octets[:1] != b">" or not octets.endswith(b"\r") or len(octets) < 7:
        return
    assert header.destination == (made.address if isinstance(made.address, int) else None)
    if header.address is not None:
        assert header.address == made.region << 8 | made.object


@relaxed
@given(octets, octets)
def test_any_two_frames_can_be_interpreted(request, response):
    read = interpret(frame_of(request), frame_of(response))
    assert read.text.isprintable()
    if frame_of(response).damage is not None:
        assert read.value is None


@relaxed
@given(st.lists(octets, max_size=10))
def test_simulated_stations_stand_anything(bursts):
    drive, master, now = Follower(1), Master(readings(1)), 0
    drive.hear(0, command(1, "F"), True)
    for burst in bursts:
        now += 10**8
        for station in (drive, master):
            for send in (*station.hear(now, burst, False), *station.wake(now)):
                assert send.octets
                assert send.at >= now
            due = station.next_wake()
            assert due is None or isinstance(due, int)


@relaxed
@given(st.lists(octets, max_size=12))
def test_findings_may_be_asked_at_any_time(parts):
    curious, patient = N2Findings(Timing()), N2Findings(Timing())
    tracker, now = N2Tracker(Timing()), 0
    for no, part in enumerate(parts, 1):
        now += 10**8
        check, damage = judge(part) if part.endswith(b"\r") else (Check.ABSENT, Damage.TIMEOUT)
        frame = Frame("n2", part, now, now + 10**7, check, FoundBy.DELIMITER, damage)
        header = peek(frame)
        tracked = tracker.track(no, frame, header)
        for found in (curious, patient):
            found.see(no, frame, header, tracked.placement)
            for transaction in tracked.closed:
                found.settle(transaction)
        curious.findings()
    assert curious.findings() == patient.findings()
    for finding in curious.findings():
        assert finding.first <= finding.last
        assert all(f.isprintable() for f in (finding.subject, finding.seen, finding.means, finding.next))


@relaxed
@given(st.floats(width=32, allow_nan=False))
def test_a_float_is_read_as_the_single_that_was_sent(value):
    read = decode(encode(value, Encoding.FLOAT), Encoding.FLOAT)
    assert struct.pack(">f", read) == struct.pack(">f", value)


@relaxed
@given(st.integers(-(2**15), 2**15 - 1))
def test_an_integer_is_read_as_sent(value):
    assert decode(encode(value, Encoding.INTEGER), Encoding.INTEGER, signed=True) == value


def test_lengths_and_digits_are_asked_of_a_value():
    assert decode("4248000", Encoding.FLOAT) is None
    assert decode("+1", Encoding.BYTE) is None
    assert decode("7f", Encoding.BYTE) == 127
    assert decode("FFF6", Encoding.INTEGER) == 65526
    assert encode(1e40, Encoding.FLOAT) == "7F800000"
