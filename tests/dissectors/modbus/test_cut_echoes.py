"""Echoes cut short, also where an adapter that nobody named hands their octets over in pieces: nobody's damage."""

from __future__ import annotations

import pytest

from dissectors.frame import Noise, Place, Reason
from dissectors.modbus.cut_echo import CutEcho
from dissectors.modbus.envelope import seal_rtu
from dissectors.tracker import Verdict
from tests.dissectors.modbus.judged import findings_of, graves_of

READ, VALUES, WRITE = "010301310001", "0103020007", "010600010002"
OTHER, OTHER_VALUES = "020300000001", "0203020007"


@pytest.fixture
def bus(paper_bus):
    return paper_bus(line="9600,8N1")


def give_back(bus, adu: str, left: int, *at: int):
    """The first octets of a frame directly behind it, in pieces that end `at`; silences that never were between."""
    bus.say(adu, 2000)
    octets = seal_rtu(bytes.fromhex(adu))
    for begin, end in zip((0, *at), (*at, left), strict=True):
        gap = 11.0 if begin else 0.0
        bus.cut(adu, end, gap) if end - begin == end >= 4 else bus.noise(octets[begin:end], gap)
    return bus


@pytest.mark.parametrize("at", [(2,), (3,), (4,), (1, 3), (3, 5)])
@pytest.mark.parametrize("adu", [READ, WRITE])
def test_pieces_of_an_echo_accuse_nobody(bus, adu, at):
    for _ in range(6):
        give_back(bus, adu, 7, *at)
    assert graves_of(bus) == {("MB013", "bus")}
    assert [one.count for one in findings_of(bus) if one.code == "MB013"] >= [5]


def test_an_answer_behind_the_pieces_is_one(bus):
    for _ in range(4):
        give_back(bus, READ, 6, 2).say(VALUES, 30)
    assert bus.run().verdicts == ["answered"] * 4
    assert not [one.error for one in bus.run().transactions if one.error]


def test_pieces_of_a_damaged_answer_stay_damage(bus):
    octets = seal_rtu(bytes.fromhex(VALUES))
    for _ in range(6):
        bus.exchange(OTHER, OTHER_VALUES, pause=100).say(READ, 200).noise(octets[:4], 0).noise(octets[5:], 11)
    assert Verdict.DAMAGED_ANSWER.value in bus.run().verdicts
    assert "MB013" not in {one.code for one in findings_of(bus)}


def test_a_write_given_back_in_part_again_and_again_is_no_wait_for_its_station(bus):
    """The requests may each be the answer to the one before; which station is silent is not known."""
    for _ in range(6):
        bus.say(WRITE, 2000).cut(WRITE, 7, 1.0)
    assert graves_of(bus) == {("MB013", "bus")}


def test_pieces_are_one_echo_only_together_and_in_time(frame_of):
    """The first within a limit behind the request, the others within a longer one."""
    octets = seal_rtu(bytes.fromhex(WRITE))
    request = frame_of(octets, start=0, end=1000)

    def taken(*pieces: tuple[bytes, int]) -> list[bool]:
        echo = CutEcho(request, 100)
        found = [Noise(piece, 1000 + at, 1000 + at, Place.BETWEEN, Reason.NO_FRAME) for piece, at in pieces]
        return [echo.takes(one, 500) for one in found]

    assert taken((octets[:4], 99), (octets[4:5], 100), (octets[5:7], 499)) == [True, True, True]
    assert taken((octets[:4], 99), (octets[5:6], 200)) == [True, False]  # one is missing in between
    assert taken((octets[:4], 99), (octets[:4], 200)) == [True, False]
    assert taken((octets[:4], 99), (octets[4:], 200)) == [True, False]  # whole, and no cut one
    assert taken((octets[:4], 100), (octets[4:5], 200)) == [False, False]
    assert taken((octets[:4], 99), (octets[4:5], 500)) == [True, False]
    assert not CutEcho().takes(request, 500)
