"""ASCII framing, situation by situation."""

from __future__ import annotations

import random
import re
from collections.abc import Iterable
from pathlib import Path

import pytest

from dissectors.checksums import lrc
from dissectors.frame import (
    Check,
    Chunk,
    Damage,
    Event,
    Flaw,
    FoundBy,
    Frame,
    LineError,
    Mark,
    Noise,
    Place,
    Reason,
    Repair,
)
from dissectors.line import NS_PER_S, LineSettings, Timing
from dissectors.modbus.ascii_framing import MAX_CHARACTERS, MAX_NOISE, AsciiFramer
from sniff.testing.driving import drive
from tests.bus_delivery import FTDI_LATENCY, MS, exact, ftdi, laid_out
from tests.captures_shared import listed

TIMING = Timing(LineSettings.parse("9600,8N1"))
PROTOCOLS = Path(__file__).parents[3] / "../shared/protocols"
REQUEST = b":010300130002E7\r\n"
RESPONSE = b":010304252025216D\r\n"


def frame(text: str) -> bytes:
    body = bytes.fromhex(text)
    return b":" + (body + bytes([lrc(body)])).hex().upper().encode() + b"\r\n"


def read(*parts: bytes, gap: int = 20 * MS, timing: Timing = TIMING) -> list[Event]:
    return drive(AsciiFramer(timing), exact(laid_out(parts, timing, gap)))


def brief(events: Iterable[Event]) -> list[tuple[object, ...]]:
    short: list[tuple[object, ...]] = []
    for e in events:
        if isinstance(e, Noise):
            short.append((e.reason, e.octets))
        elif e.ok:
            short.append((e.octets, *e.flags))
        else:
            short.append((e.damage, e.octets, e.check))
    return short


def test_frames_are_given_with_their_delimiters_as_soon_as_they_end() -> None:
    framer = AsciiFramer(TIMING)
    octets = laid_out([REQUEST], TIMING, 0)
    chunks = exact(octets)
    assert [e for c in chunks[:-1] for e in framer.feed(c)] == []
    (event,) = framer.feed(chunks[-1])
    assert brief([event]) == [(REQUEST,)]
    assert isinstance(event, Frame)
    assert (event.found, event.expected, event.end) == (FoundBy.DELIMITER, len(REQUEST), octets[-1][0])
    assert framer.deadline() is None


def test_frames_of_one_read() -> None:
    assert brief(drive(AsciiFramer(TIMING), [Chunk(0, REQUEST + RESPONSE + REQUEST)])) == [
        (REQUEST,),
        (RESPONSE,),
        (REQUEST,),
    ]


def test_silence_of_a_second_is_allowed_and_more_is_not() -> None:
    head, tail = REQUEST[:7], REQUEST[7:]
    assert brief(read(head, tail, gap=NS_PER_S)) == [(REQUEST,)]
    late = read(head, tail, RESPONSE, gap=NS_PER_S + 1)
    assert brief(late) == [(Damage.TIMEOUT, head, Check.ABSENT), (Reason.NO_DELIMITER, tail), (RESPONSE,)]


def test_latency_is_taken_off_a_silence_before_it_ends_a_frame() -> None:
    timing = Timing(TIMING.line, FTDI_LATENCY)
    assert brief(read(REQUEST[:7], REQUEST[7:], gap=NS_PER_S + FTDI_LATENCY, timing=timing)) == [(REQUEST,)]
    framer = AsciiFramer(timing)
    framer.feed(Chunk(0, REQUEST[:7]))
    due = framer.deadline()
    assert due is not None
    assert framer.advance(due - 1) == []
    assert brief(framer.advance(due)) == [(Damage.TIMEOUT, REQUEST[:7], Check.ABSENT)]


def test_a_colon_restarts() -> None:
    assert brief(read(b":0103001", REQUEST)) == [(Damage.RESTARTED, b":0103001", Check.ABSENT), (REQUEST,)]


def test_a_colon_without_a_station_is_a_false_start() -> None:
    assert brief(read(b":::", REQUEST))[-1] == (REQUEST,)
    events = read(b":?", REQUEST)
    assert [e.octets for e in events if isinstance(e, Frame)] == [REQUEST]
    assert events[0].octets == b":?"
    assert isinstance(events[0], Noise)
    assert events[0].reason is Reason.FALSE_START


def test_lower_case_is_accepted_and_said() -> None:
    lower = REQUEST.lower()
    assert brief(read(lower)) == [(lower, "lower-case")]


@pytest.mark.parametrize("odd", [False, True])
def test_bit_7_as_a_parity_bit(odd: bool) -> None:
    """A line of 7E1 or 7O1 read with 8 data bits."""
    raw = bytes(c | 0x80 if bool(c.bit_count() & 1) is not odd else c for c in REQUEST)
    assert raw != REQUEST
    assert brief(read(raw, raw)) == [(raw, "parity-bit")] * 2
    seven = Timing(LineSettings.parse("9600,7E1"))
    assert brief(read(raw, timing=seven)) == [(raw,)]


def test_bit_7_that_is_no_parity_is_damage() -> None:
    raw = REQUEST[:4] + bytes([REQUEST[4] | 0x80]) + REQUEST[5:]
    assert brief(read(raw)) == [(Damage.FORM, raw, Check.BAD)]


def test_cr_alone_ends_a_frame_when_something_else_follows() -> None:
    bare = frame("0101 0002 0010")[:-1]
    assert brief(read(bare, REQUEST)) == [(bare, "cr-only"), (REQUEST,)]
    framer = AsciiFramer(TIMING)
    framer.feed(Chunk(0, bare))
    due = framer.deadline()
    assert due is not None
    assert brief(framer.advance(due)) == [(bare, "cr-only")]


def test_lf_alone_ends_a_damaged_frame() -> None:
    bare = REQUEST[:-2] + b"\n"
    (event,) = read(bare)
    assert isinstance(event, Frame)
    assert (event.damage, event.check, event.flags) == (Damage.FORM, Check.GOOD, ("lf-only",))


@pytest.mark.parametrize("gap", [0, 20 * MS])
def test_false_starts_in_a_row_are_one_stretch_of_noise(gap: int) -> None:
    events = read(REQUEST, b"::0:::0::\r", REQUEST, gap=gap)
    assert brief(events) == [(REQUEST,), (Reason.FALSE_START, b"::0:::0::\r"), (REQUEST,)]


def test_a_start_at_the_end_of_noise_waits_for_its_frame() -> None:
    events = read(REQUEST, b"\x99:", REQUEST[1:], gap=500 * MS)
    assert brief(events) == [(REQUEST,), (Reason.NO_DELIMITER, b"\x99"), (REQUEST,)]


@pytest.mark.parametrize("gap", [0, 20 * MS])
@pytest.mark.parametrize(
    ("flaw", "first"), [(Flaw.FIRST_MISSING, b""), (Flaw.FIRST_SPOILT, b"\xba"), (Flaw.FIRST_SPOILT, b"A")]
)
def test_a_start_that_is_missing_or_spoilt(flaw: Flaw, first: bytes, gap: int) -> None:
    spoilt = first + RESPONSE[1:]
    if first == b"\xba":
        spoilt = b"\x1a" + RESPONSE[1:]
    events = read(REQUEST, spoilt, REQUEST, spoilt, gap=gap)
    assert [e.octets for e in events] == [REQUEST, spoilt, REQUEST, spoilt]
    for event in events[1::2]:
        assert isinstance(event, Frame)
        assert (event.damage, event.repair) == (Damage.FORM, Repair(flaw, RESPONSE))


def test_an_end_that_is_missing() -> None:
    events = read(REQUEST, RESPONSE[:-2], REQUEST, RESPONSE[:-2])
    assert [e.octets for e in events] == [REQUEST, RESPONSE[:-2], REQUEST, RESPONSE[:-2]]
    for event, damage in zip(events[1::2], (Damage.RESTARTED, Damage.SHORT), strict=True):
        assert isinstance(event, Frame)
        assert (event.damage, event.repair) == (damage, Repair(Flaw.LAST_TWO_MISSING, RESPONSE))


def test_what_is_cut_earlier_is_not_repaired() -> None:
    for count in range(3, len(RESPONSE) - 2):
        (event, _) = read(RESPONSE[:count], REQUEST)
        assert isinstance(event, Frame)
        assert event.repair is None


def test_a_changed_delimiter_is_learnt_for_its_station_alone() -> None:
    change = frame("01 08 0003 3B00")
    own, foreign = REQUEST[:-1] + b";", frame("02 03 0000 0001")[:-1] + b";"
    assert brief(read(own)) == [(own[:-1], "cr-only"), (Reason.NO_DELIMITER, b";")]
    assert brief(read(change, change, own, foreign))[2:] == [
        (own, "own-delimiter"),
        (foreign[:-1], "cr-only"),
        (Reason.NO_DELIMITER, b";"),
    ]
    back = frame("01 08 0003 0A00")
    assert brief(read(change, change, own, back, back, own))[-2:] == [
        (own[:-1], "cr-only"),
        (Reason.NO_DELIMITER, b";"),
    ]
    assert brief(read(change, REQUEST, own))[-1] == (Reason.NO_DELIMITER, b";")  # it was never confirmed


@pytest.mark.parametrize(
    ("raw", "damage", "check"),
    [
        (b":010300130002E8\r\n", Damage.CHECK, Check.BAD),
        (b":01030013000E7\r\n", Damage.FORM, Check.BAD),  # odd number of digits
        (b":0103001?0002E7\r\n", Damage.FORM, Check.BAD),
        (b":0103001300\r\n", Damage.SHORT, Check.BAD),
        (b":0103001300020001E7\r\n", Damage.LONG, Check.BAD),
        (b":0103\r\n", Damage.SHORT, Check.ABSENT),
    ],
)
def test_damage(raw: bytes, damage: Damage, check: Check) -> None:
    assert brief(read(raw, REQUEST)) == [(damage, raw, check), (REQUEST,)]


def test_a_right_sum_at_a_wrong_length_is_said_as_it_is() -> None:
    longer = b":0103001300020000E7\r\n"  # a sum does not see zeros
    (event,) = read(longer)
    assert brief([event]) == [(longer, "odd-length")]
    assert isinstance(event, Frame)
    assert event.expected == len(REQUEST)


def test_a_frame_of_the_greatest_length_and_one_longer() -> None:
    longest = frame("01 03 FA" + "0102" * 125)
    assert len(longest) == MAX_CHARACTERS - 2
    assert brief(read(longest)) == [(longest,)]
    full = frame("01 41" + "00" * 252)
    assert len(full) == MAX_CHARACTERS
    assert brief(read(full)) == [(full,)]
    over = frame("01 41" + "00" * 253)
    assert brief(read(over, REQUEST)) == [
        (Damage.LONG, over[: MAX_CHARACTERS - 1], Check.ABSENT),
        (Reason.NO_DELIMITER, over[MAX_CHARACTERS - 1 :]),
        (REQUEST,),
    ]


def test_noise_outside_frames_and_its_place() -> None:
    framer = AsciiFramer(TIMING)
    parts = [REQUEST + b"\xfe", b"\x99", b"\xff" + RESPONSE]
    events = [e for c in exact(laid_out(parts, TIMING, 50 * MS)) for e in framer.feed(c)]
    assert [(e.octets, e.place) for e in events if isinstance(e, Noise)] == [
        (b"\xfe", Place.AFTER),
        (b"\x99", Place.BETWEEN),
        (b"\xff", Place.BEFORE),
    ]
    assert [e.skipped for e in events if isinstance(e, Frame)] == [0, 3]


def test_noise_is_not_held_for_long() -> None:
    framer = AsciiFramer(TIMING)
    chunks = exact(laid_out([b"\x99" * 2000], TIMING, 0))
    given = sum(len(e.octets) for c in chunks for e in framer.feed(c))
    assert 2000 - given < MAX_NOISE
    assert sum(len(e.octets) for e in framer.close()) == 2000 - given


def test_a_break_is_said_to_be_one() -> None:
    (event,) = drive(AsciiFramer(TIMING), [Chunk(0, b"\0", (Mark(0, LineError.BREAK),))])
    assert isinstance(event, Noise)
    assert event.reason is Reason.BREAK


def test_vectors() -> None:
    frames = [f.octets for f in listed("vectors-modbus-suites") if f.octets[:1] == b":"]
    assert len(frames) == 15
    odd = b":FF0100\r\n"  # a read request with nothing to read
    assert brief(read(*frames)) == [(f, "odd-length") if f == odd else (f,) for f in frames]


def test_lines_of_issues_and_manuals() -> None:
    """Whole frames, a reply that was cut off, one ended by CR alone, one with a wrong LRC."""
    lines = listed("modbus-ascii-misc")
    events = read(*(f.octets for f in lines))
    frames = [e for e in events if isinstance(e, Frame)]
    right = {f.octets for f in lines if "lrc=ok" in f.note}
    assert {f.octets for f in frames if f.ok} == right
    (wrong,) = [f.octets for f in lines if "lrc=BAD" in f.note]
    assert [f.damage for f in frames if f.octets == wrong] == [Damage.CHECK]
    assert [f.octets for f in frames if f.damage is Damage.RESTARTED] == [b":0103280", b":01050000FF"]


def test_every_printed_frame() -> None:
    if not PROTOCOLS.is_dir():
        pytest.skip("shared protocol notes are not here")
    text = (PROTOCOLS / "modbus.md").read_text()
    frames = [m[1].encode() + b"\r\n" for m in re.finditer(r"^ASC +(:[0-9A-F]+)", text, re.MULTILINE)]
    assert len(frames) > 15
    odd = b":010301000AF1\r\n"  # printed to show the sum
    assert brief(read(*frames)) == [(f, "odd-length") if f == odd else (f,) for f in frames]


@pytest.mark.parametrize("name", ["vectors-n2open-digimat", "mstp-kargs-2009", "modbus-rtu-daly-ess"])
def test_no_good_frame_in_the_traffic_of_other_protocols(name: str) -> None:
    events = read(*(f.octets for f in listed(name)))
    assert not [e for e in events if isinstance(e, Frame) and e.check is Check.GOOD]


def test_random_octets_make_no_frames() -> None:
    dice = random.Random(485)
    chunks = [Chunk(i * 300 * TIMING.char, dice.randbytes(300)) for i in range(1, 1001)]
    events = drive(AsciiFramer(TIMING), chunks)
    assert not [e for e in events if isinstance(e, Frame) and e.check is Check.GOOD]


def test_noise_in_every_gap_and_a_slow_adapter() -> None:
    dice = random.Random(7)
    frames = [frame(f"{dice.randint(1, 247):02X} 03 {dice.randrange(65536):04X} 0001") for _ in range(200)]
    parts = [b for f in frames for b in (dice.randbytes(dice.randint(1, 3)), f)]
    timing = Timing(TIMING.line, FTDI_LATENCY)
    for events in (read(*parts), drive(AsciiFramer(timing), ftdi(laid_out(parts, timing, 3 * MS)))):
        found = [e.octets for e in events if isinstance(e, Frame) and e.ok]
        assert found == frames
