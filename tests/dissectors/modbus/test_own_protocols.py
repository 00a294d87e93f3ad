"""A maker's own protocol in frames of Modbus is told as that, and a request for nothing is the master's mistake."""

from __future__ import annotations

import pytest

from tests.dissectors.modbus.judged import findings_of, graves_of

GOOD = "020300000001", "0203020007"
STATUS = tuple(
    (f"010403{kind:02x}0000", f"010403{kind:02x}{value:04x}") for kind, value in ((0, 10000), (1, 9901), (3, 5990))
)
"""Reads of a Huanyang drive: function, count of octets, which value, two octets for it; the answer is like them."""


@pytest.fixture
def bus(paper_bus):
    return paper_bus()


def test_a_drive_that_speaks_its_own_way_is_a_note(bus):
    for _ in range(6):
        for asked, answered in STATUS:
            bus.exchange(asked, answered)
        bus.exchange("01030101", "01030109").exchange(*GOOD)
    assert graves_of(bus) == set()
    told = [one for one in findings_of(bus) if one.code == "MB016"]
    assert [one.subject for one in told] == ["station 1"]
    assert "own protocol" in told[0].means


@pytest.mark.parametrize("answer", ["0103020007", "010300", "018303"])
def test_whatever_comes_of_a_request_for_nothing_is_the_masters(bus, answer):
    for _ in range(6):
        bus.exchange("010300000000", answer).exchange("010300000001", "0103020007").exchange(*GOOD)
    assert graves_of(bus) == {("MB016", "master")}
