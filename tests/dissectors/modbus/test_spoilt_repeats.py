"""The repeat of a write to a station that is gone, damaged on its way: no sign of life."""

from __future__ import annotations

from tests.dissectors.modbus.judged import findings_of, graves_of

OTHER, OTHER_VALUES = "020300000001", "0203020007"
WRITE = "030600050007"
MANY, CONFIRMED = "03100005000102{:04x}", "031000050001"


def test_a_damaged_repeat_is_no_answer_of_a_station_that_fell_silent(paper_bus):
    bus = paper_bus()
    for _ in range(6):
        bus.exchange(OTHER, OTHER_VALUES).exchange(WRITE, WRITE).exchange(MANY.format(7), CONFIRMED)
    for turn in range(5):
        for said in (MANY.format(turn), WRITE):
            bus.say(said)
            (bus.damage if turn == 3 else bus.say)(said, 200)
            bus.exchange(OTHER, OTHER_VALUES, pause=200)
    assert graves_of(bus) == {("MB003", "station 3")}
    assert any((one.code, one.subject) == ("MB009", "master") for one in findings_of(bus))


def test_a_damaged_answer_that_comes_in_time_is_the_stations(paper_bus):
    bus = paper_bus()
    for _ in range(6):
        bus.exchange(OTHER, OTHER_VALUES).exchange(WRITE, WRITE)
    for turn in range(6):
        said = f"0306{turn:04x}0007"
        bus.say(said).damage(said, 8, at=3 + turn % 3).say(said, 192).say(said, 8)
    damaged = {(one.code, one.subject, one.count) for one in findings_of(bus)}
    assert ("MB005", "station 3", 6) in damaged
    assert not any(code == "MB009" for code, _, _ in damaged)
