"""Exchanges as columns give what counting them one by one gives."""

from __future__ import annotations

from typing import Any

import pytest

from dissectors.tracker import Verdict
from sniff.tui.exchanges import Exchanges
from sniff.tui.timeline_picture import Chart, heights
from tests.sniff.tui.conftest import START


@pytest.fixture
def bus(make_bus: Any) -> Any:
    made = make_bus()
    for number in range(200):
        made.ask(1 + number % 3, Verdict.NO_RESPONSE if number % 3 == 2 else Verdict.ANSWERED, latency=5 + number % 7)
    return made


def test_stations_and_percentiles(bus: Any) -> None:
    made = Exchanges()
    half = bus.store.last_closed // 2
    made.bring_up(bus.store, half)  # in two goes, and a third that finds nothing new
    made.bring_up(bus.store, bus.store.last_closed)
    made.bring_up(bus.store, bus.store.last_closed)
    begin = START // 10**9
    stations = made.stations(begin, 20, 1)
    assert sorted(stations) == [1, 2, 3]
    assert sum(sum(asked) for asked, _ in stations.values()) == 200
    assert (sum(stations[1][1]), sum(stations[3][1])) == (0, 66)
    closed = [bus.store.closed_by_no(no) for no in range(1, bus.store.last_closed + 1)]
    for place, (median, most) in enumerate(zip(*made.latencies(begin, 20, 1, (0.5, 0.95)), strict=True)):
        times = sorted(
            one.latency.nominal / 1e6
            for one in closed
            if one.latency is not None and one.start // 10**9 == begin + place
        )
        if not times:
            assert median is None
            continue
        assert median == pytest.approx(times[-(-len(times) // 2) - 1], rel=0.05)
        assert most == pytest.approx(times[-(-len(times) * 95 // 100) - 1], rel=0.05)


def test_nothing_was_asked() -> None:
    made = Exchanges()
    assert made.latencies(0, 5, 1, (0.5,)) == [[None] * 5]
    assert made.stations(0, 5, 1) == {}


def test_what_is_left_over_is_given_out() -> None:
    charts = [Chart("a", [], 1, "", 3), Chart("b", [], 1, "", 0), Chart("c", [], 1, "", 2)]
    assert heights(charts, 12) == [7, 1, 4]
    assert heights(charts, 2) == [1, 1, 1]
    assert sum(heights(charts, 13)) == 13
