"""What a long capture holds too often to be kept is still judged, and counted no smaller than it is."""

from __future__ import annotations

import pytest

from dissectors.line import Timing
from dissectors.modbus import bus_record, rules_bus
from dissectors.modbus.bus_record import BusRecord
from dissectors.modbus.impossible import Impossible
from tests.dissectors.modbus.judged import findings_of

READ, VALUES = "010300000001", "0103020007"
OTHER, OTHER_VALUES = "020300000001", "0203020007"
ABSENT = "090300000001"


@pytest.fixture
def bus(paper_bus):
    return paper_bus()


def two_masters(bus):
    """A polling in which a second master asks before the first one has its answer."""
    for _ in range(12):
        bus.exchange(READ, VALUES, answer=20).exchange(OTHER, OTHER_VALUES, answer=20)
    for gap in (2, 5, 9, 13, 16):
        bus.say(READ, 40).say(OTHER, gap).say(VALUES, 20).say(OTHER_VALUES, 20)
    return bus


def masters_of(bus):
    (found,) = (one.seen for one in findings_of(bus) if one.code == "MB203")
    return found


def test_a_second_master_is_found_however_long_the_first_one_waited_for_an_absent_station(bus):
    bus.exchange(READ, VALUES, answer=20)
    for _ in range(300):
        bus.say(ABSENT, 40).exchange(READ, VALUES, answer=20, pause=200)
    assert masters_of(two_masters(bus)).startswith("5 requests came while another one waited")


def test_what_is_not_kept_is_told_as_more(bus, monkeypatch):
    monkeypatch.setattr(bus_record, "_HASTY_KEPT", 4)
    assert masters_of(two_masters(bus)).startswith("over 4 requests came while another one waited")


@pytest.mark.parametrize("frames", [4_000, 50_000])
def test_a_habit_stays_one_in_a_long_capture(frames):
    seen = BusRecord(Timing())
    seen.frames["master"] = frames
    for no in range(2, frames, 4):
        seen.too_close("master", no, no - 1, no)
    (found,) = (one for one in rules_bus.judge(seen, None) if one.code == "MB301")
    assert found.count == frames // 4
    assert found.last == frames - 2


def test_the_commonest_words_are_the_commonest_of_all():
    impossible = Impossible()
    for no in range(16):
        impossible.add(f"{no} is too many", no)
    for no in range(100):
        impossible.add("3 is too many", no)
    assert impossible.words.most_common(1) == [("3 is too many", 101)]


def test_a_pair_once_known_stays_known():
    seen = BusRecord(Timing())
    for unit in range(301):
        seen.pair((1, unit)).add(unit)
    seen.pair((1, 7)).add(400)
    assert seen.pairs[1, 7].count == 2
    assert seen.unasked.count == 1
