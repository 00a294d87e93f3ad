"""Answers that come again at once: of one station they are its own, of all the bus's."""

from __future__ import annotations

import pytest

from dissectors.frame import Chunk
from dissectors.line import MS, Timing
from dissectors.n2 import N2
from dissectors.n2.envelope import make_answer, make_command
from dissectors.tracker import Verdict
from sniff.engine.engine import Engine
from tests.dissectors.n2.heard import LINE, warned_of
from tests.dissectors.n2.test_doubled_answers import said

GAPS = (1.0, 12.0)  # as an echo, and later


def turns(twice: set[int], gap: float, count: int = 8, *, echoes: bool = False) -> list[Chunk]:
    """Stations 1 to 3 in turn; the answers of some come twice, `gap` ms apart."""
    made: list[tuple[float, bytes]] = []
    for no in range(count):
        for station in (1, 2, 3):
            command, answer = make_command(f"{station:02X}110103"), make_answer(f"0042{no:02X}0000")
            made += [(60, command), *[(1.0, command)] * echoes, (12, answer), *[(gap, answer)] * (station in twice)]
    return said(*made)


@pytest.mark.parametrize("gap", GAPS)
def test_answers_of_one_station_that_come_again_are_its_own(gap: float) -> None:
    assert warned_of(turns({2}, gap)) == {("N2013", "station 2")}


def test_answers_of_all_stations_that_come_again_are_the_bus() -> None:
    assert warned_of(turns({1, 2, 3}, 12.0)) == {("N2013", "bus")}


@pytest.mark.parametrize(("latency", "echoes"), [(0, False), (18, False), (0, True), (18, True)])
def test_at_once_on_the_whole_bus_they_are_echoes(latency: int, echoes: bool) -> None:
    engine, found = Engine(N2, Timing(LINE, latency * MS)), []
    for chunk in turns({1, 2, 3}, 1.0, echoes=echoes):
        found += engine.feed(chunk).transactions
    verdicts = [one.verdict for one in (*found, *engine.close().transactions)]
    unsure = 0 if echoes else 3  # until each station has shown it
    assert verdicts.count(Verdict.ANSWERED_TWICE) <= unsure
    assert verdicts.count(Verdict.ECHO) >= 24 * (1 + echoes) - 2 * unsure
