"""Damage of frames that a late read tore is nobody's; what is torn often is."""

from __future__ import annotations

import pytest

from dissectors.frame import Check, Damage, FoundBy, Frame, Noise, Place, Reason
from dissectors.modbus.envelope import ASCII_NAME, RTU_NAME, seal_ascii, seal_rtu
from dissectors.modbus.torn import FREE, SELDOM, TornFrames

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


def test_a_station_whose_frames_are_often_torn_pauses_itself() -> None:
    torn = TornFrames()
    assert all(torn.is_seldom(3, 10) for _ in range(FREE))
    assert not torn.is_seldom(3, 10)
    assert torn.is_seldom(3, 5 * SELDOM)
    assert torn.is_seldom(4, 10)
