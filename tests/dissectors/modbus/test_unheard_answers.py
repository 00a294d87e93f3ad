"""Answers that this tap misses: the master goes on as after an answer, and no station is accused."""

from __future__ import annotations

import pytest

from tests.dissectors.modbus.judged import findings_of, graves_of

UNITS = (1, 2, 3)
PAUSE, ANSWER = 40.0, 8.0


def read(unit):
    return f"{unit:02x}0300000002"


def values(unit, value=1):
    return f"{unit:02x}0304{value:04x}0002"


LASTS = 9 * 11 / 19.2  # ms that an answer takes on the line


def turns(bus, count, is_heard):
    """All stations answer; `is_heard(turn, unit)`: whether this tap hears it."""
    pause = PAUSE
    for turn in range(count):
        for unit in UNITS:
            bus.say(read(unit), pause)
            pause = PAUSE
            if is_heard(turn, unit):
                bus.say(values(unit, turn), ANSWER)
            else:
                pause = ANSWER + LASTS + PAUSE
    return bus


@pytest.mark.parametrize("latency", [0, 16_000_000], ids=["exact", "ftdi"])
def test_answers_missed_of_everybody_are_one_finding_about_the_tap(paper_bus, latency):
    bus = turns(paper_bus(latency=latency), 30, lambda turn, unit: (turn + unit) % 5 > 0)
    assert graves_of(bus) == {("MB020", "bus")}
    assert not any(" off, of" in one.means for one in findings_of(bus))


def test_a_station_that_is_never_heard_is_not_called_absent_where_nobody_waits_for_it(paper_bus):
    bus = turns(paper_bus(), 12, lambda turn, unit: unit != 2)
    assert graves_of(bus) == {("MB020", "bus")}
    assert any("to station 2;" in one.seen for one in findings_of(bus) if one.code == "MB020")
    assert all("or station 2 off" in one.means for one in findings_of(bus) if one.code == "MB020")


def test_where_nobody_is_heard_and_nobody_asked_again_it_is_told_once(paper_bus):
    bus = turns(paper_bus(), 8, lambda turn, unit: False)
    assert graves_of(bus) == {("MB020", "bus")}


def test_stray_octets_do_not_make_somebody_of_nobody(paper_bus):
    bus = paper_bus()
    for turn in range(8):
        for unit in UNITS:
            bus.say(read(unit), PAUSE if (turn, unit) != (3, 3) else 90.0)
            if (turn, unit) == (3, 2):
                bus.noise(b"\xfe\x00\xff")
    assert graves_of(bus) == {("MB020", "bus")}


def waiting(bus, count, wait, tries=1, lost=lambda turn: True):
    """Station 2 does not answer in some turns; the master waits `wait` ms, and tries so often."""
    pause = PAUSE
    for turn in range(count):
        for unit in UNITS:
            missing = unit == 2 and lost(turn)
            for _ in range(tries if missing else 1):
                bus.say(read(unit), pause)
                pause = wait if missing else PAUSE
            if not missing:
                bus.say(values(unit, turn), ANSWER)
    return bus


def test_a_station_that_is_waited_for_in_vain_is_absent(paper_bus):
    assert ("MB001", "station 2") in graves_of(waiting(paper_bus(), 12, 250))


def test_answers_that_are_waited_for_are_lost(paper_bus):
    bus = waiting(paper_bus(), 40, 250, lost=lambda turn: turn % 5 == 0)
    assert graves_of(bus) == {("MB002", "station 2")}


def test_a_station_that_is_asked_again_is_absent_however_soon(paper_bus):
    assert ("MB001", "station 2") in graves_of(waiting(paper_bus(), 12, 60, tries=3))


@pytest.mark.parametrize("by_the_clock", [True, False])
def test_a_master_by_the_clock_goes_on_as_after_an_answer_where_there_is_none(paper_bus, by_the_clock):
    bus, pause = paper_bus(), PAUSE
    for turn in range(12):
        for unit, took in zip(UNITS, (8.0, 6.0, 30.0), strict=True):
            bus.say(read(unit), pause)
            left = 80.0 if by_the_clock else took + LASTS + PAUSE
            if unit != 2:
                bus.say(values(unit, turn), took)
                left -= took + LASTS
            pause = left
    assert graves_of(bus) >= ({("MB001", "station 2")} if by_the_clock else {("MB020", "bus")})


@pytest.mark.parametrize("latency", [0, 16_000_000], ids=["exact", "ftdi"])
@pytest.mark.parametrize("wait", [150, 300, 1000])
@pytest.mark.parametrize("absent", UNITS)
def test_a_master_that_asks_in_rounds_waits_for_an_absent_station(paper_bus, latency, wait, absent):
    """Every five seconds it asks each once: the pause between rounds is no pause after an answer within one."""
    bus, pause, round_ = paper_bus(latency=latency), PAUSE, 0.0
    for turn in range(20):
        for unit in UNITS:
            bus.say(read(unit), pause)
            if unit != absent:
                bus.say(values(unit, turn), ANSWER)
            pause = PAUSE if unit != absent else float(wait)
            round_ += pause
        pause, round_ = pause + 5000.0 - round_, 0.0
    assert graves_of(bus) == {("MB001", f"station {absent}")}
