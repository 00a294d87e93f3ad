"""Junk, lost ends and spoilt begins: what a stretch of octets is taken for, and what a damaged frame was."""

from __future__ import annotations

import pytest

from dissectors.frame import Chunk, Damage, Event, Flaw, FoundBy, Frame, Noise, Repair
from dissectors.line import Timing
from dissectors.n2 import N2Framer, fields, interpret, peek, text
from dissectors.n2.stretch import STRAY
from dissectors.tracker import Role

MS = 1_000_000
READ, READ_STATUS, POLL, WRITE = b">0111010387\r", b">01120A0297\r", b">0104C5\r", b">012602FFF633\r"
VALUE, STATUS, ACK, REFUSAL, REPORT = b"A0042910000F0\r", b"A4064\r", b"A\r", b"N11\r", b"A301004248000086\r"
EXCHANGES = [(READ, VALUE), (READ_STATUS, STATUS), (POLL, ACK), (POLL, REPORT), (WRITE, ACK), (READ, REFUSAL)]


def wire(*parts: bytes, pause: int = 20 * MS, latency: int = 0) -> list[Event]:
    """Events of octets with a pause before each part."""
    timing = Timing(latency=latency)
    framer, events, now = N2Framer(timing), [], 10**18
    for part in parts:
        now += pause + len(part) * timing.char
        events += framer.feed(Chunk(now, part))
    return events + framer.close()


def good(events: list[Event]) -> list[bytes]:
    return [event.octets for event in events if isinstance(event, Frame) and event.ok]


def repairs(events: list[Event]) -> list[Repair | None]:
    return [event.repair for event in events if isinstance(event, Frame) and not event.ok]


# --- junk -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("latency", [0, 17 * MS])
@pytest.mark.parametrize(("command", "answer"), EXCHANGES)
def test_junk_directly_before_an_answer_costs_nothing(command, answer, latency):
    for junk in (b"x", b":", b"4", b"\xff", b"A", b">", b"N", b"9A", b"> ", b"xyz", b">>>", b"\x00A1"):
        events = wire(POLL, ACK, command, junk + answer, latency=latency)
        assert good(events) == [POLL, ACK, command, answer], junk


@pytest.mark.parametrize("latency", [0, 17 * MS])
@pytest.mark.parametrize(("command", "answer"), EXCHANGES)
def test_junk_between_command_and_answer_costs_nothing(command, answer, latency):
    for junk in (b"7", b"A", b">", b":", b"\r", b"A\xff"):
        events = wire(POLL, ACK, command, junk, answer, latency=latency)
        assert good(events) == [POLL, ACK, command, answer], junk


def test_junk_before_a_command_costs_nothing():
    for junk in (b"x", b">", b">0", b"A", b"A0042", b"\xfe\xfe\xfe"):
        assert good(wire(POLL, ACK, junk + READ, VALUE)) == [POLL, ACK, READ, VALUE], junk


def test_more_than_stray_text_is_no_junk_before_an_acknowledgement():
    # the begin of a report was lost, and its checksum ends in A
    events = wire(POLL, ACK, POLL, b"04291" + ACK)
    assert STRAY < 5
    assert good(events) == [POLL, ACK, POLL]


def test_octets_without_text_between_command_and_answer_are_told_apart():
    events = wire(READ, b"\xf3\x81\x8c\x00\xe6\x91" + VALUE)
    assert [type(event) for event in events] == [Frame, Noise, Frame]
    assert good(events) == [READ, VALUE]


# --- damage that looks like a begin -----------------------------------------------------------------------------------


def test_a_start_character_inside_an_answer_is_one_damaged_answer():
    report = b"A1010044>AC0001020043E600006E\r"  # a flipped bit made it of a 6
    (frame,) = [event for event in wire(READ, VALUE, POLL, report) if isinstance(event, Frame) and not event.ok]
    assert frame.octets == report


def test_a_start_character_inside_a_command_is_one_damaged_command():
    events = wire(READ, VALUE, b">01>1010387\r", READ)
    assert [event.octets for event in events if isinstance(event, Frame)] == [READ, VALUE, b">01>1010387\r", READ]


def test_a_command_in_the_middle_of_a_command_is_found():
    events = wire(b">0111" + READ)
    assert [(event.octets, event.damage) for event in events] == [(b">0111", Damage.RESTARTED), (READ, None)]


@pytest.mark.parametrize("end", [b"", b"\x8d", b"M", b"-"])
def test_an_answer_behind_a_command_that_lost_its_end_is_found(end):
    events = wire(POLL, ACK, READ[:-1] + end + VALUE, latency=17 * MS)
    assert [event.octets for event in events] == [POLL, ACK, READ[:-1] + end, VALUE]
    assert events[-1].found is FoundBy.SPLIT
    flaw = Flaw.LAST_SPOILT if end else Flaw.LAST_MISSING
    assert repairs(events) == [Repair(flaw, READ)]


def test_an_answer_behind_a_truncated_command_is_found():
    assert good(wire(POLL, ACK, b">01110" + VALUE, latency=17 * MS))[-1] == VALUE


# --- repairs ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("command", "octets", "flaw", "whole"),
    [
        (READ, VALUE[1:], Flaw.FIRST_MISSING, VALUE),
        (READ, b"\xa1" + VALUE[1:], Flaw.FIRST_SPOILT, VALUE),
        (READ, b"I" + VALUE[1:], Flaw.FIRST_SPOILT, VALUE),
        (READ, VALUE[:-1], Flaw.LAST_MISSING, VALUE),
        (READ, VALUE[:-1] + b"\x1d", Flaw.LAST_SPOILT, VALUE),
        (READ, VALUE[:-2], Flaw.LAST_TWO_MISSING, VALUE),
        (READ, b"A00429100000F\r", Flaw.CHECK_SWAPPED, VALUE),
        (READ_STATUS, b"4064\r", Flaw.FIRST_MISSING, STATUS),
        (POLL, b"A", Flaw.LAST_MISSING, ACK),
        (POLL, REPORT[1:], Flaw.FIRST_MISSING, REPORT),
        (POLL, REPORT[:-1], Flaw.LAST_MISSING, REPORT),
        (READ, b"N11", Flaw.LAST_MISSING, REFUSAL),
    ],
)
def test_what_a_damaged_answer_was(command, octets, flaw, whole):
    events = wire(POLL, ACK, command, octets)
    assert repairs(events) == [Repair(flaw, whole)]
    assert b"".join(event.octets for event in events) == POLL + ACK + command + octets


@pytest.mark.parametrize(
    ("octets", "flaw"),
    [
        (READ[1:], Flaw.FIRST_MISSING),
        (b"\xbe" + READ[1:], Flaw.FIRST_SPOILT),
        (b"?" + READ[1:], Flaw.FIRST_SPOILT),
        (READ[:-1], Flaw.LAST_MISSING),
        (READ[:-1] + b"\x0c", Flaw.LAST_SPOILT),
        (b">0111010378\r", Flaw.CHECK_SWAPPED),
    ],
)
def test_what_a_damaged_command_was(octets, flaw):
    assert repairs(wire(POLL, ACK, octets)) == [Repair(flaw, READ)]


def test_no_repair_where_the_form_is_not_what_was_asked_for():
    for octets in (VALUE[1:], VALUE[:-1], b"A00429100000F\r"):
        assert repairs(wire(POLL, ACK, WRITE, octets)) in ([None], [])


def test_nothing_is_repaired_before_the_bus_is_known_to_speak_n2():
    assert repairs(wire(READ[1:], VALUE[1:])) == []


def test_a_repaired_frame_shows_what_it_was_and_stays_damaged():
    events = wire(READ, VALUE[1:], READ[1:])
    request, response, again = events
    assert not response.ok
    assert text(response, peek(response), Role.RESPONSE) == "A → 0042910000 [first octet missing; repaired]"
    assert text(again, peek(again), Role.REQUEST).startswith("1 ← read AI 1 attribute 3 (current value) [first octet")
    assert peek(again).destination == 1
    assert fields(response, Role.RESPONSE)["n2.data"] == "0042910000"
    told = interpret(request, response)
    assert told.value == 72.5
    assert "first octet missing, repaired" in told.tentative


# --- echoes that are cut short ----------------------------------------------------------------------------------------

IDENTIFY, TYPE = b">01FA7\r", b"A1061\r"


@pytest.mark.parametrize("latency", [0, 17 * MS])
@pytest.mark.parametrize("short", [1, 2])
@pytest.mark.parametrize(("command", "answer"), [*EXCHANGES, (IDENTIFY, TYPE)])
def test_behind_an_echo_without_its_end_the_answer_is_good(command, answer, short, latency):
    events = wire(POLL, ACK, command, command[:-short] + answer, latency=latency)
    assert good(events) == [POLL, ACK, command, answer]
    assert events[-1].octets == answer


def test_the_echo_of_a_short_command_is_put_right():
    events = wire(POLL, ACK, IDENTIFY, IDENTIFY[:-2], TYPE)
    assert repairs(events) == [Repair(Flaw.LAST_TWO_MISSING, IDENTIFY)]


def test_an_echo_that_an_acknowledgement_makes_whole_is_whole_unless_the_one_before_was_cut():
    command = next(one for one in (b">%02X04" % at for at in range(256)) if sum(one[1:]) & 0xF == 10)
    command += b"%02X\r" % (sum(command[1:]) & 0xFF)
    assert good(wire(POLL, POLL, ACK, command, command)) == [POLL, POLL, ACK, command, command]
    cut = wire(POLL, POLL[:-2], ACK, command, command[:-2] + ACK, pause=MS)
    assert good(cut) == [POLL, ACK, command, ACK]
