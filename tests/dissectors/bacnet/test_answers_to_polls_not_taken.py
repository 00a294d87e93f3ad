"""Who polled did not take the answer: it passed the token elsewhere, or went on otherwise (MS205)."""

from __future__ import annotations

import pytest

from tests.dissectors.bacnet.ring_script import Step, data, found, poll, rounds, script, spoil, token


def _bus(*then: Step, took: float = 4, times: int = 5) -> list[Step]:
    """2 polls 8, which answers; then what is given, and the token to 1."""
    once = [*rounds(4, 1, 2), (2.0, token(1, 2)), (2.0, poll(2, 8)), (took, found(8, 2)), *then, (3.0, token(2, 1))]
    return once * times


@pytest.mark.parametrize("then", [(), ((3, data(2, 255)),), ((20, poll(2, 9)),)])
@pytest.mark.parametrize("latency", [0, 8])
def test_the_token_goes_elsewhere(then: tuple[Step, ...], latency: float) -> None:
    read = script(_bus(*then), latency)
    assert ("MS205", "MAC 2") in read.graves()
    assert read.of("MS205").seen == "5 times MAC 8 answered its poll in time, and it did not pass the token there"


def test_once_or_twice_is_noted() -> None:
    read = script(_bus(times=2))
    assert not read.graves()
    assert any(one.code == "MS205" for one in read.findings)


@pytest.mark.parametrize(
    "steps",
    [
        _bus((2, token(2, 8)), (2, token(8, 1)), (2, token(1, 2))),
        _bus((2, token(8, 1)), (2, token(1, 2))),  # the token to 8 was not heard here
        _bus((2, spoil(token(2, 8), 5)), (2, token(8, 1)), (2, token(1, 2))),
        _bus(took=31),
    ],
)
def test_it_was_taken_or_came_too_late(steps: list[Step]) -> None:
    assert not any(one.code == "MS205" for one in script(steps).findings)
