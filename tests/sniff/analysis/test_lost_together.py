"""How near to each other losses must be to have one cause."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from dissectors.findings import Severity
from dissectors.tracker import Transaction, Verdict
from sniff.analysis.lost_together import LostTogether

S = 1_000_000_000


def asked(station: int, second: float, answered: bool) -> Transaction:
    start = int(second * S)
    told: dict[str, Any] = {
        "station": station, "is_passing": False, "request": int(second * 10), "start": start, "end": start + S // 100,
        "verdict": Verdict.ANSWERED if answered else Verdict.NO_RESPONSE, "response": 1 if answered else None,
    }  # fmt: skip
    return cast(Transaction, SimpleNamespace(**told))


def lost(last_answers: dict[int, int], span: int) -> list[tuple[int, ...]]:
    """Stations asked once a second in turn, of which some stop answering after some second."""
    together = LostTogether()
    for second in range(span):
        for station in (1, 2, 3, 4):
            answers = second <= last_answers.get(station, span)
            together.settle(asked(station, second + station / 10, answers))
    return [finding.stations for finding in together.findings(0, span * S)]


def test_three_in_a_sixth_of_the_time_are_lost_together() -> None:
    """Two might be by chance; a third one falls into the same part of the capture one time in 36."""
    assert lost({1: 5, 2: 5, 3: 5}, 10) == [(1, 2, 3)]


def test_two_in_a_sixth_of_the_time_may_be_chance() -> None:
    assert lost({1: 5, 2: 5}, 9) == []
    assert lost({1: 5, 2: 5}, 40) == [(1, 2)]


def test_what_is_lost_lasts_until_all_of_them_are_back() -> None:
    together = LostTogether()
    for second in range(60):
        for station in (1, 2, 3):
            together.settle(asked(station, second + station / 10, station == 3 or second < 30))
    (finding,) = together.findings(0, 60 * S)
    assert finding.last == 30 * S + S // 10
    assert finding.lasts
    for station in (1, 2):
        together.settle(asked(station, 60 + station / 10, answered=True))
        (finding,) = together.findings(0, 61 * S)
        assert finding.lasts is (station == 1)


def test_what_was_lost_while_nobody_heard_is_not_of_one_moment() -> None:
    together = LostTogether()
    for second in [*range(30), *range(150, 3000)]:
        for station in (1, 2, 3):
            together.settle(asked(station, second + station / 10, second < 30))
    (finding,) = together.findings(0, 3000 * S)
    assert finding.seen.startswith("3 stations (1, 2, 3) stopped answering within 121 s, ")


def test_of_a_log_without_times_no_moment_is_told() -> None:
    together = LostTogether(has_times=False)
    for second in range(60):
        for station in (1, 2, 3):
            together.settle(asked(station, second + station / 10, station == 3 or not 30 <= second < 40))
    (finding,) = together.findings(0, 60 * S)
    assert finding.seen.startswith("2 stations (1, 2) stopped answering at the same moment: 1 other station went on")
    assert finding.seen.endswith("they were back")


@pytest.mark.parametrize(
    ("every", "severity", "words"),
    [(60, Severity.ERROR, "together 5 times, 5"), (120, Severity.WARNING, "together twice, ")],
)
def test_the_same_stations_again_and_again_are_one_finding(every: int, severity: Severity, words: str) -> None:
    together = LostTogether()
    for second in range(300):
        for station in (1, 2, 3):
            together.settle(asked(station, second + station / 10, station == 3 or second % every < every - 8))
    together.settle(asked(1, 301, answered=True))
    together.settle(asked(2, 301, answered=True))
    (finding,) = together.findings(0, 301 * S)
    assert words in finding.seen
    assert (finding.stations, finding.severity) == ((1, 2), severity)


@pytest.mark.parametrize(("came", "stations"), [({1: 30, 2: 30, 3: 31}, (1, 2, 3)), ({1: 30, 2: 90, 3: 0}, None)])
def test_who_comes_at_one_moment_was_away_together(came: dict[int, int], stations: tuple[int, ...] | None) -> None:
    together = LostTogether()
    for second in range(120):
        for station, begin in came.items():
            together.settle(asked(station, second + station / 10, second >= begin))
    found = list(together.findings(0, 120 * S))
    assert [one.stations for one in found] == ([] if stations is None else [stations])
    assert all("at first, and together from 30" in one.seen for one in found)
