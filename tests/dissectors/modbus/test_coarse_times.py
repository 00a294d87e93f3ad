"""What a clock of whole seconds lays directly behind one another says nothing of the silence between."""

from __future__ import annotations

import pytest

from tests.dissectors.modbus.judged import graves_of

SECOND = 1_000_000_000


@pytest.mark.parametrize("latency", [52_500_000, SECOND])
def test_a_request_again_is_no_second_answer_to_the_one_before(paper_bus, latency):
    """Of a maker's function, whose request and answer have no shape of their own."""
    bus = paper_bus(line="1200,8N1", latency=latency)
    for _ in range(6):
        bus.say("01640102", 950).say("01640909090909", 0).say("01640102", 0).say("01640909090909", 0)
    assert graves_of(bus) == set()


@pytest.mark.parametrize("latency", [52_500_000, SECOND])
def test_the_third_of_three_equal_frames_is_no_write_that_the_next_confirms_wrongly(paper_bus, latency):
    """Request, echo and answer: what says another value behind them is the next request."""
    bus = paper_bus(latency=latency)
    for value in range(9):
        for _ in range(3):
            bus.say(f"01060001{value:04x}", 0)
    assert graves_of(bus) == set()


@pytest.mark.parametrize("latency", [52_500_000, SECOND])
def test_another_value_than_was_written_is_still_said(paper_bus, latency):
    bus = paper_bus(latency=latency)
    for value in range(5):
        bus.exchange(f"01060001{value:04x}", "010600011000", 0, 0)
    assert graves_of(bus) == {("MB010", "station 1")}
