"""Histograms: precise to 2 %, and the whole is the merge of its parts."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dissectors.histogram import Histogram, add_grouped

durations = st.lists(st.integers(0, 10**12), min_size=1, max_size=200)


def filled(values: list[int]) -> Histogram:
    histogram = Histogram()
    for value in values:
        histogram.add(value)
    return histogram


@given(durations, st.floats(0, 1))
def test_a_quantile_is_right_to_two_percent(values: list[int], share: float) -> None:
    exact = sorted(values)[max(1, math.ceil(share * len(values))) - 1]
    found = filled(values).quantile(share)
    assert found is not None
    assert abs(found - exact) <= max(2, exact * 0.022)


@given(durations, durations)
def test_merging_is_the_same_as_counting_all(left: list[int], right: list[int]) -> None:
    assert filled(left).merge(filled(right)) == filled(left + right)


def test_nothing_counted_has_no_quantile() -> None:
    assert Histogram().quantile(0.5) is None
    assert Histogram().mean is None


@given(durations, durations)
def test_what_came_since_is_right_to_two_percent(before: list[int], later: list[int]) -> None:
    histogram = filled(before)
    earlier = histogram.copy()
    for value in later:
        histogram.add(value)
    since, exact = histogram.since(earlier), filled(later)
    assert (since.count, since.total, since.buckets) == (exact.count, exact.total, exact.buckets)
    for found, wanted in ((since.least, exact.least), (since.most, exact.most)):
        assert found is not None
        assert wanted is not None
        assert abs(found - wanted) <= max(2, wanted * 0.022)


@given(st.lists(st.tuples(st.integers(0, 3), st.integers(-5, 10**12) | st.integers(1 << 47, 1 << 55)), max_size=60))
def test_many_in_groups_are_the_same_as_one_after_the_other(values: list[tuple[int, int]]) -> None:
    import numpy as np

    one_by_one: dict[int, Histogram] = {}
    for group, value in values:
        one_by_one.setdefault(group, Histogram()).add(value)
    at_once: dict[int, Histogram] = {}
    groups, durations = (np.array(column, np.int64) for column in (zip(*values, strict=True) if values else ((), ())))
    add_grouped(lambda group: at_once.setdefault(group, Histogram()), groups, durations)
    assert at_once == one_by_one


@pytest.mark.parametrize(
    "values",
    [[1000] * 9, [1057, 1062, 1065, 1068, 1069, 1070, 1073], [5, 900, 901, 902, 903, 20_000], list(range(1000, 1400))],
)
def test_values_are_no_farther_apart_than_is_said(values: list[int]) -> None:
    held = filled(values)
    for low, high in ((0.05, 0.95), (0.3, 0.7), (0, 1)):
        least, most = (values[max(1, math.ceil(share * len(values))) - 1] for share in (low, high))
        apart = held.apart(low, high)
        assert apart is not None
        assert most - least <= apart <= most - least + 0.05 * most
    assert Histogram().apart(0, 1) is None
    assert (held.apart(0, 1) == 0) is (values[0] == values[-1])
