"""The framer contract on MS/TP, and what MS/TP asks beyond it."""

from __future__ import annotations

import struct

from hypothesis import given, settings
from hypothesis import strategies as st

from dissectors.bacnet import cobs
from dissectors.bacnet.frame_types import PREAMBLE
from dissectors.bacnet.framing import MstpFramer
from dissectors.checksums import crc8_mstp, crc16_x25
from dissectors.frame import Check, Chunk, Damage, Event, FoundBy, Frame, Noise
from dissectors.line import LineSettings, Timing
from sniff.testing.framer_contract import framer_contract

MS = 1_000_000
START = 10**18
LINE = Timing(LineSettings(38400))


def mstp(frame_type: int, destination: int, source: int, data: bytes = b"") -> bytes:
    """A good frame, made by the standard's rules and nothing of the framer's."""
    body = b""
    length = len(data)
    if 32 <= frame_type <= 127:
        body = cobs.encode_body(data)
        length = len(body) - 2
    elif data:
        body = data + struct.pack("<H", crc16_x25(data))
    header = struct.pack(">BBBH", frame_type, destination, source, length)
    return PREAMBLE + header + bytes((crc8_mstp(header),)) + body


TOKEN = mstp(0, 5, 2)
addresses = st.integers(0, 255)
payloads = st.one_of(
    st.binary(min_size=1, max_size=40),
    st.lists(st.sampled_from([TOKEN, PREAMBLE, b"\x55", b"\xff", b"\x00"]), min_size=1, max_size=8).map(b"".join),
)
frames = st.one_of(
    st.builds(mstp, st.sampled_from([0, 1, 2, 7]), addresses, addresses),
    st.builds(mstp, st.sampled_from([3, 4, 5, 6, 128, 255, 9]), addresses, addresses, payloads),
    st.builds(mstp, st.sampled_from([32, 33, 34, 85]), addresses, addresses, payloads),
    st.binary(min_size=480, max_size=501).map(lambda data: mstp(6, 1, 2, data)),
    st.binary(min_size=502, max_size=700).map(lambda data: mstp(33, 1, 2, data)),
)

TestMstpContract = framer_contract(MstpFramer, frames, examples=25)


def drive(octets: bytes, *more: tuple[int, bytes], timing: Timing = LINE) -> list[Event]:
    """Octets back to back, then others after so many ns of silence."""
    framer, now = MstpFramer(timing), START
    events = []
    for pause, piece in ((0, octets), *more):
        now += pause + len(piece) * timing.char
        events += framer.feed(Chunk(now, piece))
    return events + framer.close()


@given(st.lists(frames, min_size=1, max_size=5))
def test_frames_back_to_back_need_no_gap(stream):
    events = drive(b"".join(stream))
    assert [e.octets for e in events] == stream
    assert all(isinstance(e, Frame) and e.check is Check.GOOD and e.damage is None for e in events)


@given(st.binary(max_size=60), frames)
def test_the_frame_after_any_rubbish_is_found_without_a_pause(rubbish, frame):
    """At once in the same run of octets; only a header's worth of rubbish that calls for more octets may hold it."""
    events = drive(rubbish + frame + TOKEN * 2)
    good = [e.octets for e in events if isinstance(e, Frame) and e.ok]
    assert good[-2:] == [TOKEN, TOKEN]
    assert b"".join(e.octets for e in events) == rubbish + frame + TOKEN * 2


@given(frames.filter(lambda f: len(f) > 8), st.data())
def test_a_damaged_body_keeps_what_the_header_says(frame, data):
    at = data.draw(st.integers(8, len(frame) - 1))
    broken = frame[:at] + bytes((frame[at] ^ 1 << data.draw(st.integers(0, 7)),)) + frame[at + 1 :]
    events = drive(broken, (20 * MS, TOKEN))
    first = events[0]
    assert isinstance(first, Frame)
    assert not first.ok
    assert first.damage in (Damage.CHECK, Damage.RESTARTED)
    assert first.octets[:8] == frame[:8]
    assert events[-1].octets == TOKEN
    assert events[-1].ok


@given(frames.filter(lambda f: len(f) > 12), st.data())
def test_a_frame_cut_short_does_not_swallow_the_next_one(frame, data):
    cut = frame[: data.draw(st.integers(8, len(frame) - 1))]
    for pause in (0, 25 * MS, 600 * MS):
        events = drive(cut, (pause, TOKEN), (20 * MS, TOKEN))
        assert [e.octets for e in events if isinstance(e, Frame) and e.ok][-2:] == [TOKEN, TOKEN]
        assert isinstance(events[0], Frame)
        assert events[0].damage in (Damage.RESTARTED, Damage.SHORT, Damage.TIMEOUT)


@given(st.integers(2, 30), st.integers(120, 400))
def test_a_late_read_inside_a_good_frame_joins_it(at, pause):
    frame = mstp(6, 255, 2, bytes.fromhex("0120ffff00ff10080a04d21a04d2") + bytes(20))
    events = drive(frame[:at], (pause * MS, frame[at:]), (20 * MS, TOKEN))
    assert [e.octets for e in events] == [frame, TOKEN]
    assert events[0].ok
    assert events[0].found is FoundBy.JOINED


def test_after_silence_a_good_header_ends_a_cut_frame_at_once():
    """Without waiting for as many octets as the cut frame had announced."""
    framer = MstpFramer(LINE)
    cut = mstp(6, 1, 2, bytes(400))[:30]
    assert framer.feed(Chunk(START, cut)) == []
    events = framer.feed(Chunk(START + 25 * MS, TOKEN)) + framer.advance(START + 40 * MS)
    assert [e.octets for e in events] == [cut, TOKEN]
    assert events[0].damage is Damage.RESTARTED


def test_the_pad_octet_belongs_to_the_frame_and_a_second_one_does_not():
    events = drive(TOKEN + b"\xff" + TOKEN + b"\xff\xff" + TOKEN)
    assert [(type(e), e.octets) for e in events] == [
        (Frame, TOKEN + b"\xff"),
        (Frame, TOKEN + b"\xff"),
        (Noise, b"\xff"),
        (Frame, TOKEN),
    ]
    assert events[0].flags == ("trailing-pad",)
    assert events[-1].skipped == 1


def test_a_pad_that_was_read_later_makes_the_frame_no_longer():
    held_back = Timing(LineSettings(38400), 17_500_000)
    events = drive(TOKEN, (15 * MS, b"\xff" + TOKEN), timing=held_back)
    assert [e.octets for e in events] == [TOKEN + b"\xff", TOKEN]
    assert events[0].end - events[0].start == 9 * held_back.char


def test_an_octet_long_after_the_frame_is_no_pad():
    events = drive(TOKEN, (30 * MS, b"\xff"), (30 * MS, TOKEN))
    assert [type(e) for e in events] == [Frame, Noise, Frame]
    assert events[0].flags == ()


def test_repeated_55_and_doubled_preambles():
    assert [e.octets for e in drive(b"\x55\x55\x55" + TOKEN[1:])] == [b"\x55\x55", TOKEN]
    assert [e.octets for e in drive(PREAMBLE + TOKEN)] == [PREAMBLE, TOKEN]


@settings(max_examples=30)
@given(st.integers(502, 2043))
def test_plain_data_too_long_for_the_standard_are_kept_and_said(size):
    events = drive(mstp(6, 1, 2, bytes(size)) + TOKEN)
    assert [e.octets[:3] for e in events] == [b"\x55\xff\x06", b"\x55\xff\x00"]
    assert events[0].check is Check.GOOD
    assert events[0].damage is Damage.LONG


def test_an_impossible_length_holds_nothing_up():
    header = struct.pack(">BBBH", 6, 1, 2, 60000)
    framer = MstpFramer(LINE)
    events = framer.feed(Chunk(START, PREAMBLE + header + bytes((crc8_mstp(header),)) + TOKEN + b"\x55"))
    assert isinstance(events[0], Frame)
    assert events[0].damage is Damage.LONG
    assert events[1].octets == TOKEN


def test_a_bad_header_with_good_data_is_one_damaged_frame():
    frame = bytearray(mstp(6, 255, 2, bytes.fromhex("01001008")))
    frame[7] ^= 1
    events = drive(bytes(frame) + TOKEN)
    assert [(e.octets, e.ok) for e in events] == [(bytes(frame), False), (TOKEN, True)]
    assert events[0].damage is Damage.HEADER


def test_what_a_cut_frame_awaited_holds_back_no_good_frame_after_it() -> None:
    """A header announces 489 octets of data; nothing, then a whole shorter frame: that is decided by its own end."""
    cut, whole = mstp(6, 1, 2, bytes(489))[:8], mstp(6, 1, 2, bytes(480))
    framer, now, events = MstpFramer(LINE), START, []
    for pause, octets in ((0, cut), (2 * MS, whole)):
        now += pause
        for octet in octets:
            now += LINE.char
            events += framer.feed(Chunk(now, bytes((octet,))))
    events += framer.advance(now + 2 * MS)
    assert [e.octets for e in events] == [cut, whole]
