"""A master that sends by a clock: that it goes on says nothing of an answer."""

from __future__ import annotations

from collections.abc import Callable
from random import Random

import pytest

from dissectors.frame import Chunk
from dissectors.line import MS
from dissectors.n2.envelope import make_answer, make_command
from tests.dissectors.n2.heard import BEGIN, LINE, warned_of

Next = Callable[[int, int], int]
"""When the next command begins: by the begin of the one before and the end of its answer, ns."""


def told(follows: Next, silent: int, spread: int = 20) -> set[tuple[str, str]]:
    """Warnings about three stations that answer after 10 ms or some more; `silent`: whose answers are not heard."""
    dice, begin, chunks = Random(5), BEGIN, list[Chunk]()
    for turn in range(120):
        station = 1 + turn % 3
        command, answer = make_command(f"{station:02X}110103"), make_answer("0041A00000")
        end = begin + len(command) * LINE.char
        chunks.append(Chunk(end, command))
        answer_end = end + (10 + dice.randrange(spread)) * MS + len(answer) * LINE.char
        if station != silent:
            chunks.append(Chunk(answer_end, answer))
        begin = follows(begin, answer_end)
    return warned_of(chunks)


@pytest.mark.parametrize("step", [120, 160])
def test_a_station_that_is_off_is_not_there_for_a_master_with_a_clock(step: int) -> None:
    assert told(lambda begin, _end: begin + step * MS, silent=2) == {("N2005", "station 2")}
    assert told(lambda begin, _end: begin + step * MS, silent=0) == set()


@pytest.mark.parametrize("pause", [40, 80])
def test_a_master_that_goes_on_after_answers_had_one(pause: int) -> None:
    assert told(lambda _begin, end: end + pause * MS, silent=2) == {("N2015", "bus")}


def test_where_answers_come_always_after_the_same_time_no_clock_is_proved() -> None:
    assert told(lambda begin, _end: begin + 120 * MS, silent=2, spread=1) == {("N2015", "bus")}
