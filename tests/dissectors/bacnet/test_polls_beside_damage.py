"""Too many polls for masters are told only where the tokens are known."""

from __future__ import annotations

import pytest

from tests.dissectors.bacnet.ring_script import Step, poll, rounds, script, spoil, token


@pytest.mark.parametrize("is_heard", [True, False])
def test_a_frame_that_nobody_could_read_may_have_been_a_token(is_heard: bool) -> None:
    steps: list[Step] = [*rounds(3, 1, 5)]
    for no in range(30):
        for _ in range(12):  # of many tokens few are heard well
            steps += [(2, token(*pair) if is_heard else spoil(token(*pair), -1)) for pair in ((1, 5), (5, 1))]
        steps += [(2, poll(1, 2 + no % 2)), (25, token(1, 5)), (2, token(5, 1))]
    assert "MS201" not in {one.code for one in script(steps).findings}


def test_a_station_that_polls_in_every_turn_is_told_beside_a_little_damage() -> None:
    turn: list[Step] = [(2, poll(1, 2)), (25, poll(1, 3)), (25, token(1, 5)), (2, token(5, 1))]
    steps = [*rounds(3, 1, 5), *turn * 20, (2, spoil(token(1, 5), -1)), (2, token(5, 1)), *turn * 20]
    assert ("MS201", "MAC 1") in script(steps).graves()
