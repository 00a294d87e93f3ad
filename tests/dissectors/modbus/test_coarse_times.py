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
