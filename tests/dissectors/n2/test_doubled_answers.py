"""A station that sends each answer twice, beside one that is not there: nothing of it came late."""

from __future__ import annotations

import pytest

from dissectors.frame import Chunk
from dissectors.line import MS
from dissectors.n2.envelope import make_answer, make_command
from tests.dissectors.n2.heard import BEGIN, LINE, findings_of, warned_of


def said(*turns: tuple[float, bytes]) -> list[Chunk]:
    """Octets, each so many ms after those before."""
    now, chunks = BEGIN, []
    for gap, octets in turns:
        now += round(gap * MS) + len(octets) * LINE.char
        chunks.append(Chunk(now, octets))
    return chunks


@pytest.mark.parametrize(("read", "value"), [("2A04", ""), ("2A120102", "00")])
def test_a_station_that_is_not_there_has_no_late_answers(read: str, value: str) -> None:
    """What 42 says twice could be the answer to 77's command, too."""
    turns: list[tuple[float, bytes]] = []
    for _ in range(8):
        turns += [(30, make_command("01110103")), (8, make_answer("0042480000"))]
        turns += [(30, make_command("2A110103")), (8, make_answer("0041A00000")), (4, make_answer("0041A00000"))]
        turns += [(30, make_command("4DF")), (250, make_command("4DF"))]
        turns += [(250, make_command(read)), (8, make_answer(value)), (4, make_answer(value))]
    told = warned_of(said(*turns, *turns[:2]))
    assert ("N2005", "station 77") in told
    assert not [one for one in told if one[0] == "N2011"]


def test_an_answer_seconds_after_a_master_that_waits_a_quarter_is_of_another() -> None:
    """The master has given up for three seconds when one answers twice for once."""
    turns: list[tuple[float, bytes]] = []
    for _ in range(4):
        turns += [(30, make_command("01110103")), (8, make_answer("0042480000"))]
    turns += [(30, make_command("4D110103")), *[(250, make_command("01110103")), (8, make_answer("0042480000"))] * 8]
    turns += [(4, make_answer("0042490000"))]
    told = {one.code for one in findings_of(said(*turns, *turns[:8]))}
    assert "N2011" not in told
    assert "N2008" in told
