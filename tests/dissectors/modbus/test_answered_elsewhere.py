"""Answers of another unit than the one asked: a habit of the device, or one to a request that was lost."""

from __future__ import annotations

import pytest

from tests.dissectors.modbus.judged import findings_of, graves_of

FIVE, SEVEN, SEVENS = "050300100002", "070300100002", "07030400070008"


@pytest.fixture
def bus(paper_bus):
    return paper_bus()


def test_a_station_that_is_away_is_not_answered_by_whose_request_was_lost(bus):
    """Once the request to 7 is not heard; from then on each request to 7 seemed to be its answer for 5."""
    for _ in range(20):
        bus.exchange(FIVE, "05030400070008").exchange(SEVEN, SEVENS)
    bus.say(FIVE).say(SEVENS, 320)
    for _ in range(10):
        bus.say(FIVE).say(FIVE, 300).exchange(SEVEN, SEVENS, pause=300)
    found = {(one.code, one.subject) for one in findings_of(bus)}
    assert ("MB206", "station 5") not in found
    assert graves_of(bus) == {("MB003", "station 5")}


def test_the_same_write_to_the_next_station_is_no_answer_of_it(bus):
    """5 answers as 7 by chance twice; a master writes the same to all of them."""
    for _ in range(40):
        bus.exchange(FIVE, "05030400070008").exchange(SEVEN, SEVENS)
    for _ in range(2):
        bus.say(FIVE).say(SEVENS, 320).exchange(FIVE, "05030400070008")
    bus.say("050600100001").exchange("070600100001", "070600100001", pause=300)
    assert "MB206" not in {one.code for one in findings_of(bus)}
    assert next(one.count for one in findings_of(bus) if one.code == "MB207") == 2


def test_who_is_always_answered_by_another_is_told(bus):
    for _ in range(5):
        bus.exchange(FIVE, SEVENS).exchange("020300100002", "02030400070008")
    assert ("MB206", "station 5") in {(one.code, one.subject) for one in findings_of(bus)}
