"""Two masters behind an adapter whose reads hide how soon a request came: the order of the frames tells."""

from __future__ import annotations

import pytest

from tests.dissectors.modbus.judged import findings_of, graves_of

FTDI = 16_000_000
POLL, VALUES = "010300000006", "01030c" + "0001" * 6
TWO, OTHERS = "020300000006", "02030c" + "0001" * 6
PANEL, FEW = "0203012c0002", "02030400050006"


@pytest.fixture
def bus(paper_bus):
    return polls(paper_bus(latency=FTDI), 6)


def polls(bus, count=2):
    for _ in range(count):
        bus.exchange(POLL, VALUES).exchange(TWO, OTHERS)
    return bus


def test_requests_between_another_and_its_answer_are_those_of_a_second_master(bus):
    for _ in range(4):
        polls(bus.say(PANEL).say(POLL, 0).say(FEW, 4).say(VALUES, 8))
        polls(bus, 4)
    assert ("MB203", "bus") in graves_of(bus)


def test_a_second_master_is_told_by_order_where_its_haste_looks_like_a_habit(paper_bus):
    bus = polls(paper_bus(latency=2_500_000), 6)
    for turn in range(8):
        polls(bus.say(PANEL).say(POLL, turn % 3).say(FEW, 4).say(VALUES, 8), 5)
    assert ("MB203", "bus") in graves_of(bus)


def test_an_answer_to_what_damage_hides_is_not_held_against_the_station(bus):
    for _ in range(4):
        polls(bus.exchange(PANEL, FEW), 2)
        polls(bus.say(PANEL).noise(bytes(7), 1).say(OTHERS, 9), 3)
    assert not any(one.code == "MB010" for one in findings_of(bus))
    assert ("MB203", "bus") in graves_of(bus)


def test_an_answer_that_does_not_fit_is_held_against_it_where_nothing_else_was_heard(bus):
    for _ in range(4):
        polls(bus.say(PANEL).say(OTHERS, 20), 3)
    assert ("MB010", "station 2") in graves_of(bus)


@pytest.mark.parametrize("took", [105, 130])
def test_a_station_that_answers_about_when_the_master_gives_up_is_no_second_master(paper_bus, took):
    bus = paper_bus()
    for turn in range(30):
        bus.exchange(POLL, VALUES)
        if turn % 2:
            bus.exchange(TWO, OTHERS, answer=95)
        else:
            bus.say(TWO).say(POLL, 100).say(OTHERS, took - 100 - 5).say(VALUES, 15)
    assert not any(one.code == "MB203" for one in findings_of(bus))


def test_one_that_gives_up_too_soon_and_asks_what_always_comes_next_is_no_second_master(bus):
    for turn in range(12):
        bus.exchange(PANEL, FEW)
        if turn % 3:
            bus.exchange(POLL, VALUES).exchange(TWO, OTHERS)
        else:  # the answer of station 1 falls on the request to station 2
            bus.say(POLL).say(TWO, 0).say(VALUES, 3 + turn % 5).say(OTHERS, 9)
    assert not any(one.code == "MB203" for one in findings_of(bus))


def test_late_confirmations_of_what_is_always_asked_before_are_no_requests_of_a_second_master(paper_bus):
    bus = paper_bus()
    for turn in range(40):
        write = f"01060005{turn:04x}"
        if turn % 8 == 7:  # repeated, and both are answered
            bus.say(write).say(write, 12).say(write, 5).say(TWO, 7).say(write, 1 + turn % 3).say(TWO, 9).say(OTHERS, 12)
        else:
            bus.exchange(write, write, answer=8).exchange(TWO, OTHERS, answer=12)
    assert not any(one.code == "MB203" for one in findings_of(bus))


def test_whoever_is_asked_by_one_that_did_not_wait_speaks_into_nothing(bus):
    """The damage is where two masters met, not where the answer of station 1 was overdue."""
    for _ in range(6):
        polls(bus.say(POLL).say(PANEL, 0).damage(FEW + "00" * 6, 8), 12)
    assert not any(one.code == "MB106" for one in findings_of(bus))


def test_whose_answer_only_another_late_one_came_before_is_not_late(paper_bus):
    """Both read late, and apart: what came into the wait for station 1 was no request of a master that gave up."""
    bus = paper_bus(latency=52_500_000)
    write, poll = "030600010009", "010300000001"
    for value in range(4):
        bus.say(write, 1000).say(poll, 1000).say(write, 55).say(f"01030200{value:02x}", 40)
    assert graves_of(bus) == {("MB103", "station 3")}
