"""What no request may ask for, and whose fault it is where a station refuses it or passes over it."""

from __future__ import annotations

import pytest

from dissectors.modbus.limits import beyond_limits
from tests.dissectors.modbus.judged import findings_of, graves_of

OTHER, OTHER_VALUES = "020300000001", "0203020007"
SAID = "010300000001", "0103020007"

BEYOND = {
    "010300000000": "0 registers at once, where 1 … 125 are allowed",
    "0104000000c8": "200 registers at once, where 1 … 125 are allowed",
    "010100000bb8": "3000 coils at once, where 1 … 2000 are allowed",
    "010200000bb8": "3000 inputs at once, where 1 … 2000 are allowed",
    "010500030001": "value 0x0001 for a coil, where 0000 and FF00 are allowed",
    "0103ffff0002": "2 from address 0xFFFF on, beyond the last one 0xFFFF",
    "01100090000000": "0 registers at once, where 1 … 123 are allowed",
}


@pytest.fixture
def bus(paper_bus):
    return paper_bus()


@pytest.mark.parametrize(("request_", "words"), BEYOND.items())
def test_what_no_request_may_ask_for(request_, words):
    assert beyond_limits(bytes.fromhex(request_)) == words


@pytest.mark.parametrize("request_", ["01030000007d", "0103ffff0001", "01058945ff00", "01068945ff00", "0141", "01", ""])
def test_what_a_request_may_ask_for(request_):
    assert beyond_limits(bytes.fromhex(request_)) is None


@pytest.mark.parametrize(("request_", "words"), BEYOND.items())
def test_a_refusal_of_it_is_the_masters(bus, request_, words):
    refusal = f"01{int(request_[2:4], 16) | 0x80:02x}03"
    for _ in range(4):
        bus.exchange(OTHER, OTHER_VALUES).exchange(request_, refusal)
    assert graves_of(bus) == {("MB016", "master")}
    [finding] = [one for one in findings_of(bus) if one.code == "MB016"]
    assert finding.seen == f"4 requests that cannot be carried out: {words}; refused 4 times, rightly"


def test_a_station_may_pass_over_it(bus):
    for _ in range(4):
        bus.exchange(OTHER, OTHER_VALUES).exchange(*SAID).say("0103000000c8").say("0103000000c8", 300)
    bus.say(OTHER, 300)
    assert graves_of(bus) == {("MB016", "master")}
    assert "not answered 8 times" in next(one.seen for one in findings_of(bus) if one.code == "MB016")


def test_a_device_that_allows_more_is_held_to_it(bus):
    for _ in range(4):
        bus.exchange(OTHER, OTHER_VALUES).exchange("0103ffff0002", "01030400070007")
    assert graves_of(bus) == set()
    for _ in range(6):
        bus.say("0103ffff0002").exchange(OTHER, OTHER_VALUES, pause=300)
    assert graves_of(bus) == {("MB003", "station 1")}


def test_an_illegal_function_is_no_such_refusal(bus):
    for _ in range(4):
        bus.exchange(OTHER, OTHER_VALUES).exchange("010300000000", "018301")
    assert graves_of(bus) == {("MB008", "station 1")}


def test_a_damaged_request_does_not_say_what_was_asked(bus):
    for _ in range(4):
        bus.exchange(OTHER, OTHER_VALUES)
        bus.damage("010300000002", 40, at=4).say("018303")  # 4098 registers, as it is
    assert not [one for one in findings_of(bus) if one.code == "MB016"]


def test_what_damage_makes_of_a_request_is_not_the_masters(bus):
    for _ in range(6):
        bus.exchange(OTHER, OTHER_VALUES).exchange("010300900001", "018302")
    bus.damage("010300900001", 40, at=4).say("018302", 8).exchange(OTHER, OTHER_VALUES)
    assert graves_of(bus) == {("MB008", "station 1")}
