"""At the borders of a silence longer than any wait of the master nothing is proved about a station."""

from __future__ import annotations

import pytest

from tests.dissectors.modbus.judged import findings_of, graves_of

WRITE = ["0206000a0001", "0206000b0002", "0206000c0003"]
FUNCTIONS = ["026e01", "026e02", "026e03"]  # of the maker's, answered in the same shape


def read(unit):
    return f"{unit:02x}0300000002"


def values(unit):
    return f"{unit:02x}030400070007"


def polls(bus, count=8):
    for _ in range(count):
        bus.exchange(read(1), values(1)).exchange(read(2), values(2))
    return bus


def codes(bus):
    return {(one.code, one.subject) for one in findings_of(bus) if one.code in ("MB001", "MB002", "MB003")}


@pytest.mark.parametrize("said", [WRITE, FUNCTIONS])
@pytest.mark.parametrize("silence", [4_000, 9_000])
def test_a_silence_that_hides_an_answer_and_a_request_accuses_nobody(paper_bus, said, silence):
    for take in (paper_bus(), paper_bus(latency=16_000_000)):
        bus = polls(take)
        bus.exchange(said[0], said[0]).say(said[1]).say(said[2], silence)
        assert codes(polls(bus)) == set()


def test_an_answer_behind_a_silence_hides_what_came_to_the_request_before_it(paper_bus):
    bus = polls(paper_bus()).say(read(2)).say(values(1), 6_000)
    assert codes(polls(bus)) == set()


def test_a_master_that_waits_as_long_each_time_has_lost_answers(paper_bus):
    bus = polls(paper_bus())
    for _ in range(4):
        polls(bus.say(read(2)).exchange(read(1), values(1), pause=5_000), 3)
    assert graves_of(bus) == {("MB002", "station 2")}


def test_a_master_that_always_pauses_so_long_waits_for_an_answer(paper_bus):
    bus = paper_bus()
    for _ in range(6):
        bus.exchange(read(1), values(1), pause=6_000).exchange(WRITE[0], WRITE[0], pause=6_000)
    bus.say(WRITE[1], 6_000).exchange(read(1), values(1), pause=6_000)
    assert codes(bus) == {("MB002", "station 2")}


def test_nobody_waits_for_an_absent_station_while_the_bus_is_off(paper_bus):
    bus = paper_bus()
    for silence in (300, 300, 3_600_000, 300):
        polls(bus).say(read(4)).exchange(read(1), values(1), pause=silence)
    (waited,) = [one.seen for one in findings_of(polls(bus)) if one.code == "MB105"]
    assert waited == "under 1% of the time (914 ms) went into waiting for station 4"
