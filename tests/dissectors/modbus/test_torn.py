"""Damage of frames that a late read tore is nobody's."""

from __future__ import annotations

from random import Random

import pytest

from dissectors.findings import Severity
from dissectors.frame import Check, Chunk, Damage, FoundBy, Frame, Noise, Place, Reason
from dissectors.line import LineSettings
from dissectors.modbus.envelope import ASCII_NAME, RTU_NAME, seal_ascii, seal_rtu
from dissectors.modbus.torn import TornFrames
from sniff.engine.session import Adapter, Session
from tests.faults.judged import findings_of

RTU = seal_rtu(bytes.fromhex("01 03 04 00 01 00 02"))
ASCII = seal_ascii(bytes.fromhex("01 03 04 00 01 00 02"))


def _damaged(octets: bytes, protocol: str = RTU_NAME) -> Frame:
    return Frame(protocol, octets, 0, 1_000_000, Check.BAD, FoundBy.GAP, Damage.CHECK)


def _noise(octets: bytes) -> Noise:
    return Noise(octets, 0, 1_000_000, Place.BEFORE, Reason.NO_FRAME)


@pytest.mark.parametrize(("whole", "protocol"), [(RTU, RTU_NAME), (ASCII, ASCII_NAME)])
@pytest.mark.parametrize("at", range(1, 8))
def test_pieces_that_make_a_good_frame_are_torn(whole: bytes, protocol: str, at: int) -> None:
    torn = TornFrames()
    torn.see(1, _damaged(whole[:at], protocol), 5, is_good_frame=False)
    assert not torn.is_torn(5)
    torn.see(2, _noise(whole[at:]), 5, is_good_frame=False)
    assert torn.is_torn(5)
    assert torn.may_answer(3)
    assert not torn.may_answer(4)


def test_other_damage_is_not() -> None:
    torn = TornFrames()
    torn.see(1, _damaged(RTU[:4]), 5, is_good_frame=False)
    torn.see(2, _noise(RTU[4:-1] + b"\x00"), 5, is_good_frame=False)
    assert not torn.is_torn(5)


def test_a_good_frame_between_parts_them() -> None:
    torn = TornFrames()
    torn.see(1, _damaged(RTU[:4]), 5, is_good_frame=False)
    torn.see(2, _damaged(RTU), 6, is_good_frame=True)
    torn.see(3, _noise(RTU[4:]), 6, is_good_frame=False)
    assert not torn.is_torn(5)


def test_characters_with_a_parity_bit_and_rubbish_raise_nothing() -> None:
    torn = TornFrames()
    torn.see(1, _damaged(ASCII[:5], ASCII_NAME), 5, is_good_frame=False)
    torn.see(2, _noise(bytes(octet | 0x80 for octet in ASCII[5:-2]) + b"\r\n"), 5, is_good_frame=False)
    assert torn.is_torn(5)
    for no in range(3, 40):
        torn.see(no, _noise(bytes((no * 37 % 256,)) * no), None, is_good_frame=False)


def test_what_late_reads_often_tear_is_no_stations_damage() -> None:
    """Two stations whose long answers take a third of the time: of each, one answer in nine is read in two parts."""
    now, chunks, dice = 0, [], Random(1)
    for turn in range(180):
        unit = 1 + turn % 2
        now += 90_000_000
        chunks.append(Chunk(now, seal_rtu(bytes((unit, 3, 0, 0, 0, 60)))))
        answer = seal_rtu(bytes((unit, 3, 120)) + bytes(range(120)))
        cut = dice.randrange(20, 100) if dice.random() < 0.12 else 0
        now += 50_000_000
        if cut:
            chunks.append(Chunk(now, answer[:cut]))
            now += 80_000_000
        chunks.append(Chunk(now, answer[cut:]))
    session = Session("x", LineSettings.parse("38400,8N1"), "modbus-rtu", adapter=Adapter("a", "", 16_000_000, "said"))
    graves = {(one.code, one.subject) for one in findings_of(session, chunks) if one.severity >= Severity.WARNING}
    assert not graves
