"""Known frames: framed, judged, named, read; and the same frames damaged."""

from __future__ import annotations

import pytest

from dissectors.frame import Check, Chunk, Damage, Event, FoundBy, Frame, Noise, Place, Reason, Role
from dissectors.line import Timing
from dissectors.meaning import Meaning
from dissectors.n2 import N2, N2Framer, fields, interpret, packet, peek, readings, text
from dissectors.n2.framing import SILENCE, judge
from dissectors.n2.interpretation import change_records, guessed_time
from dissectors.n2.text import meant

MS = 1_000_000
TIMING = Timing()


def frame_of(octets: bytes) -> Frame:
    """The frame of whole octets, as the framer would judge it."""
    check, damage = judge(octets)
    return Frame("n2", octets, 0, len(octets) * TIMING.char, check, FoundBy.DELIMITER, damage)


def line(octets: bytes) -> str:
    frame = frame_of(octets)
    return text(frame, peek(frame), Role.EITHER)


def wire(*parts: bytes, pause: int = 20 * MS) -> list[Event]:
    """Events of octets with a pause before each part."""
    framer, events, now = N2Framer(TIMING), [], 10**18
    for part in parts:
        now += pause + len(part) * TIMING.char
        events += framer.feed(Chunk(now, part))
    return events + framer.close()


def octets_of(events: list[Event]) -> list[bytes]:
    return [e.octets for e in events]


# --- framing ----------------------------------------------------------------------------------------------------------


def test_the_noted_frames_are_all_found(noted_frames):
    events = wire(*noted_frames)
    assert len(noted_frames) == 32
    assert octets_of(events) == noted_frames
    assert all(isinstance(e, Frame) and e.ok for e in events)


def test_the_frames_of_another_implementation_are_all_found(digimat_frames):
    events = wire(*digimat_frames)
    assert len(digimat_frames) == 30
    assert octets_of(events) == digimat_frames
    assert all(isinstance(e, Frame) and e.ok for e in events)
    assert [e.flags for e in events if e.flags] == [("lower-case",), ("lower-case",)]


def test_all_without_a_pause_as_one_read(noted_frames, digimat_frames):
    for frames in (noted_frames, digimat_frames):
        assert octets_of(wire(b"".join(frames))) == frames


@pytest.mark.parametrize("bit", range(7))
def test_each_noted_frame_with_one_bit_wrong_is_not_good(noted_frames, bit):
    for good in noted_frames:
        if good[:1] == b"N" or len(good) < 4:
            continue
        for at in range(1, len(good) - 3):
            bad = good[:at] + bytes([good[at] ^ 1 << bit]) + good[at + 1 :]
            if bad[at : at + 1] in (b">", b"\r"):
                continue
            check, damage = judge(bad)
            assert (check, damage is None) == (Check.BAD, False), bad


@pytest.mark.parametrize(
    ("octets", "check", "damage"),
    [
        (b">0111010387\r", Check.GOOD, None),
        (b">0111010388\r", Check.BAD, Damage.CHECK),
        (b">01110387\r", Check.BAD, Damage.SHORT),
        (b">011101030087\r", Check.BAD, Damage.LONG),
        (b">01\r", Check.ABSENT, Damage.SHORT),
        (b">01110103xy\r", Check.BAD, Damage.FORM),
        (b">01\xb11010387\r", Check.BAD, Damage.FORM),
        (b"A\r", Check.ABSENT, None),
        (b"A00\r", Check.GOOD, None),
        (b"A4\r", Check.ABSENT, Damage.SHORT),
        (b"A4065\r", Check.BAD, Damage.CHECK),
        (b"N11\r", Check.ABSENT, None),
        (b"N1\r", Check.ABSENT, Damage.SHORT),
        (b"N111\r", Check.ABSENT, Damage.LONG),
        (b"Nx1\r", Check.ABSENT, Damage.FORM),
    ],
)
def test_the_verdict_on_a_frame(octets, check, damage):
    assert judge(octets) == (check, damage)


def test_a_new_command_ends_what_was_being_sent():
    events = wire(b">01110>0111010387\r")
    assert [(e.octets, e.damage) for e in events] == [(b">01110", Damage.RESTARTED), (b">0111010387\r", None)]


def test_a_frame_without_end_is_given_up_after_silence():
    framer = N2Framer(TIMING)
    assert framer.feed(Chunk(10**18, b">01110103")) == []
    due = framer.deadline()
    assert due is not None
    assert due - 10**18 == SILENCE + TIMING.char
    (event,) = framer.advance(due)
    assert (event.octets, event.damage) == (b">01110103", Damage.TIMEOUT)
    assert framer.deadline() is None


def test_a_pause_inside_a_frame_is_told():
    (event,) = wire(b">01110", b"10387\r")
    assert event.ok
    assert event.found is FoundBy.JOINED


def test_the_256_character_limit():
    body = b"01" + b"8" * 252
    fits = b">" + body[:-1] + b"%02X" % (sum(body[:-1]) & 0xFF)
    assert len(fits) == 256
    events = wire(fits + b"\r")
    assert events[0].damage is Damage.LONG
    fits = b">" + body[:-2] + b"%02X\r" % (sum(body[:-2]) & 0xFF)
    assert len(fits) == 256
    assert [e.ok for e in wire(fits)] == [True]


def test_an_answer_is_found_behind_a_command_that_lost_its_end():
    events = wire(b">0111010387\x8dA0042910000F0\r")
    assert [(e.octets, e.damage, e.found) for e in events] == [
        (b">0111010387\x8d", Damage.FORM, FoundBy.DELIMITER),
        (b"A0042910000F0\r", None, FoundBy.SPLIT),
    ]


def test_an_answer_is_found_behind_a_stray_octet_while_one_is_awaited():
    events = wire(b">0111010387\r\xff\xfeA0042910000F0\r")
    assert octets_of(events) == [b">0111010387\r", b"\xff\xfe", b"A0042910000F0\r"]
    assert isinstance(events[1], Noise)
    assert events[2].skipped == 2


def test_behind_text_an_answer_does_not_begin_even_while_one_is_awaited():
    # the first character of an answer was lost: its rest ends like an acknowledgement with an empty checksum
    events = wire(b">0111010387\r", b"4A00\r")
    assert [(e.octets, e.ok) for e in events] == [(b">0111010387\r", True), (b"4A00\r", False)]


def test_a_damaged_answer_is_kept():
    events = wire(b">0111010387\r", b"A00429\xb10000F0\r")
    assert [(e.octets, e.damage) for e in events[1:]] == [(b"A00429\xb10000F0\r", Damage.FORM)]


def test_joining_in_the_middle_makes_no_answer():
    # the tail of `>0109CA` is `A` CR, an acknowledgement to the letter
    events = wire(b"A\r", b">0109CA\r", b"A\r")
    assert [type(e) for e in events] == [Noise, Frame, Frame]


def test_line_feeds_are_filler():
    events = wire(b">0104C5\r\n", b"A\r\n")
    assert octets_of(events) == [b">0104C5\r", b"\n", b"A\r", b"\n"]
    assert {(e.place, e.reason) for e in events if isinstance(e, Noise)} == {(Place.AFTER, Reason.PAD)}


def test_noise_has_a_place():
    events = wire(b">0104C5\r\0\0", b"\xff\xff\xff", b"\xfe>0104C5\r")
    assert [(e.octets, e.place, e.reason) for e in events if isinstance(e, Noise)] == [
        (b"\0\0", Place.AFTER, Reason.ZEROS),
        (b"\xff\xff\xff", Place.BETWEEN, Reason.NO_DELIMITER),
        (b"\xfe", Place.BEFORE, Reason.NO_DELIMITER),
    ]


# --- reading ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("octets", "expected"),
    [
        (b">01FA7\r", "1 ← identify"),
        (b">0104C5\r", "1 ← poll"),
        (b">0105C6\r", "1 ← poll, acknowledging the last report"),
        (b">0108C9\r", "1 ← warm reset"),
        (b">0109CA\r", "1 ← status update"),
        (b">0111010387\r", "1 ← read AI 1 attribute 3 (current value)"),
        (b">FE130103B3\r", "254 ← read AO 1 attribute 3 (current value)"),
        (b">01210A0840A0000032\r", "1 ← write AI 10 attribute 8 (low alarm limit, elsewhere differential) = 5"),
        (b">01240103003C61\r", "1 ← write BO 1 attribute 3 (minimum on-time) = 60"),
        (b">012602FFF633\r", "1 ← write ADI 2 = -10"),
        (b">01250241AC0000D3\r", "1 ← write ADF 2 = 21.5"),
        (b">0127027FA9\r", "1 ← write BD 2 = 127"),
        (b">017203014248000020\r", "1 ← override AO 1 = 50"),
        (b">0172040101F0\r", "1 ← override BO 1 = 1"),
        (b">017303018F\r", "1 ← release AO 1"),
        (b">11Z66L015842\r", "17 ← N2-like, unknown command (Optomux family?) Z: 66L0158"),
        (b">0135XY\r", "1 ← JCI-native or other command 3: 5 [characters that N2 does not allow: XY, C9 expected]"),
        (b"A\r", "A"),
        (b"A0042910000F0\r", "A → 0042910000"),
        (b"N00\r", "N00 has reset, waits for identify"),
        (b"N0A\r", "N0A value out of range"),
        (b"N77\r", "N77"),
        (b">0111010388\r", "1 ← read AI 1 attribute 3 (current value) [bad checksum: 88, 87 expected]"),
        (b">\x1b[2J\r", "? ← no command [too short]"),
    ],
)
def test_one_line(octets, expected):
    assert line(octets) == expected


def test_optomux_is_shown_not_called_an_error(noted_frames):
    optomux = [o for o in noted_frames if o[3:4] in (b"Z", b"S")]
    assert len(optomux) == 2
    for octets in optomux:
        header = peek(frame_of(octets))
        assert header.ok
        assert header.error is None
        assert header.kind == "unknown-command"


def test_what_the_header_says():
    header = peek(frame_of(b">FE130203B4\r"))
    assert (header.destination, header.role, header.kind) == (254, Role.REQUEST, "read-attribute")
    assert (header.function, header.address) == (0x10, 0x0302)
    assert peek(frame_of(b">0172040101F0\r")).function == 0x72
    assert peek(frame_of(b">0127027FA9\r")).kind == "write-value"
    assert peek(frame_of(b">0004C4\r")).role is Role.BROADCAST
    refusal = peek(frame_of(b"N11\r"))
    assert (refusal.ok, refusal.error, refusal.kind) == (
        True,
        "N11 undefined or reserved field",
        "negative-acknowledge",
    )
    assert not peek(frame_of(b"A4065\r")).ok


def test_fields_are_named():
    assert fields(frame_of(b">01210A0840A0000032\r"), Role.REQUEST) == {
        "n2.address": 1,
        "n2.command": "2",
        "n2.region": 1,
        "n2.region.name": "AI",
        "n2.object": 10,
        "n2.attribute": 8,
        "n2.attribute.name": "low alarm limit, elsewhere differential",
        "n2.data": "40A00000",
        "n2.value": 5.0,
        "n2.checksum": "32",
        "n2.checksum.status": 1,
    }
    assert fields(frame_of(b"N11\r"), Role.RESPONSE) == {
        "n2.acknowledge": "N",
        "n2.error": "11",
        "n2.error.name": "undefined or reserved field",
        "n2.checksum.status": 3,
    }


def test_an_answer_with_its_command(digimat_frames):
    pairs = list(zip(digimat_frames[::2], digimat_frames[1::2], strict=True))
    read = [interpret(frame_of(q), frame_of(a)) for q, a in pairs]
    assert [r.value for r in read] == [72.5, 72.5, 72.5, 72.5, -12.25, 0, 64, 192, 7, 21.0, 21.0, 55.5, 1, None, None]
    assert [r.station for r in read[:4]] == [1, 16, 99, 255]
    assert read[0].text == "A → 72.5 (0042910000: status 00h in front, no bit set, tentative)"
    assert read[-1].error == "N11 undefined or reserved field"
    assert [r.written for r in read] == [False] * 9 + [True] * 4 + [False] * 2


def test_an_answer_without_the_octet_in_front_is_plain():
    read = interpret(frame_of(b">0111010387\r"), frame_of(b"A4291000090\r"))
    assert (read.value, read.tentative, read.text) == (72.5, (), "A → 72.5")


def test_guesses_are_marked_and_stand_beside_the_characters():
    state = interpret(frame_of(b">01120A0297\r"), frame_of(b"A4064\r"))
    assert state.value == 0x40
    assert state.tentative == ("state on",)
    assert "40" in state.text
    assert "tentative" in state.text
    changes = interpret(frame_of(b">0104C5\r"), frame_of(b"A301004248000086\r"))
    assert changes.value is None
    assert changes.text == "A → (3010042480000: AO 1 = 50; no other status bit set, tentative)"
    time = b"010020260301153000"
    expected = "1 ← synchronise time 20260301153000 (2026-03-01 15:30:00?, tentative)"
    assert line(b">%s%02X\r" % (time, sum(time) & 0xFF)) == expected


@pytest.mark.parametrize(
    ("request_", "answer", "said", "told"),
    [
        (b">01120A0297\r", b"A4064\r", "1 → BI 10 on (status 40h, tentative) — A 40", [(1, "on", "40h")]),
        (b">01120A0297\r", b"A0161\r", "1 → BI 10 off (status 01h, tentative) — A 01", [(0, "off", "01h")]),
        (
            b">0104C5\r",
            b"A1018041A0000020340%02X\r" % (sum(b"1018041A0000020340") & 0xFF),
            "1 → AI 1 = 20 status 80h; BI 3 on; no other status bit set (tentative) — A 1018041A0000020340",
            [(20.0, "", "80h"), (1, "on", "40h")],
        ),
    ],
)
def test_every_point_says_its_state_and_status(request_, answer, said, told):
    asked, got = frame_of(request_), frame_of(answer)
    meaning = Meaning(1, None, readings(asked, got), "", asked)
    assert meant(got, peek(got), Role.RESPONSE, meaning) == said
    assert [(one.value, one.words, one.beside[0][0][7:]) for one in readings(asked, got)] == told
    for one, span in zip(readings(asked, got), N2.spans(got, readings(asked, got)), strict=True):
        assert span is not None
        assert one.beside[0][0][7:9].encode() in got.octets[slice(*span)]


def test_change_records_need_one_reading_that_uses_up_all():
    records, _ = change_records("3010042480000")
    assert [(r.region, r.object, r.status, r.value) for r in records] == [(3, 1, 0, 50.0)]
    assert change_records("99")[0] == ()
    assert change_records("zz") == ((), ())


def test_a_guessed_time_is_a_date_that_exists():
    assert guessed_time("20260301153000") == "2026-03-01 15:30:00"
    assert guessed_time("260301153000") == "2026-03-01 15:30:00"
    assert guessed_time("20260231153000") == ""
    assert guessed_time("2026030115") == ""
    assert guessed_time("٢٠٢٦٠٣٠١١٥٣٠٠٠") == ""


# --- packets ----------------------------------------------------------------------------------------------------------


def test_packets_give_their_octets_back(noted_frames, digimat_frames):
    for octets in noted_frames + digimat_frames:
        made = packet(frame_of(octets), Role.EITHER)
        made.clear_cache()
        assert bytes(made) == octets
        assert not made.haslayer("Raw")


def test_packet_and_peek_agree(noted_frames, digimat_frames):
    for octets in noted_frames + digimat_frames:
        if octets[:1] != b">":
            continue
        frame = frame_of(octets)
        header, made = peek(frame), packet(frame, Role.REQUEST)
        assert made.address == header.destination
        if header.address is not None:
            assert (made.region << 8 | made.object) == header.address
        assert int(made.checksum) == int(octets[-3:-1], 16)


def test_packets_craft_frames(noted_frames):
    from dissectors.n2 import packets as p

    crafted = [
        p.N2Command(address=1),
        p.N2SubCommand(address=1, command=b"04"),
        p.N2Read(address=1, region=1, object=10, attribute=3),
        p.N2Write(address=1, region=1, object=10, attribute=1, value=0x0D),
        p.N2Write(address=1, region=1, object=10, attribute=8, value=5.0),
        p.N2Write(address=1, region=4, object=1, attribute=3, value=60),
        p.N2Write(address=1, region=6, object=2, value=-10),
        p.N2Write(address=1, region=5, object=2, value=21.5),
        p.N2Override(address=1, region=3, object=1, value=50.0),
        p.N2Override(address=1, region=4, object=1, value=1),
        p.N2Release(address=1, region=3, object=1),
        p.N2Answer(data=b"0042480000"),
        p.N2Acknowledge(),
        p.N2Refusal(error=b"11"),
    ]
    for made in crafted:
        assert bytes(made) in noted_frames, made
    assert bytes(p.N2Read(address=1, region=1, object=10, attribute=3, checksum=0)) == b">01110A0300\r"


def test_importing_the_protocol_loads_no_scapy():
    import subprocess
    import sys

    code = "import sys, dissectors.n2; sys.exit('scapy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
    assert N2.default_line == "9600,8N1"
