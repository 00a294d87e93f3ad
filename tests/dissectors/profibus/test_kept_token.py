"""A master that does not pass its token on: up to the end, or until another one makes a new one."""

from __future__ import annotations

import pytest

from dissectors.profibus.telegram import token
from tests.dissectors.profibus.test_slaves import Telegrams, exchange, found, judged


def turn(master: int, to: int) -> Telegrams:
    return [*exchange(0, by=master), (1, token(to, master))]


ROUNDS = [*turn(1, 2), *turn(2, 1)] * 10
ASKS_ON = [one for at in range(600) for one in exchange(at % 2, by=1)]


def test_a_master_that_asks_on_and_passes_no_token_is_told() -> None:
    told = found(judged([*ROUNDS, *ASKS_ON]), "PB021")
    assert told is not None
    assert told.subject == "station 1"
    assert "station 2" in told.seen


@pytest.mark.parametrize(
    "heard",
    [
        [*ROUNDS, *ASKS_ON, *turn(1, 2)],  # it does in the end
        ASKS_ON,  # the only master, which passes none at all
        [*turn(1, 1) * 20, *ASKS_ON],
        [*ROUNDS, *ASKS_ON[:60]],  # not for so long
        [*ROUNDS, (1, b"\xdc\x00"), *ASKS_ON],  # perhaps a token
        [*ROUNDS, *turn(1, 2), (1, token(2, 1)), (1, token(2, 1)), *turn(1, 1), *ASKS_ON],  # the other one is gone
    ],
)
def test_others_keep_none(heard: Telegrams) -> None:
    assert found(judged(heard), "PB021") is None


def test_who_had_the_tokens_that_another_one_makes_anew() -> None:
    lost = [*turn(2, 1), *exchange(0, by=1), (200, token(2, 2)), *turn(2, 2)]
    told = found(judged([*ROUNDS, *lost * 4]), "PB013")
    assert told is not None
    assert "station 1 had the token each time" in told.seen
