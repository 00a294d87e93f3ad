"""Noise that falls on any octet falls on the last one now and then: that is no habit of a station."""

from __future__ import annotations

import pytest

from dissectors.frame import Flaw
from tests.dissectors.modbus.judged import graves_of, say_damaged

OTHERS = (1, 2, 3, 4, 5)


@pytest.fixture
def bus(paper_bus):
    return paper_bus()


def struck(bus, rounds, last, elsewhere):
    """Writes to six stations; answers of the sixth have their last octet spoilt in rounds of `last`, another one in
    those of `elsewhere`, as one of the others has in every third round."""
    for turn in range(rounds):
        for unit in (*OTHERS, 6):
            said = f"{unit:02x}06000a{turn:04x}"
            bus.say(said)
            if unit == 6 and turn in last:
                say_damaged(bus, said, Flaw.LAST_SPOILT)
            elif (unit == 6 and turn in elsewhere) or (unit == OTHERS[turn % 5] and turn % 3 == 0):
                bus.damage(said, at=4 + turn % 2)
            else:
                bus.say(said, 8)
    return bus


def test_three_of_six_at_the_same_place_are_chance_where_noise_strikes_everybody(bus):
    assert graves_of(struck(bus, 18, (1, 7, 13), (4, 10, 16))) == {("MB007", "bus")}


def test_what_is_always_at_the_same_place_is_the_stations(bus):
    assert ("MB006", "station 6") in graves_of(struck(bus, 18, (1, 4, 7, 10, 13, 16), ()))
