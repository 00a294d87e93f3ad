"""Confirmations that equal their request and come late: what the bus shows decides, and nobody is accused by guess."""

from __future__ import annotations

import pytest

from tests.dissectors.modbus.judged import findings_of, graves_of

READ, VALUES = "010300000001", "0103020007"
OTHER, OTHER_VALUES = "020300000001", "0203020007"
WRITE, WRITE_2 = "020600051770", "020600051771"
VENDOR, VENDOR_VALUES = "0241020900", "02410600d702bc002d"


@pytest.fixture
def bus(paper_bus):
    return paper_bus()


@pytest.mark.parametrize("slow", [300, 700, 1500, 2500])
def test_nobody_gives_up_sooner_on_a_repeat(bus, slow):
    for _ in range(4):
        bus.exchange(WRITE, WRITE, answer=slow, pause=100).exchange(READ, VALUES, pause=100)
    assert bus.run().verdicts == ["answered"] * 8
    assert graves_of(bus) == set()


@pytest.mark.parametrize("slow", [300, 1500])
def test_a_slow_station_with_long_pauses_is_known_by_its_varying_times(bus, slow):
    for turn in range(3):
        bus.exchange(WRITE, WRITE, answer=slow + 40 * turn, pause=3000 - slow)
        bus.exchange(OTHER, OTHER_VALUES, pause=2960)
    assert bus.run().verdicts == ["answered"] * 6


def test_after_the_known_timeout_it_is_the_request_again(bus):
    bus.say(READ, 500).say(READ, 500).say(READ, 500)
    reading = bus.say(WRITE, 500).say(WRITE, 500).exchange(READ, VALUES, pause=500).run()
    assert reading.verdicts[3:5] == ["no-response", "no-response"]


def test_three_copies_in_even_time_are_a_timer(bus):
    reading = bus.exchange(READ, VALUES).say(WRITE).say(WRITE, 400).say(WRITE, 400).exchange(READ, VALUES).run()
    assert reading.verdicts == ["answered", "no-response", "answered"]


def test_the_same_pause_as_after_silence_tells_of_a_repeat(bus):
    for _ in range(5):
        bus.exchange(READ, VALUES).say(WRITE, 41).say(WRITE, 400).exchange(READ, VALUES, pause=400)
        bus.exchange(OTHER, OTHER_VALUES, pause=43)
    assert bus.run().verdicts.count("no-response") >= 3
    assert ("MB004", "station 2") in graves_of(bus)


def test_a_quick_third_copy_answers_the_repeat(bus):
    reading = bus.say(WRITE).say(WRITE, 400).say(WRITE, 8).exchange(READ, VALUES).run()
    assert reading.verdicts == ["retry", "answered"]
    assert reading.roles[:3] == ["request", "either", "response"]
    assert reading.transactions[0].attempt == 2


def test_where_both_readings_stand_both_are_said(bus):
    for _ in range(3):
        bus.exchange(WRITE, WRITE, answer=300, pause=300)
    assert set(bus.run().verdicts) == {"answered-or-repeated"}
    assert graves_of(bus) == set()
    assert [one.code for one in findings_of(bus) if one.subject == "station 2"] == ["MB403"]


def test_a_constant_write_heard_from_the_middle_accuses_nobody(bus):
    bus.say(WRITE)
    for _ in range(12):
        bus.exchange(WRITE, WRITE, answer=300, pause=700)
    assert set(bus.run().verdicts) <= {"answered-or-repeated", "open"}
    assert graves_of(bus) == set()


@pytest.mark.parametrize("slow", [270, 2490])
def test_an_answer_of_unknown_layout_may_take_long(bus, slow):
    for _ in range(3):
        bus.exchange(VENDOR, VENDOR_VALUES, answer=slow, pause=100).exchange(READ, VALUES, pause=100)
    assert bus.run().verdicts == ["answered"] * 6


def test_two_frames_alone_are_answered_or_asked_anew(bus):
    assert bus.exchange(VENDOR, VENDOR_VALUES, answer=270).run().verdicts == ["answered-or-repeated"]


def test_a_function_that_nobody_knows_has_its_own_pace(bus):
    for _ in range(4):
        bus.exchange(OTHER, OTHER_VALUES).exchange(WRITE, WRITE)
        bus.exchange(VENDOR, VENDOR_VALUES, answer=700)
    assert bus.run().verdicts == ["answered"] * 12


def test_an_answer_long_after_the_usual_is_no_loss(bus):
    for _ in range(4):
        bus.exchange(OTHER, OTHER_VALUES).exchange(WRITE, WRITE)
    reading = bus.exchange(WRITE, WRITE, answer=600).exchange(OTHER, OTHER_VALUES).run()
    assert reading.verdicts[8:10] == ["answered-or-repeated"] * 2
    assert graves_of(bus) == set()


def test_an_echo_and_a_slow_answer(bus):
    for _ in range(3):
        bus.say(OTHER).say(OTHER, 0.5).say(OTHER_VALUES)
    for _ in range(3):
        bus.say(WRITE).say(WRITE, 0.5).say(WRITE, 600).say(OTHER, 100).say(OTHER, 0.5).say(OTHER_VALUES)
    assert bus.run().verdicts == ["answered", "echo"] * 9


def test_another_value_than_was_written_is_said(bus):
    for _ in range(3):
        bus.exchange(OTHER, OTHER_VALUES)
    for _ in range(3):
        bus.exchange(WRITE, WRITE_2)
    assert graves_of(bus) == {("MB010", "station 2")}


def test_frames_that_came_in_one_read_are_no_echo(bus):
    assert bus.say(WRITE).say(WRITE, 0).exchange(READ, VALUES).run().verdicts == ["answered", "answered"]
