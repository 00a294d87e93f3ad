"""The index against a plain list of what it should hold."""

from __future__ import annotations

from collections.abc import Callable

from hypothesis import given
from hypothesis import strategies as st

from sniff.tui.index import Index

BOUNDS = st.tuples(st.integers(1, 60), st.integers(0, 80)).map(lambda pair: (pair[0], pair[0] + pair[1] - 1))


def passes(divisor: int) -> Callable[[int], bool]:
    return lambda number: number % divisor == 0


def finish(index: Index) -> None:
    while index.pending:
        index.step(7)


def check(index: Index, wanted: list[int]) -> None:
    assert [index[line] for line in range(len(index))] == wanted
    for number in range(index.first - 2, index.last + 3):
        assert (number in index) == (number in wanted)
        assert index.position(number) == sum(found < number for found in wanted)


@given(BOUNDS)
def test_without_a_test_everything_is_shown(bounds: tuple[int, int]) -> None:
    index = Index()
    index.bound(*bounds)
    assert index.pending == 0
    check(index, list(range(bounds[0], bounds[1] + 1)))


@given(BOUNDS, st.integers(1, 9), st.data())
def test_finds_the_same_from_every_anchor(bounds: tuple[int, int], divisor: int, data: st.DataObject) -> None:
    first, last = bounds
    index = Index(passes(divisor), data.draw(st.integers(first, last + 1)))
    index.bound(first, last)
    finish(index)
    check(index, [number for number in range(first, last + 1) if number % divisor == 0])


@given(
    st.integers(1, 5),
    st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9), st.integers(0, 9)), max_size=12),
    st.integers(1, 30),
)
def test_keeps_up_while_rows_come_and_go(divisor: int, moves: list[tuple[int, int, int]], anchor: int) -> None:
    first, last = 1, 30
    index = Index(passes(divisor), anchor)
    index.bound(first, last)
    for gone, came, steps in moves:
        first, last = min(first + gone, last + came + 1), last + came
        index.bound(first, last)
        index.step(steps)
        shown = [index[line] for line in range(len(index))]
        assert shown == sorted(shown)
        assert all(first <= number <= last for number in shown)
    finish(index)
    check(index, [number for number in range(first, last + 1) if number % divisor == 0])


@given(st.sets(st.integers(1, 40)), st.lists(st.integers(-3, 45), max_size=40), st.integers(1, 41))
def test_retest_takes_in_and_throws_out(passing: set[int], changed: list[int], anchor: int) -> None:
    passing = set(passing)
    index = Index(lambda number: number in passing, anchor)
    index.bound(1, 40)
    finish(index)
    for number in changed:
        passing ^= {number}
        index.retest(number)
    check(index, sorted(number for number in passing if 1 <= number <= 40))


def test_the_neighbourhood_of_the_anchor_comes_first() -> None:
    tested: list[int] = []
    index = Index(lambda number: tested.append(number) is None, anchor=500_000)
    index.bound(1, 1_000_000)
    index.step(10)
    assert sorted(tested) == list(range(499_990, 500_010))
    assert index.pending == 1_000_000 - 20
    assert index.nearest(0) == 499_990


def test_nearest() -> None:
    index = Index(passes(10), 1)
    index.bound(1, 100)
    finish(index)
    assert [index.nearest(number) for number in (0, 14, 15, 16, 99, 1000)] == [10, 10, 20, 20, 100, 100]
    assert Index().nearest(3) is None
