"""What says the same as the broadcast before it: a station that answers it, or the master that writes to one more."""

from __future__ import annotations

import pytest

from tests.dissectors.modbus.judged import findings_of, graves_of

READ, VALUES = "010300100002", "01030400070008"
TO_ALL, ONE = "000625010001", "020625010001"


def polled(bus, *steps, rounds=8):
    for _ in range(rounds):
        bus.exchange(READ, VALUES)
        for said, gap in steps:
            bus.say(said, gap)
    return bus.exchange(READ, VALUES)


@pytest.mark.parametrize("latency", [0, 16_000_000], ids=["exact", "ftdi"])
@pytest.mark.parametrize("gap", [8, 40])
def test_a_write_behind_the_broadcast_that_is_confirmed_is_the_masters(paper_bus, latency, gap):
    bus = polled(paper_bus(latency=latency), (TO_ALL, 40), (ONE, gap), (ONE, 8))
    assert graves_of(bus) == set()
    assert not any(one.code == "MB204" for one in findings_of(bus))


@pytest.mark.parametrize(("latency", "gap"), [(0, 8), (16_000_000, 8), (16_000_000, 0)])
def test_who_answers_the_broadcast_is_told_whatever_the_adapter_hides(paper_bus, latency, gap):
    bus = polled(paper_bus(latency=latency), (TO_ALL, 40), (ONE, gap))
    assert graves_of(bus) == {("MB204", "bus")}
    assert "8 frames directly after a broadcast, from station 2" in next(
        one.seen for one in findings_of(bus) if one.code == "MB204"
    )
