"""Devices that have, or take, an address that no station should have; requests that nobody gives back."""

from __future__ import annotations

import pytest

from dissectors.frame import Place
from tests.dissectors.modbus.judged import findings_of, graves_of


@pytest.fixture
def bus(paper_bus):
    return paper_bus()


READ, VALUES = "010300100002", "01030400070008"


def test_a_device_that_answers_as_0_gets_an_address(bus):
    for _ in range(3):
        bus.exchange("000300000001", "0003020007")
    (finding,) = (one for one in findings_of(bus) if one.code == "MB017")
    assert finding.next == "give the device an address of 1 … 247, and set that in the master"
    assert "whose address is 0" in finding.means


def test_a_reserved_address_may_be_for_whoever_is_there(bus):
    for _ in range(6):
        bus.say("ff0300200001", 400).say("0103020005", 20)
    (finding,) = (one for one in findings_of(bus) if one.code == "MB206")
    assert finding.means.startswith("255 is this maker's address for whoever is there")


def test_copies_of_requests_that_nobody_answers_are_given_back_by_nobody(bus):
    for _ in range(5):
        bus.exchange("020300100002", "02030400070008").say(READ, 40)
        for _ in range(4):
            bus.say(READ, 2)
    assert "MB018" not in {code for code, _ in graves_of(bus)}


@pytest.mark.parametrize("answer", ["0c4601020304", "fd4601020304"])
def test_a_makers_search_is_answered_by_whoever_it_concerns(bus, answer):
    for _ in range(4):
        bus.exchange(READ, VALUES).say("fd4602", 60).noise(b"\xff" * 12, 6, Place.BEFORE).say(answer, 0.1)
        bus.say("fd4602", 15).noise(b"\xff" * 9, 6, Place.BEFORE).say(answer + "05", 0.1)
    assert graves_of(bus) == set()
    assert not {"MB002", "MB004", "MB005", "MB201"} & {one.code for one in findings_of(bus)}
