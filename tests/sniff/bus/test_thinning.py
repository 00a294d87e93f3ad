"""Results that go back into a recording: all of them while there are few, in turn when there are many."""

from __future__ import annotations

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from sniff.bus.thinning import Budget, Room

S = 1_000_000_000


def test_everything_as_long_as_there_is_little() -> None:
    budget = Budget(2, 100)
    assert all(budget.take(f"point {number % 4}", number * S) for number in range(1000))


def test_in_the_long_run_the_rate_holds_and_every_channel_has_its_turn() -> None:
    budget = Budget(2, 100)
    taken: dict[int, list[int]] = {}
    for number in range(50 * 3600):
        point, now = number % 30, number * S // 50
        if budget.take(str(point), now):
            taken.setdefault(point, []).append(now)
    assert sum(map(len, taken.values())) <= 2 * 3600 + 100
    late = [[time for time in times if time > 600 * S] for times in taken.values()]
    assert len(late) == 30
    assert min(map(len, late)) > 0.8 * max(map(len, late)), "one channel starves another"
    for times in late:
        assert max(b - a for a, b in pairwise(times)) <= 20 * S


def test_a_quiet_time_gives_the_burst_back() -> None:
    budget = Budget(1, 50)
    while budget.take("a", 0) or budget.take("b", 0):
        pass
    assert all(budget.take("a", 1000 * S + number) for number in range(20))


def test_a_clock_that_runs_backwards() -> None:
    budget = Budget(1, 4)
    assert budget.take("a", 100 * S)
    assert budget.take("a", -100 * S)
    for number in range(100):
        budget.take("a", -100 * S - number)
    assert budget.take("a", 1000 * S)


def room(reads: int) -> float:
    """After a minute with so many reads of 9 octets a second."""
    found = Room()
    for second in range(60):
        for _ in range(reads):
            found.add(9)
        rate = found.rate(second * S)
    return rate


def test_a_quiet_bus_has_room_for_more_values() -> None:
    assert room(200) == room(100) == Room.LEAST
    assert 1 <= room(50) < 2
    assert 8 < room(10) < 15
    assert 12 < room(0) <= Room.MOST


def test_asking_ahead_changes_nothing() -> None:
    """What is read of a table at once and row by row must be the same."""
    asked, alone = Budget(2.0, 10), Budget(2.0, 10)
    for second in range(60):
        now = second * S
        may = asked.would_take(("a", "b"), now)
        asked.would_take(("a",), now + 50 * S)
        for channel in ("a", "b"):
            took = alone.take(channel, now)
            assert asked.take(channel, now) == took
            assert may or not took


@given(
    st.lists(st.tuples(st.sampled_from("abcdef"), st.integers(0, 5 * S), st.sampled_from([None, 1.0, 2.5]))),
    st.data(),
)
def test_asking_for_what_has_no_turn_changes_nothing(
    asked: list[tuple[str, int, float | None]], data: st.DataObject
) -> None:
    """So it is the same whether somebody asks ahead what needs not be worked out, or takes all as it comes."""
    one, other = Budget(2, 6), Budget(2, 6)
    now, taken, as_well = 0, list[bool](), list[bool]()
    for channel, later, rate in asked:
        now += later
        if rate is not None:
            one.settle(now, rate)
            other.settle(now, rate)
        taken.append(one.take(channel, now))
        may = not other.is_spent(now) if data.draw(st.booleans()) else other.would_take([channel], now)
        as_well.append(may and other.take(channel, now))
    assert taken == as_well
