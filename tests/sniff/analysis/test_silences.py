"""Silences of a bus: over a hole nothing is known, whenever the rows that it ended are told of."""

from __future__ import annotations

import numpy as np
import pytest

from dissectors.frame import Noise, Place, Reason
from dissectors.line import NS_PER_S
from sniff.analysis.silences import Silences

MS = NS_PER_S // 1000
EVERY = 100 * MS


def _row(silences: Silences, begin: int, by_columns: bool) -> None:
    if by_columns:
        silences.take(np.array([begin]), np.array([begin + MS]), np.array([False]))
    else:
        silences.see(Noise(b"1", begin, begin + MS, Place.BETWEEN, Reason.NO_FRAME), False)


@pytest.mark.parametrize("by_columns", [False, True])
@pytest.mark.parametrize("is_hole", [False, True])
def test_rows_that_a_hole_ended_do_not_close_it(is_hole: bool, by_columns: bool) -> None:
    silences = Silences()
    _row(silences, 0, False)
    for number in range(1, 100):
        _row(silences, number * EVERY, by_columns)
    if is_hole:
        silences.miss(99 * EVERY + 50 * MS)
    _row(silences, 99 * EVERY + 20 * MS, by_columns)  # ended by it, and told of later
    for number in range(100):
        _row(silences, 60 * NS_PER_S + number * EVERY, by_columns)
    assert bool(silences.whole()) != is_hole


@pytest.mark.parametrize("by_columns", [False, True])
def test_a_silence_that_lasts_is_told_of_a_bus_that_is_listened_to(by_columns: bool) -> None:
    silences = Silences()
    for number in range(100):
        _row(silences, number * EVERY, number > 0 and by_columns)
    last = silences.now
    assert silences.lasting(last + 59 * NS_PER_S) is None
    told = silences.lasting(last + 150 * NS_PER_S)
    assert told is not None
    assert (told.code, told.first, told.last, told.lasts) == ("LN304", last, last + 150 * NS_PER_S, True)
    assert told.seen.startswith("not one octet for 150 s by now")
    _row(silences, last + 150 * NS_PER_S, by_columns)  # it was silent before
    assert silences.lasting(silences.now + 290 * NS_PER_S) is None
    assert silences.lasting(silences.now + 310 * NS_PER_S) is not None
    silences.miss(silences.now + NS_PER_S)
    assert silences.lasting(silences.now + 3600 * NS_PER_S) is None


def test_of_a_bus_that_hardly_spoke_silence_says_nothing() -> None:
    silences = Silences()
    for number in range(40):
        _row(silences, number * EVERY, by_columns=False)
    assert silences.lasting(silences.now + 3600 * NS_PER_S) is None


@pytest.mark.parametrize(("apart", "is_told"), [(3600, True), (600, False)])
def test_a_night_has_more_silences_than_an_hour(apart: int, is_told: bool) -> None:
    """Twelve, no two alike: the master stopped each time, or it is the way of the bus."""
    silences, now = Silences(), 0
    for number in range(13):
        starts = now + np.arange(0, apart * NS_PER_S, NS_PER_S)
        if not number:
            _row(silences, 0, by_columns=False)
            starts = starts[1:]
        silences.take(starts, starts + MS, np.zeros(len(starts), bool))
        now = silences.now + (10 + 17 * (number * 7 % 12)) * NS_PER_S
        silences.take(np.array([now]), np.array([now + MS]), np.array([False]))
        now += NS_PER_S
    assert bool(silences.whole()) is is_told
    if is_told:
        assert all(" … (" in one.seen for one in silences.findings())


@pytest.mark.parametrize("by_columns", [False, True])
@pytest.mark.parametrize(("low", "words"), [((), ""), ((100,), "1 of the 2 begin"), ((100, 200), "each begins")])
def test_a_silence_that_begins_with_a_break_is_not_the_masters(
    low: tuple[int, ...], words: str, by_columns: bool
) -> None:
    silences = Silences()
    for number in range(300):
        _row(silences, number * EVERY + number // 100 * (20 + number // 200) * NS_PER_S, number > 0 and by_columns)
        if number + 1 in low:
            silences.see_break(number + 1)
    (told,) = silences.findings()
    assert (words in told.seen) if words else ("break" not in told.seen)
    assert ("held low" in told.means) is bool(low)
