"""Damage that all stands while an answer is overdue, too little to prove it: the bus is told of, and nobody named."""

from __future__ import annotations

import pytest

from dissectors.late_speakers import MASTER, Due, Heard, LateSpeakers, late_speakers
from dissectors.perhaps_late import PerhapsLate, perhaps_late

MS = 1_000_000
WAIT = 200 * MS


def judged(*struck: int, rounds: int = 5, turns: int = 20, answers: int = 9) -> PerhapsLate | None:
    """A master that waits for station 9 in vain once a round, then asks station 3; in which turns of a round it is
    damaged. The late answer is due in the first ten of them."""
    late, whole, now = LateSpeakers(), {MASTER: 0, "station 3": 0}, 0
    for _ in range(rounds):
        late.unanswered(9, Due(), now, now + 8 * MS, WAIT)
        now += WAIT
        for turn in range(turns):
            if turn in struck:
                late.damaged_answer(3, "station 3", b"", now, 1, is_longer=False)
            else:
                late.answered(3, "station 3", now)
                whole["station 3"] += 1
            whole[MASTER] += 1
            now += 40 * MS
    heard = {9: Heard(answers, 0, rounds)}
    assert not list(late_speakers(late, whole, heard))
    return perhaps_late(late, whole, heard)


def test_it_may_be_either() -> None:
    perhaps = judged(0)
    assert perhaps is not None
    assert (perhaps.station, perhaps.hit, perhaps.struck, perhaps.elsewhere) == (9, (3,), 5, 0)


@pytest.mark.parametrize(
    ("struck", "how"),
    [
        ((15,), {}),  # not while it is due
        ((0, 15), {}),  # as well as while it is due
        ((0,), {"rounds": 2}),  # hardly any
        ((0,), {"turns": 8}),  # it is due all the time
        ((0,), {"answers": 0}),  # it is not there
    ],
)
def test_it_is_the_senders_own(struck: tuple[int, ...], how: dict[str, int]) -> None:
    assert judged(*struck, **how) is None
