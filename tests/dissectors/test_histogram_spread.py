"""Counts of a histogram between edges."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from dissectors.histogram import Histogram

EDGES = [10, 1000, 100_000]


@given(st.lists(st.integers(0, 10**9)))
def test_spread_is_right_but_near_an_edge(values: list[int]) -> None:
    histogram = Histogram()
    for value in values:
        histogram.add(value)
    counts = histogram.spread(EDGES)
    assert sum(counts) == len(values)
    for place in range(len(counts)):
        low = EDGES[place - 1] if place else 0
        high = EDGES[place] if place < len(EDGES) else 10**10
        inside = sum(low * 1.05 < value < high * 0.9 for value in values)
        around = sum(low * 0.9 <= value <= high * 1.1 + 1 for value in values)
        assert inside <= counts[place] <= around
