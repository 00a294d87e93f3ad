"""RTU framing, situation by situation: what the wire carried, what the framer says of it."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from pathlib import Path

import pytest

from dissectors.checksums import crc16_modbus
from dissectors.frame import Check, Chunk, Damage, Event, FoundBy, Frame, LineError, Mark, Noise, Place, Reason
from dissectors.line import LineSettings, Timing
from dissectors.modbus.framing import WINDOW, RtuFramer
from sniff.testing.driving import drive
from tests.bus_delivery import FTDI_LATENCY, MS, Wire, exact, ftdi, laid_out

TIMING = Timing(LineSettings.parse("9600"))
PROTOCOLS = Path(__file__).parents[3] / "../shared/protocols"


def rtu(text: str) -> bytes:
    body = bytes.fromhex(text)
    return body + crc16_modbus(body).to_bytes(2, "little")


REQUEST = rtu("01 03 0000 0002")
RESPONSE = rtu("01 03 04 000A 000B")
OTHER = rtu("02 04 0010 0001")
VENDOR = rtu("01 64 0102 0304")


def wire(*parts: tuple[float, bytes]) -> Wire:
    """Octets on a wire at 9600 Bd: (silence before in ms, octets) …"""
    now, octets = 1000 * MS, []
    for gap, part in parts:
        now += int(gap * MS)
        for octet in part:
            now += TIMING.char
            octets.append((now, octet))
    return octets


def read(*parts: tuple[float, bytes], latency: int = 0, style: Callable[[Wire], list[Chunk]] = exact) -> list[Event]:
    """All events of such a wire, with silence before the first part and after the last one proved."""
    framer = RtuFramer(Timing(TIMING.line, latency))
    octets = wire((0, REQUEST), (200, parts[0][1]), *parts[1:])
    events = [e for chunk in style(octets) for e in framer.feed(chunk)]
    events += framer.advance(octets[-1][0] + 1000 * MS)
    assert events[0].octets == REQUEST
    assert framer.deadline() is None
    return events[1:]


def brief(events: Iterable[Event]) -> list[tuple[object, ...]]:
    """Events as short tuples: what, octets, and how found or why not."""
    short: list[tuple[object, ...]] = []
    for e in events:
        if isinstance(e, Noise):
            short.append((e.reason, e.octets, e.place))
        elif e.ok:
            short.append((e.found, e.octets))
        else:
            short.append((e.damage, e.octets, e.check, e.expected))
    return short


# --- silence, lengths, provenance -------------------------------------------------------------------------------------


def test_clean_frames_are_found_by_their_gaps() -> None:
    events = read((0, REQUEST), (5, RESPONSE), (50, OTHER))
    assert brief(events) == [(FoundBy.GAP, REQUEST), (FoundBy.GAP, RESPONSE), (FoundBy.GAP, OTHER)]


def test_frames_of_every_length_wait_for_the_silence_that_follows() -> None:
    frames = {count: rtu(f"05 01 {count:02X}" + "55" * count) for count in range(1, 251)}
    found = {count: brief(read((0, frame))) for count, frame in frames.items()}
    assert found == {count: [(FoundBy.GAP, frame)] for count, frame in frames.items()}


def test_a_clean_frame_is_given_as_soon_as_silence_is_proved() -> None:
    framer = RtuFramer(TIMING)
    octets = wire((0, REQUEST))
    assert [e for chunk in exact(octets) for e in framer.feed(chunk)] == []
    due = framer.deadline()
    assert due == octets[-1][0] + TIMING.t35 + TIMING.char
    assert framer.advance(due - 1) == []
    assert brief(framer.advance(due)) == [(FoundBy.LENGTH, REQUEST)]  # nothing is known of the time before it
    assert framer.deadline() is None


def test_frames_without_silence_between_are_split() -> None:
    assert brief(read((0, REQUEST + RESPONSE + OTHER))) == [
        (FoundBy.SPLIT, REQUEST),
        (FoundBy.SPLIT, RESPONSE),
        (FoundBy.SPLIT, OTHER),
    ]


def test_a_reply_too_early_for_the_gap_rule_is_found_by_length() -> None:
    events = read((0, REQUEST), (2.5, RESPONSE))
    assert brief(events) == [(FoundBy.LENGTH, REQUEST), (FoundBy.LENGTH, RESPONSE)]


def test_several_frames_in_one_read_of_a_slow_adapter() -> None:
    events = read((0, REQUEST), (4, RESPONSE), (4, REQUEST), (4, RESPONSE), latency=FTDI_LATENCY, style=ftdi)
    assert [e.octets for e in events] == [REQUEST, RESPONSE, REQUEST, RESPONSE]
    assert all(isinstance(e, Frame) and e.ok for e in events)


def test_frames_are_committed_without_any_silence() -> None:
    framer = RtuFramer(Timing(TIMING.line, FTDI_LATENCY))
    octets = laid_out([REQUEST, RESPONSE] * 20, TIMING, 0)
    given = [e for chunk in exact(octets) for e in framer.feed(chunk)]
    assert [e.octets for e in given] == ([REQUEST, RESPONSE] * 20)[: len(given)]
    assert len(octets) - sum(len(e.octets) for e in given) < 32


def test_slack_and_marks_go_with_the_frame() -> None:
    framer = RtuFramer(Timing(TIMING.line, FTDI_LATENCY))
    marks = (Mark(1, LineError.PARITY), Mark(9, LineError.FRAMING))
    events = framer.feed(Chunk(1000 * MS, b"\xff" + REQUEST + RESPONSE, marks)) + framer.close()
    noise, request, response = events
    assert noise.marks == ()
    assert request.marks == (Mark(0, LineError.PARITY),)
    assert response.marks == (Mark(0, LineError.FRAMING),)
    assert isinstance(request, Frame)
    assert request.slack == FTDI_LATENCY
    assert request.skipped == 1
    assert request.end == 1000 * MS - len(RESPONSE) * TIMING.char


# --- frames in pieces -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("at", range(1, len(RESPONSE)))
def test_a_frame_cut_by_a_late_read_is_joined(at: int) -> None:
    events = read((0, REQUEST), (5, RESPONSE[:at]), (8, RESPONSE[at:]), (60, OTHER))
    assert brief(events) == [(FoundBy.GAP, REQUEST), (FoundBy.JOINED, RESPONSE), (FoundBy.GAP, OTHER)]


def test_a_frame_cut_before_the_zero_that_its_crc_ends_with_is_joined() -> None:
    request = rtu("02 03 D560 0064")
    assert request[-1] == 0
    assert crc16_modbus(request[:-1]) == 0
    assert brief(read((0, request[:-1]), (8, request[-1:]), (60, OTHER))) == [
        (FoundBy.JOINED, request),
        (FoundBy.GAP, OTHER),
    ]
    (alone,) = read((0, request[:-1]))
    assert isinstance(alone, Frame)
    assert (alone.check, alone.expected, alone.flags) == (Check.GOOD, 8, ("odd-length",))


def test_a_frame_that_never_goes_on_is_damaged_and_given_in_bounded_time() -> None:
    framer = RtuFramer(TIMING)
    octets = wire((0, REQUEST), (5, RESPONSE[:5]))
    for chunk in exact(octets):
        framer.feed(chunk)
    assert framer.advance(octets[-1][0] + 10 * MS) == []
    due = framer.deadline()
    assert due is not None
    assert due <= octets[-1][0] + framer.hold + 2 * TIMING.char
    (event,) = framer.advance(due)
    assert brief([event]) == [(Damage.SHORT, RESPONSE[:5], Check.ABSENT, 9)]


def test_the_next_request_ends_the_wait_for_the_rest() -> None:
    events = read((0, REQUEST), (5, RESPONSE[:5]), (5, OTHER), (60, REQUEST))
    assert brief(events) == [
        (FoundBy.GAP, REQUEST),
        (Damage.SHORT, RESPONSE[:5], Check.ABSENT, 9),
        (FoundBy.GAP, OTHER),
        (FoundBy.GAP, REQUEST),
    ]


def test_a_good_frame_is_never_held() -> None:
    """A request whose address makes it look like the begin of a response of 69 octets."""
    request = rtu("01 03 4000 0001")
    framer = RtuFramer(TIMING)
    octets = wire((0, REQUEST), (50, request))
    for chunk in exact(octets):
        framer.feed(chunk)
    assert brief(framer.advance(octets[-1][0] + TIMING.t35 + TIMING.char)) == [(FoundBy.GAP, request)]


# --- the two traps ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("zeros", [1, 2, 3, 7])
@pytest.mark.parametrize("frame", [REQUEST, RESPONSE, rtu("01 01 0400 0001"), VENDOR, rtu("01 83 02")])
def test_zeros_after_a_frame_are_noise_though_the_crc_stays_good(frame: bytes, zeros: int) -> None:
    assert crc16_modbus(frame + bytes(zeros)) == 0
    if frame == VENDOR and zeros <= 2:
        pytest.skip("nothing tells its length: the CRC of one frame in 256 ends with a zero")
    events = read((0, frame + bytes(zeros)), (50, OTHER))
    assert [e.octets for e in events] == [frame, bytes(zeros), OTHER]
    noise = events[1]
    assert isinstance(noise, Noise)
    assert (noise.reason, noise.place) == (Reason.ZEROS, Place.AFTER)
    assert all(isinstance(e, Frame) and e.ok for e in (events[0], events[2]))


def test_a_good_crc_alone_is_no_frame() -> None:
    """Inside a run of octets a stretch with a right CRC and a length that nothing predicts stays noise."""
    stretch = rtu("01 64 11 22 33 44")
    events = read((0, bytes.fromhex("9A 8B") + stretch + bytes.fromhex("77 99")), (50, OTHER))
    assert not [e for e in events if isinstance(e, Frame) and e.octets == stretch]


def test_an_exception_in_the_middle_of_noise_needs_its_request() -> None:
    exception = rtu("09 83 02")
    lone = read((0, b"\x99\x9a" + exception + b"\x9b\x9c"), (50, OTHER))
    assert exception not in [e.octets for e in lone]
    asked = read((0, rtu("09 03 0000 0001") + b"\x99\x9a" + exception + b"\x9b\x9c"), (50, OTHER))
    assert exception in [e.octets for e in asked if isinstance(e, Frame) and e.ok]


def test_a_request_inside_the_first_octets_of_the_awaited_response_is_part_of_it() -> None:
    """The data are such that the first 8 octets read as a good request: the longer reading was asked for."""
    asked = rtu("01 03 0000 0020")
    answered = rtu((rtu("01 03 40 00 00 05") + bytes(range(59))).hex())
    assert crc16_modbus(answered[:8]) == 0
    for latency in (0, FTDI_LATENCY):
        events = read((0, asked + answered + asked + answered), latency=latency)
        assert [e.octets for e in events] == [asked, answered, asked, answered]


# --- what the first octets predict ------------------------------------------------------------------------------------


def test_a_response_with_the_length_of_a_request_is_told_by_what_was_asked() -> None:
    """FC1, 8 octets: coils 0x0300 and one, or three octets of coils. The next request must fit the reading."""
    asked, answered = rtu("01 01 0000 0014"), rtu("01 01 03 000001")
    events = read((0, asked + answered + asked + answered), (50, OTHER))
    assert [e.octets for e in events] == [asked, answered, asked, answered, OTHER]


def test_an_unknown_function_is_found_between_two_silences() -> None:
    frame = rtu("01 64 0102030405")
    (event,) = read((0, frame))
    assert brief([event]) == [(FoundBy.GAP, frame)]
    assert isinstance(event, Frame)
    assert event.expected is None


def test_loop_back_data_may_be_of_any_length() -> None:
    frame = rtu("01 08 0000 0102 0304 0506")
    assert brief(read((0, frame))) == [(FoundBy.GAP, frame)]


def test_a_right_crc_at_a_wrong_length_is_said_as_it_is() -> None:
    frame = rtu("07 03 02 0000 0000")
    (event,) = read((0, frame))
    assert brief([event]) == [(FoundBy.GAP, frame)]
    assert isinstance(event, Frame)
    assert (event.expected, event.flags) == (7, ("odd-length",))


@pytest.mark.parametrize("code", [0x10, 0x20, 0x51, 0x52, 0x99])
def test_vendor_exception_codes_are_frames_between_silences(code: int) -> None:
    frame = rtu(f"01 83 {code:02X}")
    assert brief(read((0, REQUEST), (5, frame))) == [(FoundBy.GAP, REQUEST), (FoundBy.GAP, frame)]


@pytest.mark.parametrize("unit", [0xF8, 0xFE, 0xFF])
def test_units_above_247_are_taken_when_silence_or_the_request_speaks_for_them(unit: int) -> None:
    asked, answered = rtu(f"{unit:02X} 06 2502 1770"), rtu(f"{unit:02X} 06 2502 1770")
    assert brief(read((0, asked), (5, answered))) == [(FoundBy.GAP, asked), (FoundBy.GAP, answered)]
    assert [e.octets for e in read((0, asked + answered), (9, OTHER))] == [asked, answered, OTHER]


# --- damage and noise -------------------------------------------------------------------------------------------------


def test_a_wrong_check_is_a_damaged_frame_of_its_station() -> None:
    bad = RESPONSE[:-1] + bytes([RESPONSE[-1] ^ 1])
    assert brief(read((0, REQUEST), (5, bad), (50, OTHER))) == [
        (FoundBy.GAP, REQUEST),
        (Damage.CHECK, bad, Check.BAD, 9),
        (FoundBy.GAP, OTHER),
    ]


def test_the_open_request_tells_the_length_that_a_damaged_byte_count_hides() -> None:
    bad = bytes.fromhex("01 03 24") + RESPONSE[3:]
    assert brief(read((0, REQUEST), (5, bad), (5, OTHER))) == [
        (FoundBy.GAP, REQUEST),
        (Damage.CHECK, bad, Check.BAD, 9),
        (FoundBy.GAP, OTHER),
    ]


def test_two_octets_between_silences_are_a_frame_where_they_were_asked_before() -> None:
    events = read((0, REQUEST), (5, RESPONSE), (60, REQUEST[:2]), (60, OTHER[:2]), (60, REQUEST))
    assert brief(events)[2:4] == [
        (Damage.SHORT, REQUEST[:2], Check.ABSENT, 8),
        (Reason.NO_FRAME, OTHER[:2], Place.BETWEEN),
    ]


def test_octets_too_many_make_a_long_frame() -> None:
    bad = RESPONSE[:6] + b"\x55" + RESPONSE[6:]
    assert brief(read((0, REQUEST), (5, bad), (50, OTHER)))[1] == (Damage.LONG, bad, Check.BAD, 9)


def test_damage_between_frames_without_silence_is_attributed_too() -> None:
    bad = RESPONSE[:4] + b"\x55" + RESPONSE[5:]
    events = read((0, REQUEST + bad + OTHER), latency=FTDI_LATENCY, style=ftdi)
    assert brief(events) == [(FoundBy.SPLIT, REQUEST), (Damage.CHECK, bad, Check.BAD, 9), (FoundBy.SPLIT, OTHER)]


def test_random_bursts_put_no_stations_on_a_bus_with_stations() -> None:
    burst = bytes.fromhex("63 03 17 99 20 41")
    assert brief(read((0, burst), (50, OTHER))) == [(Reason.NO_FRAME, burst, Place.BETWEEN), (FoundBy.GAP, OTHER)]


def test_the_place_of_noise() -> None:
    events = read((0, b"\xff" + REQUEST), (5, RESPONSE + b"\xfe"), (30, b"\x99"), (30, OTHER))
    assert brief(events) == [
        (Reason.NO_FRAME, b"\xff", Place.BEFORE),
        (FoundBy.SPLIT, REQUEST),
        (FoundBy.SPLIT, RESPONSE),
        (Reason.NO_FRAME, b"\xfe", Place.AFTER),
        (Reason.NO_FRAME, b"\x99", Place.BETWEEN),
        (FoundBy.GAP, OTHER),
    ]


def test_noise_nearer_to_the_next_frame_lies_before_it() -> None:
    events = read((0, REQUEST), (2.5, b"\xfc"), (0.2, RESPONSE))
    assert brief(events)[1] == (Reason.NO_FRAME, b"\xfc", Place.BEFORE)


def test_a_break_is_said_to_be_one() -> None:
    framer = RtuFramer(TIMING)
    events = framer.feed(Chunk(0, b"\0", (Mark(0, LineError.BREAK),))) + framer.close()
    assert brief(events) == [(Reason.BREAK, b"\0", Place.BETWEEN)]


def test_without_silence_the_window_stays_bounded() -> None:
    framer = RtuFramer(TIMING)
    held = 0
    for number in range(100):
        octets = b"\x99" * 100
        held += len(octets) - sum(len(e.octets) for e in framer.feed(Chunk(number * 100 * TIMING.char, octets)))
        assert held < WINDOW
    assert sum(len(e.octets) for e in framer.close()) == held


def test_damage_at_the_head_does_not_hide_what_follows_without_silence() -> None:
    """A byte count of 250 that is not there: the frames behind it are found before 250 octets have passed."""
    framer = RtuFramer(Timing(TIMING.line, FTDI_LATENCY))
    octets = laid_out([REQUEST, bytes.fromhex("01 03 FA 00 0A"), *[OTHER, rtu("02 04 02 1234")] * 6], TIMING, 0)
    given = [e for chunk in exact(octets) for e in framer.feed(chunk)]
    assert sum(e.octets in (OTHER, rtu("02 04 02 1234")) for e in given) >= 8


# --- other protocols --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "line", [b":010300000002FA\r\n", b":01080000A5371B\r\n", b">0111010387\r", b"A0042910000F0\r", b"A\r", b"N05\r"]
)
def test_text_protocols_are_noise(line: bytes) -> None:
    assert all(isinstance(e, Noise) for e in read((0, line), (40, line), (40, line)))


def test_text_with_a_right_crc_between_two_silences_is_still_text() -> None:
    texts = [b"A%04dB" % number for number in range(500)]
    frames = [t + crc16_modbus(t).to_bytes(2, "little") for t in texts]
    readable = [f for f in frames if f.isascii() and f.decode().isprintable()]
    assert readable
    for frame in readable:
        assert all(isinstance(e, Noise) for e in read((0, frame)))


# --- printed frames ---------------------------------------------------------------------------------------------------


def printed(tag: str) -> list[bytes]:
    if not PROTOCOLS.is_dir():
        pytest.skip("shared protocol notes are not here")
    text = (PROTOCOLS / "modbus.md").read_text()
    return [bytes.fromhex(m[1].split(";")[0]) for m in re.finditer(rf"^{tag} +(\S.*)$", text, re.MULTILINE)]


@pytest.mark.parametrize("latency", [0, FTDI_LATENCY])
def test_every_printed_frame_is_good_on_its_own_and_in_a_row(latency: int) -> None:
    frames = printed("RTU")
    assert len(frames) > 50
    timing = Timing(TIMING.line, latency)
    for frame in frames:
        events = drive(RtuFramer(timing), exact(laid_out([frame], timing, 0)))
        assert brief(events) == [(FoundBy.LENGTH, frame)]
    events = drive(RtuFramer(timing), exact(laid_out(frames, timing, 50 * MS)))
    assert [e.octets for e in events] == frames
    assert all(isinstance(e, Frame) and e.ok for e in events)


def test_every_frame_printed_with_a_wrong_check_is_bad() -> None:
    frames = printed("BAD-RTU")
    assert bytes.fromhex("010302 1770 AF82") in frames
    assert bytes.fromhex("028352 C0CD") in frames
    for frame in frames:
        (event,) = read((0, frame))
        assert brief([event]) == [(Damage.CHECK, frame, Check.BAD, len(frame))]


def test_zeros_behind_a_frame_that_another_length_would_take_up_raise_nothing() -> None:
    """What would have to be longer than the octets that are there was looked up all the same."""
    framer = RtuFramer(Timing(LineSettings.parse("115200,8N1")))
    events = framer.feed(Chunk(7_789_000_000, bytes.fromhex("3f836d1e09e77a7a")))
    events += framer.feed(Chunk(9_449_000_000, bytes.fromhex("3f03504100")))
    events += framer.close()
    assert b"".join(event.octets for event in events) == bytes.fromhex("3f836d1e09e77a7a3f03504100")
