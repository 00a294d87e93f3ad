"""A station that is out of the ring and answers all the same."""

from __future__ import annotations

import pytest

from tests.dissectors.bacnet.ring_script import Step, data, found, poll, rounds, script, token

ASK, ANSWER = "010400050e0c0c008000011955", "010030050e0c00800001195500"


def left(*, polled: bool) -> list[Step]:
    """5 does not use its token, and 1 passes to 9 from then on; 9 asks 5, which answers."""
    steps = [*rounds(30, 1, 5, 9), (2, token(1, 5)), (25, token(1, 5)), (25, poll(1, 6)), (25, poll(1, 7))]
    steps += [(25, poll(1, 8)), (25, poll(1, 9)), (2, found(9, 1)), (2, token(1, 9)), (2, token(9, 1))]
    for _ in range(5):
        steps += [*rounds(20, 1, 9), *([(2, poll(1, 5)), (25, token(1, 9))] if polled else [(2, token(1, 9))])]
        steps += [(2, data(9, 5, ASK, expects=True)), (9, data(5, 9, ANSWER)), (2, token(9, 1))]
    return steps


@pytest.mark.parametrize("polled", [True, False])
def test_who_answers_and_takes_no_part_in_the_ring_has_left_it(polled: bool) -> None:
    read = script([*left(polled=polled), *rounds(20, 1, 9)])
    assert ("MS106", "MAC 5") in read.graves()
    assert ("though it is polled" in read.of("MS106").seen) is polled


def test_who_passes_tokens_on_again_has_not() -> None:
    back: list[Step] = [(2, poll(1, 5)), (2, found(5, 1)), (2, token(1, 5)), (2, token(5, 9)), (2, token(9, 1))]
    read = script([*left(polled=False), *rounds(3, 1, 9), *back, *rounds(20, 1, 5, 9)])
    assert "MS106" not in {one.code for one in read.findings}


def deaf(times: int, *, uses_one: bool = False) -> list[Step]:
    """40 answers the polls of 9 and is silent when it gets its token; `uses_one`: but for the first."""
    joins: list[Step] = [(2, token(1, 9)), (2, poll(9, 40)), (3, found(40, 9)), (2, token(9, 40))]
    steps = [*rounds(5, 1, 9), *joins, (2, token(40, 1))] if uses_one else []
    for _ in range(times):
        steps += [*rounds(20, 1, 9), *joins, (24, token(9, 40)), (24, poll(9, 41)), (24, token(9, 1))]
    return [*steps, *rounds(20, 1, 9)]


@pytest.mark.parametrize("latency", [0, 16.5])
def test_who_answers_polls_and_uses_no_token_was_never_in_the_ring(latency: float) -> None:
    read = script(deaf(4), latency)
    assert read.graves() == {("MS113", "MAC 40")}
    assert not {"MS105", "MS106"} & {one.code for one in read.findings}


@pytest.mark.parametrize("steps", [deaf(1), deaf(4, uses_one=True)])
def test_who_missed_one_or_used_one_is_not_told_so(steps: list[Step]) -> None:
    assert "MS113" not in {one.code for one in script(steps).findings}
