"""Stations at low rates that answer sooner than 3.5 characters, as many do: too soon, but it is their answer."""

from __future__ import annotations

import pytest

from tests.dissectors.modbus.judged import findings_of, graves_of

READ, VALUES = "010300000001", "0103020007"
OTHER, OTHER_VALUES = "020300000001", "0203020007"


@pytest.fixture(params=[("1200,8N1", 22), ("2400,8N1", 10), ("4800,8N1", 5)], ids=lambda one: one[0])
def quick(request, paper_bus):
    line, answer = request.param
    bus = paper_bus()
    bus.line = line
    return bus, answer


def test_a_write_confirmed_soon_is_no_echo(quick):
    bus, answer = quick
    for value in range(8):
        bus.exchange(f"01060010{value:04x}", f"01060010{value:04x}", answer=answer, pause=400)
    assert {one.code for one in findings_of(bus)} <= {"MB301", "MB401"}
    assert set(bus.run().verdicts) == {"answered"}


def test_a_repeat_answered_soon_was_not_late(quick):
    bus, answer = quick
    for _ in range(8):
        bus.exchange(READ, VALUES, answer=answer, pause=400)
    for _ in range(3):
        bus.say(READ, 400).exchange(READ, VALUES, answer=answer, pause=1000)
    assert "MB103" not in {one.code for one in findings_of(bus)}


def test_another_function_soon_is_an_answer(quick):
    bus, answer = quick
    for _ in range(6):
        bus.exchange(OTHER, OTHER_VALUES, answer=answer, pause=100).exchange(
            READ, "0104020007", answer=answer, pause=100
        )
    assert ("MB010", "station 1") in graves_of(bus)
    assert not {"MB001", "MB207"} & {one.code for one in findings_of(bus)}


def test_a_copy_at_once_is_still_an_echo(quick):
    bus, answer = quick
    for value in range(8):
        write = f"01060010{value:04x}"
        bus.say(write, 400).say(write, 0.8).say(write, answer)
    assert "LN205" not in {one.code for one in findings_of(bus)}  # that is the line's to say
    assert bus.run().verdicts.count("echo") == 8
