"""Whether a master sends by the clock, told from its turns."""

from __future__ import annotations

from collections.abc import Iterable
from random import Random

import pytest

from dissectors.line import MS
from dissectors.rhythm import TURNS_KEPT, Rhythm


def rhythm(turns: Iterable[tuple[float, float]]) -> Rhythm:
    """`turns`: cycle and answer, ms."""
    made = Rhythm()
    made.turns.extend((round(cycle * MS), round(answer * MS)) for cycle, answer in turns)
    return made


def answers(spread: float, count: int = TURNS_KEPT) -> list[float]:
    """How long answers took, ms."""
    dice = Random(7)
    return [20 + spread * dice.random() for _ in range(count)]


@pytest.mark.parametrize(
    ("turns", "is_by_the_clock"),
    [
        ([(100, answer) for answer in answers(30)], True),
        ([(answer + 60, answer) for answer in answers(30)], False),
        ([(100 + 2 * (at % 2), answer) for at, answer in enumerate(answers(30))], True),  # a clock of its own jitter
        ([(100 + 9 * (at % 2), answer) for at, answer in enumerate(answers(30))], False),
        ([(400 if at % 12 == 0 else 100, answer) for at, answer in enumerate(answers(30))], True),  # a few are others
        ([(100, answer) for answer in answers(1)], False),  # both fit
        ([(100, 20 + answer) for answer in (0, 1.99) * 32], False),
        ([(100, 20 + answer) for answer in (0, 2) * 32], True),  # answers differ enough to tell
        ([(100 + 2 * (at % 2), 20 + answer) for at, answer in enumerate((0, 8) * 32)], True),  # four times steadier
        ([(100 + 2 * (at % 2), 20 + answer) for at, answer in enumerate((0, 7.99) * 32)], False),
        ([(100, answer) for answer in answers(30, count=15)], False),
        ([(100, answer) for answer in answers(30, count=16)], True),
        ([], False),
    ],
)
def test_a_clock_is_told_by_steady_cycles_where_answers_are_not(
    turns: list[tuple[float, float]], is_by_the_clock: bool
) -> None:
    assert rhythm(turns).is_by_the_clock is is_by_the_clock


def test_the_newest_turns_are_told_of() -> None:
    waits, ticks = [(answer + 60, answer) for answer in answers(30)], [(100, answer) for answer in answers(30)]
    assert rhythm([*waits, *ticks]).is_by_the_clock
    assert not rhythm([*ticks, *waits]).is_by_the_clock
