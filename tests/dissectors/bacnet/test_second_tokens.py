"""A token that was given up and is used after all: within which time, and how long two tokens are known of then."""

from __future__ import annotations

import pytest

from dissectors.bacnet.envelope import frame
from dissectors.bacnet.limits import T_NO_TOKEN
from dissectors.bacnet.ring_tally import RingTally
from dissectors.bacnet.second_tokens import T_LATE_USE, GivenUp, SecondTokens
from dissectors.frame import Check, FoundBy, Frame
from dissectors.line import LineSettings, Timing
from tests.dissectors.bacnet.ring_script import MS

SENT, LASTS = 7_000 * MS, MS


def tokens() -> SecondTokens:
    made = SecondTokens(RingTally(Timing(LineSettings(38400))))
    made.given_up = GivenUp(5, 3, SENT)
    return made


def used(tokens: SecondTokens, after: int, source: int = 5) -> bool:
    start = SENT + after
    sent = Frame("mstp", frame(1, 9, source), start, start + LASTS, Check.GOOD, FoundBy.LENGTH)
    return tokens.uses_given_up(1, sent, source, doubt=False)


@pytest.mark.parametrize("after", [2 * MS, T_LATE_USE])
def test_two_tokens_are_known_of_from_the_late_use_on(after: int) -> None:
    second = tokens()
    assert not second.are_known(SENT + after)
    assert used(second, after)
    assert second.of == 5
    last = SENT + after + LASTS + 2 * T_NO_TOKEN
    assert (second.are_known(last - 1), second.are_known(last)) == (True, False)
    assert not used(second, after + MS)  # its cause is told once


def test_whose_it_was_not_and_what_comes_too_late_is_no_late_use() -> None:
    assert not used(tokens(), T_LATE_USE + 1)
    assert not used(tokens(), 2 * MS, source=3)


def test_the_token_that_is_followed_ends_the_other_one() -> None:
    second = tokens()
    second.passed(3)
    assert second.given_up is not None
    second.passed(5)
    assert second.given_up is None
    second.of = 5
    second.passed(3)
    assert second.of == 5
    second.passed(5)
    assert second.of is None
