"""A master that gives up before its stations answer: said of it, and not of whoever is hit, unless one station alone is
slow or noise strikes elsewhere."""

from __future__ import annotations

import pytest

from tests.dissectors.modbus.judged import graves_of

ASKED = {unit: f"{unit:02x}030000000a" for unit in (1, 2, 3, 4)}
ANSWERS = {unit: f"{unit:02x}0314" + "0007" * 10 for unit in ASKED}


@pytest.fixture
def bus(paper_bus):
    return paper_bus()


def turns(bus, late=(), hit=(), broken=(), quiet=12):
    """All are asked once, the master waits 200 ms; then `quiet` rounds in which all is well. `late`: who answers after
    the next request; `hit`: whose late answer falls on the next request; `broken`: whose answers are damaged."""
    for unit, asked in ASKED.items():
        if unit in late:
            bus.say(asked, 20).say(asked, 200).say(ANSWERS[unit], 5).say(ANSWERS[unit], 30)
        elif unit in hit:
            bus.say(asked, 20).cut(ANSWERS[unit % 4 + 1], 6, gap=200).exchange(asked, ANSWERS[unit], pause=200)
        elif unit in broken:
            bus.say(asked, 20).cut(ANSWERS[unit], 9, gap=10).exchange(asked, ANSWERS[unit], pause=200)
        else:
            bus.exchange(asked, ANSWERS[unit])
    for _ in range(quiet):
        for unit, asked in ASKED.items():
            bus.exchange(asked, ANSWERS[unit])
    return bus


def test_where_most_answer_late_it_is_the_master_and_nobody_else(bus):
    for late, hit in (((1,), (2,)), ((2,), (3,)), ((3,), (4,)), ((4,), (1,))):
        turns(bus, late, hit)
    assert graves_of(bus) == {("MB107", "master")}


def test_where_one_answers_late_it_is_that_one(bus):
    for _ in range(4):
        turns(bus, late=(2,))
    assert graves_of(bus) == {("MB103", "station 2")}


def test_damage_elsewhere_is_not_put_down_to_late_answers(bus):
    for unit in (1, 2, 3, 4):
        turns(bus, late=(unit,))
        turns(bus, broken=(4,), quiet=2)
    assert graves_of(bus) == {("MB015", "station 4")}


@pytest.mark.parametrize(("silent", "graves"), [(2, set()), (9, {("MB002", "station 2")})])
def test_what_a_late_station_leaves_now_and_then_comes_of_that(bus, silent, graves):
    for _ in range(4):
        turns(bus, late=(2,), quiet=20)
    for _ in range(silent):
        bus.say(ASKED[2], 20).exchange(ASKED[2], ANSWERS[2], pause=200)
    assert graves_of(turns(bus)) == {("MB103", "station 2")} | graves
