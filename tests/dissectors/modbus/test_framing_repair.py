"""Damage at one end of a frame that is always the same: the framer says what the frame was, only where it is proved."""

from __future__ import annotations

import random

import pytest

from dissectors.frame import Check, Damage, Event, Flaw, Frame
from dissectors.line import LineSettings, Timing
from dissectors.modbus.framing import RtuFramer
from sniff.testing.driving import drive
from tests.bus_delivery import FTDI_LATENCY, MS, exact, ftdi
from tests.dissectors.modbus.crc_zeros import sealed

LINE = LineSettings.parse("9600")
ASKED = sealed(bytes.fromhex("05 03 0102 0002"))
ANSWERED = sealed(bytes.fromhex("05 03 04 1234 5678"))
WRITTEN = sealed(bytes.fromhex("05 06 0102 1770"))
ADAPTERS = {"exact": 0, "16 ms": FTDI_LATENCY}

SPOIL = {
    Flaw.CHECK_SWAPPED: lambda o: o[:-2] + o[:-3:-1],
    Flaw.FIRST_MISSING: lambda o: o[1:],
    Flaw.FIRST_SPOILT: lambda o: bytes((o[0] ^ 0xA8,)) + o[1:],
    Flaw.LAST_MISSING: lambda o: o[:-1],
    Flaw.LAST_TWO_MISSING: lambda o: o[:-2],
    Flaw.LAST_SPOILT: lambda o: o[:-1] + bytes((o[-1] ^ 0x5C,)),
}


def read(frames: list[bytes], adapter: str = "exact", gap: float = 12) -> list[Event]:
    timing = Timing(LINE, ADAPTERS[adapter])
    now, wire = 1000 * MS, []
    for octets in frames:
        now += int(gap * MS)
        for octet in octets:
            now += timing.char
            wire.append((now, octet))
    return drive(RtuFramer(timing), exact(wire) if adapter == "exact" else ftdi(wire))


def frames(events: list[Event]) -> list[Frame]:
    assert all(isinstance(e, Frame) for e in events), events
    return [e for e in events if isinstance(e, Frame)]


@pytest.mark.parametrize("adapter", ADAPTERS)
@pytest.mark.parametrize("exchange", [(ASKED, ANSWERED), (WRITTEN, WRITTEN)], ids=["read", "write"])
@pytest.mark.parametrize("flaw", SPOIL, ids=lambda flaw: flaw.name)
def test_answers_with_one_flaw(flaw: Flaw, exchange: tuple[bytes, bytes], adapter: str) -> None:
    asked, answered = exchange
    spoilt = SPOIL[flaw](answered)
    found = frames(read([asked, spoilt] * 8, adapter))
    assert [e.octets for e in found] == [asked, spoilt] * 8
    for number, event in enumerate(found):
        if not number % 2:
            assert event.ok
            continue
        assert not event.ok
        assert event.damage is (Damage.SHORT if len(spoilt) < len(answered) else Damage.CHECK)
        assert event.expected == len(answered)
        if number > 1 or flaw not in (Flaw.LAST_SPOILT, Flaw.LAST_TWO_MISSING):  # those are told by repetition
            assert event.repair is not None
            assert (event.repair.flaw, event.repair.octets) == (flaw, answered)


@pytest.mark.parametrize("flaw", SPOIL, ids=lambda flaw: flaw.name)
def test_a_request_that_was_made_before(flaw: Flaw) -> None:
    spoilt = SPOIL[flaw](ASKED)
    found = frames(read([ASKED, ANSWERED, spoilt, ANSWERED, ASKED, ANSWERED], gap=40))
    assert [e.octets for e in found][2] == spoilt
    assert found[2].repair is not None
    assert (found[2].repair.flaw, found[2].repair.octets) == (flaw, ASKED)
    assert all(e.ok for e in found[3:])


def test_an_adapter_that_loses_the_first_octet_of_everything() -> None:
    found = frames(read([ASKED[1:], ANSWERED[1:]] * 4))
    assert [e.repair.octets if e.repair else None for e in found] == [ASKED, ANSWERED] * 4


def test_a_master_that_swaps_the_check_of_everything() -> None:
    swapped = SPOIL[Flaw.CHECK_SWAPPED](ASKED)
    found = frames(read([swapped] * 4, gap=300))
    assert [e.repair.octets if e.repair else None for e in found] == [ASKED] * 4


def test_good_frames_have_no_repair() -> None:
    assert all(e.ok and e.repair is None for e in frames(read([ASKED, ANSWERED] * 4)))


def test_random_damage_is_hardly_ever_repaired_wrongly() -> None:
    """Bits flipped, octets lost, anywhere: what is told is what was sent."""
    dice = random.Random(485)
    timing = Timing(LINE)
    now, wire, hurt = 1000 * MS, [], {}
    for number in range(3000):
        answered = bytearray(sealed(b"\x05\x03\x10" + dice.randbytes(16)))
        sent = bytes(answered)
        if number % 2:
            at = dice.randrange(3, len(answered) - 2)
            if number % 4 == 1:
                answered[at] ^= dice.randrange(1, 256)
            else:
                del answered[at : at + dice.choice([1, 2])]
            hurt[bytes(answered)] = sent
        for octets in (sealed(bytes.fromhex("05 03 0102 0008")), bytes(answered)):
            now += 20 * MS
            for octet in octets:
                now += timing.char
                wire.append((now, octet))
    repaired = [e for e in drive(RtuFramer(timing), exact(wire)) if isinstance(e, Frame) and e.repair is not None]
    assert sum(hurt[e.octets] != e.repair.octets for e in repaired if e.repair) <= 6


def test_where_everybody_swaps_the_check_writes_are_put_right_as_well() -> None:
    """A write has the shape of its answer, and its values say nothing: the check does."""
    writes = [SPOIL[Flaw.CHECK_SWAPPED](sealed(bytes((1, 6, 0, 3, 0, value)))) for value in range(4)]
    found = frames(read(writes, gap=300))
    assert [frame.repair.flaw for frame in found if frame.repair] == [Flaw.CHECK_SWAPPED] * 4


# --- echoes -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("adapter", ADAPTERS)
@pytest.mark.parametrize("count", [4, 5, 6, 7])
def test_an_echo_cut_short_is_the_begin_of_a_request(count: int, adapter: str) -> None:
    """Seven octets are as many as the answer to a request for one register would have."""
    asked = sealed(bytes.fromhex("05 03 0102 0001"))
    found = frames(read([asked, asked[:count]] * 3, adapter, gap=60))
    assert [e.octets for e in found] == [asked, asked[:count]] * 3
    for echo in found[1::2]:
        assert (echo.damage, echo.check, echo.expected, echo.repair) == (Damage.SHORT, Check.ABSENT, 8, None)


@pytest.mark.parametrize("adapter", ADAPTERS)
@pytest.mark.parametrize("gap", [0, 4.5])
@pytest.mark.parametrize("count", [3, 5, 7, 8])
def test_a_request_copied_back_before_its_answer(count: int, gap: float, adapter: str) -> None:
    sent = [ASKED, ASKED[:count], ANSWERED] * 3
    timing = Timing(LINE, ADAPTERS[adapter])
    now, wire = 1000 * MS, []
    for number, octets in enumerate(sent):
        now += int((40 if number % 3 == 0 else gap) * MS)
        for octet in octets:
            now += timing.char
            wire.append((now, octet))
    found = frames(drive(RtuFramer(timing), exact(wire) if adapter == "exact" else ftdi(wire)))
    assert [e.octets for e in found] == sent
    assert [e.ok for e in found] == [True, count == 8, True] * 3
    assert all(e.expected == 8 for e in found[1::3])
