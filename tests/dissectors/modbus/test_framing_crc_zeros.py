"""Frames whose CRC has octets that are 00: none is misread, whatever its function, its bus and the adapter.

A part of what tests/bench/crc_zero_sweep.py tries.
"""

from __future__ import annotations

import random

import pytest

from dissectors.frame import Frame
from dissectors.line import LineSettings, Timing
from dissectors.modbus.framing import RtuFramer
from sniff.testing.driving import drive
from tests.bus_delivery import FTDI_LATENCY, MS, exact, ftdi
from tests.dissectors.modbus.crc_zeros import (
    ADAPTERS,
    CODES,
    PACES,
    VENDOR_CODES,
    exchanges_with_zeros,
    misread,
    sealed,
    zeros_of,
)

LINES = ("9600,8N1", "115200,8N1")
POLL = sealed(bytes.fromhex("28 03 0000 0001")), sealed(bytes.fromhex("28 03 02 1234"))
"""What teaches the tracker how fast station 40 answers."""

DOUBTFUL = next(
    answer
    for answer in (sealed(bytes((unit, 3, 2, 0x2A, 0))) for unit in range(1, 248))
    if 1 <= answer[5] <= 125 and sealed(answer[:6]) == answer + b"\0"
)
"""An answer of one register that with a zero behind it reads as a request at 02xxh."""


@pytest.mark.parametrize("code", [*CODES, *VENDOR_CODES], ids="{:02X}".format)
@pytest.mark.parametrize("adapter", ADAPTERS)
def test_an_exchange_by_itself(code: int, adapter: str) -> None:
    dice = random.Random(code)
    sent = list(exchanges_with_zeros(code, dice, 24))
    assert len(sent) == 24
    for number, one in enumerate(sent):
        line, pace = LINES[number % 2], list(PACES.values())[number % 3]
        assert not misread([one], line, pace, adapter)


@pytest.mark.parametrize("line", LINES)
@pytest.mark.parametrize("pace", PACES)
@pytest.mark.parametrize("adapter", ADAPTERS)
def test_exchanges_in_traffic(line: str, pace: str, adapter: str) -> None:
    dice = random.Random(f"{line} {pace}")
    sent = []
    for code in (*CODES, *VENDOR_CODES):
        for asked, answered in exchanges_with_zeros(code, dice, 6):
            sent += [(asked, answered), POLL]
    wrong = misread(sent, line, PACES[pace], adapter)
    assert not [each for each in wrong if "read as" in each]


@pytest.mark.parametrize("adapter", ADAPTERS)
@pytest.mark.parametrize("pace", PACES)
def test_a_counter_of_32_bits(pace: str, adapter: str) -> None:
    asked = sealed(bytes.fromhex("09 03 0184 0002"))
    values = [n for n in range(256, 32256) if not sealed(b"\x09\x03\x04" + n.to_bytes(4, "big"))[-1]]
    assert len(values) > 100
    sent = [(asked, sealed(b"\x09\x03\x04" + n.to_bytes(4, "big"))) for n in values]
    assert not misread(sent, "19200,8E1", PACES[pace], adapter)


@pytest.mark.parametrize("adapter", ADAPTERS)
@pytest.mark.parametrize("pace", PACES)
def test_a_value_that_never_changes(pace: str, adapter: str) -> None:
    number = next(n for n in range(256, 32256) if not sealed(b"\x09\x03\x04" + n.to_bytes(4, "big"))[-1])
    answered = sealed(b"\x09\x03\x04" + number.to_bytes(4, "big"))
    sent = [(sealed(bytes.fromhex("09 03 0184 0002")), answered)] * 100
    assert not misread(sent, "19200,8E1", PACES[pace], adapter)


@pytest.mark.parametrize("adapter", ADAPTERS)
@pytest.mark.parametrize("code", [3, 4])
def test_a_request_that_ends_with_a_zero_and_that_nobody_answers(code: int, adapter: str) -> None:
    """At 02xx its first octets look like the answer to a request for one register, which is what was asked before."""
    bodies = [bytes((7, code, 2, at, 0, count)) for at in range(256) for count in (1, 2, 4, 17)]
    asked = [frame for frame in map(sealed, bodies) if zeros_of(frame) in ("high", "both")]
    sent = [(frame, b"") for frame in asked for _ in range(3)]
    assert sent
    assert not misread(sent, "9600,8N1", PACES["usual"], adapter)
    one_register = sealed(bytes((7, code, 0, 0, 0, 1)))
    sent = [(frame, b"") for each in asked for frame in (one_register, each)]
    assert not misread(sent, "9600,8N1", PACES["usual"], adapter)


def test_the_first_octets_of_an_answer_look_like_a_request() -> None:
    asked = sealed(bytes.fromhex("01 04 0000 0003"))
    inner = sealed(bytes.fromhex("01 04 06 00 00 05"))
    answered = sealed(inner + b"\x77")
    assert len(answered) == 11
    for adapter in ADAPTERS:
        for pace in PACES.values():
            assert not misread([(asked, answered)] * 20, "19200,8E1", pace, adapter)


def test_a_bus_on_which_zeros_follow_frames_reads_the_shorter_frame() -> None:
    """A driver that lets go late puts a zero behind each answer. Where it makes a request of one, the habit decides."""
    timing = Timing(LineSettings.parse("9600"))
    asked = sealed(bytes((DOUBTFUL[0], 3, 0, 0, 0, 1)))
    plain, doubtful = sealed(bytes((DOUBTFUL[0], 3, 2, 0x12, 0x34))), DOUBTFUL
    now, wire, sent = 1000 * MS, [], []
    for answered in [*[plain] * 20, doubtful, plain]:
        for octets in (asked, answered + b"\0"):
            now += 30 * MS
            for octet in octets:
                now += timing.char
                wire.append((now, octet))
        sent += [asked, answered]
    events = drive(RtuFramer(timing), exact(wire))
    assert [e.octets for e in events if isinstance(e, Frame)] == sent


def test_a_zero_behind_an_awaited_answer_without_proved_silence_makes_no_request_of_it() -> None:
    timing = Timing(LineSettings.parse("9600"), FTDI_LATENCY)
    asked, answered = sealed(bytes((DOUBTFUL[0], 3, 0, 0, 0, 1))), DOUBTFUL
    now, wire = 1000 * MS, []
    for octets in (asked, answered + b"\0", asked, sealed(bytes((DOUBTFUL[0], 3, 2, 0x12, 0x34)))):
        now += 6 * MS
        for octet in octets:
            now += timing.char
            wire.append((now, octet))
    frames = [e.octets for e in drive(RtuFramer(timing), ftdi(wire)) if isinstance(e, Frame)]
    assert frames[:2] == [asked, answered]


def test_a_vendor_frame_whose_begin_checks_too_is_read_whole_when_the_next_frame_has_come() -> None:
    """Eleven of its seventeen octets have a good CRC by chance, and the frame behind it comes in two reads."""
    asked, answered = "0942fa02ce5c9b4dda0000", "0942828ae0c632af5778b4dd340332fa87"
    before = ("1e42feeba637", "1e424845d47ec065af2ad29cb3daf270bae319a686a1f200")
    poll = ("0903000000018542", "090302123454f2")
    sent = [(bytes.fromhex(one), bytes.fromhex(other)) for one, other in (before, poll, poll, (asked, answered), poll)]
    for adapter in ADAPTERS:
        assert misread(sent, "115200,8N1", PACES["brisk"], adapter) == []
