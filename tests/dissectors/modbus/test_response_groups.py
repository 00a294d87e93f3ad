"""Two response times to one request: found where they take turns and are provably apart, and only there."""

from __future__ import annotations

from random import Random

from hypothesis import given
from hypothesis import strategies as st

from dissectors.modbus.response_groups import ANSWERS_KEPT, ANSWERS_LEAST, AnsweredRequest, Groups, SameRequest
from dissectors.modbus.station_record import ResponseTimes
from dissectors.tracker import Interval

MS = 1_000_000


def groups_of(times: list[int], slack: int = 0, octets: list[bytes] | None = None) -> Groups | None:
    same = SameRequest()
    for no, time in enumerate(times, 1):
        latency = Interval(time, max(0, time - slack), time + slack)
        same.answers.append(AnsweredRequest(no, no * 50 * MS, latency, octets[no - 1] if octets else b"\1"))
    return same.groups()


def two(count: int, slow: int = 20 * MS, share: float = 0.5, jitter: int = 400_000) -> list[int]:
    dice = Random(count)
    return [(slow if dice.random() < share else 8 * MS) + dice.randrange(jitter) for _ in range(count)]


def test_two_groups_that_take_turns_are_found() -> None:
    groups = groups_of(two(60))
    assert groups is not None
    assert len(groups.quick) + len(groups.slow) == 60
    assert max(a.latency.nominal for a in groups.quick) < 9 * MS < min(a.latency.nominal for a in groups.slow)
    assert not groups.apart


def test_too_few_answers_say_nothing() -> None:
    assert groups_of(two(ANSWERS_LEAST - 1)) is None


def test_now_and_then_is_no_group() -> None:
    assert groups_of([20 * MS if number % 16 == 0 else 8 * MS for number in range(ANSWERS_KEPT)]) is None


def test_a_single_change_is_no_second_station() -> None:
    assert groups_of([8 * MS] * 40 + [20 * MS] * 40) is None


def test_a_drift_is_no_second_station() -> None:
    assert groups_of([8 * MS + number * MS for number in range(80)]) is None


def test_groups_that_the_adapter_could_have_made_are_not_judged() -> None:
    times = two(80)
    assert groups_of(times, slack=MS) is not None
    assert groups_of(times, slack=8 * MS) is None


def test_groups_wider_than_the_gap_between_them_are_none() -> None:
    assert groups_of(two(80, slow=20 * MS, jitter=2 * MS)) is not None
    assert groups_of(two(80, slow=20 * MS, jitter=10 * MS)) is None


def test_what_they_say_tells_two_devices_from_one_that_waits() -> None:
    times = two(64)
    by_time = [b"\x07" if time < 9 * MS else b"\x4d" for time in times]
    assert (groups := groups_of(times, octets=by_time)) is not None
    assert groups.apart
    any_value = [bytes((number % 2,)) for number in range(64)]
    assert (groups := groups_of(times, octets=any_value)) is not None
    assert not groups.apart
    counter = [bytes((number,)) for number in range(64)]
    assert (groups := groups_of(times, octets=counter)) is not None
    assert not groups.apart


@given(st.integers(1, 60), st.integers(1, 40), st.integers(0, 2**32))
def test_even_jitter_makes_no_groups(least: int, spread: int, seed: int) -> None:
    dice = Random(seed)
    assert groups_of([least * MS + int(spread * MS * dice.random()) for _ in range(ANSWERS_KEPT)]) is None


@given(st.lists(st.integers(0, 10**10), max_size=120))
def test_any_times(times: list[int]) -> None:
    groups = groups_of(times)
    if groups is not None:
        assert groups.smaller >= 8
        assert max(a.latency.high for a in groups.quick) < min(a.latency.low for a in groups.slow)


def test_the_quickest_answers_tell_a_drift_from_a_second_response_time() -> None:
    drifting, two_times = ResponseTimes(), ResponseTimes()
    for number in range(160):
        drifting.add(Interval((8 + number // 8) * MS, (8 + number // 8) * MS, (8 + number // 8) * MS))
        time = 21 * MS if number % 8 < number // 20 else 8 * MS  # the slow ones get more and more
        two_times.add(Interval(time, time, time))
    assert drifting.quarters()[-1].least > drifting.quarters()[0].nominal
    assert two_times.quarters()[-1].nominal == 21 * MS
    assert two_times.quarters()[-1].least == 8 * MS
