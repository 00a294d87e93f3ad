"""Guessed points beside their latest values: words of two moments are no number."""

from __future__ import annotations

from dissectors.profiles.decoding import decode
from dissectors.readings import Origin, Reading
from sniff.analysis.guessed_points import LatestGuesses, guess_of
from sniff.analysis.point_reader import Sample
from sniff.analysis.points import PointTable
from sniff.analysis.register_series import RegisterSeries


def answered(frame: int, first: int, *words: int) -> list[Sample]:
    readings = [Reading("holding", first + step, word, word, Origin.READ) for step, word in enumerate(words)]
    return [Sample(frame * 1_000_000_000, 1, value, frame) for value in decode(None, readings)]


def test_a_low_word_that_is_read_by_itself_makes_no_other_number() -> None:
    series, points = RegisterSeries(), PointTable()
    for frame in range(1, 60):
        number = 0x0002_0000 + 0x1F31 * frame
        samples = answered(frame, 0, number >> 16, number & 0xFFFF)
        series.add(samples)
        points.add(samples)
    told = LatestGuesses().of(points, series)["1", "holding/40001"]
    assert told.value == told.high == number
    alone = answered(60, 1, 0x0005)  # the low word has carried, and the high one was not asked
    series.add(alone)
    points.add(alone)
    again = LatestGuesses().of(points, series)["1", "holding/40001"]
    assert (again.value, again.low, again.high) == (told.value, told.low, told.high)
    point = points.get("1", "holding/40001")
    assert point is not None
    guess = guess_of(point, series, points)
    assert guess is not None
    assert guess.value == number
