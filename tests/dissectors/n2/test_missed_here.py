"""What this tap alone misses accuses nobody: commands, answers, and a line on which each command comes twice."""

from __future__ import annotations

from functools import partial

import pytest

from dissectors.line import MS
from dissectors.tracker import Verdict
from tests.dissectors.n2.test_tracker import READ, READ_OTHER, VALUE, Bus
from tests.faults.buses import n2
from tests.faults.case import Case
from tests.faults.judged import run
from tests.faults.line_faults import paused

ANOTHER = b"A0042920000F1\r"


def exchanges(bus: Bus, count: int, pause: int = 60 * MS) -> None:
    for _ in range(count):
        bus.say(READ, after=pause)
        bus.say(VALUE, after=12 * MS)


@pytest.mark.parametrize(("after", "verdict"), [(30, Verdict.ANSWERED_TWICE), (84, Verdict.UNSOLICITED)])
def test_a_second_answer_that_a_missed_command_may_have_asked_for_is_unasked(after: int, verdict: Verdict) -> None:
    bus = Bus()
    exchanges(bus, 4)
    bus.say(ANOTHER, after=after * MS)  # 60 ms of pause, 14 ms of command, 12 ms of station
    assert bus.verdicts()[-1] is verdict


def test_a_station_that_answered_many_later_commands_owes_nothing() -> None:
    bus = Bus()
    exchanges(bus, 2)
    bus.say(READ, after=60 * MS)  # its answer is missed
    exchanges(bus, 8)
    bus.say(ANOTHER, after=30 * MS)
    assert Verdict.LATE not in bus.verdicts()


def relayed(bus: Bus, count: int, distance: int) -> None:
    for _ in range(count):
        for command in (READ, READ_OTHER):
            bus.say(command, after=60 * MS)
            bus.say(command, after=distance)
            bus.say(VALUE, after=20 * MS)


@pytest.mark.parametrize("distance", [8 * MS, 45 * MS])
def test_each_command_twice_at_one_distance_is_given_again(distance: int) -> None:
    bus = Bus()
    relayed(bus, 4, distance)
    verdicts = bus.verdicts()
    assert verdicts.count(Verdict.ECHO) == 6
    assert verdicts.count(Verdict.NO_RESPONSE) == 2  # until the distance is known


@pytest.mark.parametrize("distances", [[8, 30, 60] * 4, [250] * 12])
def test_repeats_at_other_distances_or_after_a_timeout_are_repeats(distances: list[int]) -> None:
    bus = Bus()
    for distance in distances:
        relayed_once(bus, distance * MS)
    assert Verdict.ECHO not in bus.verdicts()


def relayed_once(bus: Bus, distance: int) -> None:
    bus.say(READ, after=60 * MS)
    bus.say(READ, after=distance)
    bus.say(VALUE, after=20 * MS)


def test_a_master_without_answer_is_no_relay() -> None:
    """A tool that asks absent stations twice each, soon."""
    bus = Bus()
    for _ in range(6):
        for command in (READ, READ_OTHER):
            bus.say(command, after=50 * MS)
            bus.say(command, after=50 * MS)
    assert Verdict.ECHO not in bus.verdicts()


def in_another_turn(bus: Bus) -> None:
    """The late answer to a command to 1, right behind the next one, to 16."""
    bus.say(READ, after=60 * MS)
    bus.say(READ_OTHER, after=270 * MS)
    bus.say(VALUE, after=MS)


def test_a_late_answer_does_not_teach_how_soon_another_station_answers() -> None:
    bus = Bus()
    for _ in range(2):
        for _ in range(10):
            bus.say(READ_OTHER, after=60 * MS)
            bus.say(VALUE, after=30 * MS)
        in_another_turn(bus)
    assert bus.verdicts()[-2:] == [Verdict.LATE, Verdict.OPEN]


@pytest.mark.parametrize("pauses", [((10.0, 3.2),), ()])
def test_one_pause_of_the_whole_bus_makes_no_warning_of_a_slow_station(pauses: tuple[tuple[float, float], ...]) -> None:
    """In the middle of an exchange: one answer comes after the longest wait of a master."""
    slow = partial(n2, delays={2: 300 * MS}, pause=20 * MS, timeout=800 * MS)
    outcome = run(Case("", slow, (), seconds=20, hear=partial(paused, pauses)))
    assert {one.code for one in outcome.findings} >= {"N2003", *(["N2011"] if pauses else [])}
    assert not outcome.graves
