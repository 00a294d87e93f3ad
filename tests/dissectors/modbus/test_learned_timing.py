"""What a master's timing tells, at its borders: what an answer may take, what a wait is, what a pause says."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from dissectors.line import MS, LineSettings, Timing
from dissectors.modbus.learned_timing import READ, WRITE, LearnedTiming

TIMING = Timing(LineSettings.parse("19200,8E1"))
TOLERANCE = 2 * MS + 4 * TIMING.char
NO_CLOCK = 10_000 * MS  # a cycle that no other one is like


def learnt(
    *,
    reads: Sequence[float] = (),
    writes: Sequence[float] = (),
    pauses: Sequence[float] = (),
    waits: Sequence[float] = (),
) -> LearnedTiming:
    """Of station 1; ms."""
    made = LearnedTiming(TIMING)
    for pace, times in ((READ, reads), (WRITE, writes)):
        for time in times:
            made.answered(1, pace, round(time * MS))
    for pause in pauses:
        made.paused(round(pause * MS), 0)
    made.waited([round(wait * MS) for wait in waits])
    return made


@pytest.mark.parametrize(
    ("waits", "timeout"),
    [((), None), ((100,), None), ((100, 112), 100), ((112, 100), 100), ((100, 112.1), None), ((300, 100, 305), 300)],
)
def test_two_waits_that_agree_are_a_timeout(waits: Sequence[float], timeout: int | None) -> None:
    assert learnt(waits=waits).timeout == (None if timeout is None else timeout * MS)


def test_an_answer_after_the_timeout_shows_that_there_is_none_so_short() -> None:
    for latency, timeout in ((100, 100), (100.1, 104), (105, None)):
        made = learnt(waits=(100, 104, 105))
        made.answered(1, READ, round(latency * MS))
        assert made.timeout == (None if timeout is None else timeout * MS), latency


def test_what_is_no_longer_than_an_answer_and_a_pause_is_no_wait() -> None:
    cycle = 20 * MS + 32 * TIMING.char + 11 * MS
    for elapsed, repeated, counts in (
        (cycle, False, False),
        (cycle + 1, False, True),
        (20 * MS, True, False),
        (20 * MS + 1, True, True),
    ):
        made = learnt(reads=[20], pauses=[10])
        made.unanswered(elapsed, repeated)
        assert bool(made.waits) is counts, (elapsed, repeated)
    held_back = LearnedTiming(Timing(TIMING.line, 16 * MS))
    held_back.unanswered(16 * MS - 1)
    held_back.unanswered(16 * MS)
    assert held_back.waits == (16 * MS,)


@pytest.mark.parametrize(
    ("reads", "slowest"),
    [((20,), None), ((20, 22), 22), ((20, 22, 90), 90), ((20, 21, 22, 90), 22), ((20, 90, 91, 22), 90)],
)
def test_one_answer_that_took_long_is_no_measure(reads: Sequence[float], slowest: int | None) -> None:
    limit = None if slowest is None else slowest * MS * 3 // 2 + TOLERANCE
    made = learnt(reads=reads)
    assert made.response_limit(1, READ) == limit
    assert made.response_limit(1, WRITE) is None
    assert made.response_limit(2, READ) is None
    if limit is not None:
        assert (made.in_time(1, READ, limit), made.in_time(1, READ, limit + 1)) == (True, False)


@pytest.mark.parametrize(
    ("made", "limit"),
    [
        (learnt(), 100 * MS),
        (learnt(reads=[10, 10]), 100 * MS),  # a write takes no less than a read
        (learnt(reads=[90, 90]), 135 * MS + TOLERANCE),
        (learnt(waits=[200, 200]), 160 * MS),
        (learnt(reads=[190], waits=[200, 200]), 195 * MS),  # half way from the slowest answer
        (learnt(writes=[150, 150], waits=[200, 200]), 175 * MS),
        (learnt(writes=[20, 20], waits=[200, 200]), 30 * MS + TOLERANCE),
    ],
)
def test_until_when_something_may_be_the_answer_to_a_write(made: LearnedTiming, limit: int) -> None:
    assert (made.in_time(1, WRITE, limit), made.in_time(1, WRITE, limit + 1)) == (True, False)


@pytest.mark.parametrize(
    ("pauses", "pause", "after_an_answer", "after_a_wait"),
    [
        ([10] * 4, 10, True, False),
        ([10] * 4, 13, True, False),  # a tenth and 2 ms beside
        ([10] * 4, 14, False, False),
        ([10] * 4, 97, False, False),
        ([10] * 4, 98, False, True),  # as long as the wait before
        ([10] * 4, 102, False, True),
        ([10] * 4, 105, False, False),
        ([10] * 4, 107, False, True),  # the wait, and the usual pause
        ([10] * 4, 113, False, True),
        ([10] * 4, 114, False, False),
        ([10] * 3, 110, False, False),  # too little is known
        ([10, 10, 10, 40], 100, False, False),  # it pauses as it likes
        ([10, 10, 10, 40], 40, True, False),
        ([10], 10, False, False),
    ],
)
def test_what_a_pause_behind_a_copy_says(
    pauses: Sequence[float], pause: int, after_an_answer: bool, after_a_wait: bool
) -> None:
    made, gap = learnt(pauses=pauses), 100 * MS
    assert made.pauses_after_answers(gap, pause * MS, NO_CLOCK) is after_an_answer
    assert made.pauses_after_timeouts(gap, pause * MS, NO_CLOCK) is after_a_wait
    assert not made.pauses_after_answers(gap, pause * MS, 0)  # by the clock a pause says nothing
    assert not made.pauses_after_timeouts(gap, pause * MS, 0)


def test_a_frame_long_before_the_usual_pause_is_no_request() -> None:
    assert learnt(pauses=[50] * 3).too_soon(4 * MS) == 4 * MS
    assert learnt(pauses=[50, 50, 50, 60]).too_soon(4 * MS) == 25 * MS
    assert learnt(pauses=[6] * 4).too_soon(4 * MS) == 4 * MS


def test_a_turn_is_at_least_half_an_answer_and_at_most_one_and_a_pause() -> None:
    made = learnt(reads=[20] * 4, pauses=[8, 10, 12])
    assert made.turn(1, 5 * MS, 900 * MS) == (15 * MS, (20 + 12) * MS * 5 // 4 + 5 * MS + made.margin)
    assert learnt(reads=[20], pauses=[8, 10]).turn(1, 0, 0) is None
    assert learnt(pauses=[8, 10, 12]).turn(1, 0, 0) is None
    for time in (30, 30, 60):
        made.answered(2, READ, time * MS)
        made.answered(3, READ, 90 * MS)
    assert made.turn(3, 0, 50 * MS) == made.turn(2, 0, 50 * MS)  # who takes longer than most is held to what most take


def test_a_gap_is_held_to_the_pauses_that_fit_into_it():
    """A master that asks in rounds: 10 ms from one station to the next, five seconds from round to round."""
    made = learnt(reads=[20, 20], pauses=[10, 10, 5000] * 4)
    assert made.turn(1, 0, 200 * MS)[1] < 200 * MS
    assert made.turn(1, 0, 5000 * MS)[1] > 5000 * MS
    made.unanswered(1000 * MS)
    made.unanswered(1000 * MS)
    assert made.timeout == 1000 * MS
    assert made.may_hide_a_wait(5000 * MS)
    assert not made.may_hide_a_wait(50 * MS)


def test_what_an_answer_and_a_pause_may_take_is_no_wait_of_the_master():
    made = learnt(reads=[20, 20], pauses=[10, 20, 30, 40])
    for gap in (5, 40, 60):  # less than any pause; an answer and a pause
        made.unanswered(gap * MS)
        made.unanswered(gap * MS)
    assert made.timeout is None
