"""A request that noise hides in the octets before its answer: that answer is no unfit one to the request before."""

from __future__ import annotations

from dissectors.modbus.envelope import seal_rtu
from tests.dissectors.modbus.judged import graves_of

READ, VALUES = "030300100002", "03030400070008"
ID, NAME = "0311", "0311044142ff01"


def test_an_answer_whose_own_request_is_in_the_noise_fits(paper_bus):
    bus = paper_bus(latency=16_000_000)
    for turn in range(12):
        bus.exchange(READ, VALUES)
        if turn % 4 == 3:
            spoilt = bytes((0xFE, *seal_rtu(bytes.fromhex(VALUES))[1:-1])) + seal_rtu(bytes.fromhex(ID))
            bus.say(READ, 40).noise(spoilt, 8).say(NAME, 80)
        bus.exchange(ID, NAME)
    assert not any(code == "MB010" for code, _ in graves_of(bus))


def test_an_answer_to_nothing_that_is_asked_does_not_fit_behind_noise_either(paper_bus):
    bus = paper_bus(latency=16_000_000)
    for turn in range(12):
        bus.exchange(READ, VALUES)
        if turn % 4 == 3:
            bus.say(READ, 40).noise(b"\xfe\x03\x04\x00", 8).say("0304020007", 60)
        bus.exchange(ID, NAME)
    assert ("MB010", "station 3") in graves_of(bus)
