"""A station that is away several times lost no single requests: no loose wire."""

from __future__ import annotations

import pytest

from tests.dissectors.modbus.judged import findings_of, graves_of

FIVE, FIVES, OTHER, OTHERS = "050300100002", "05030400070008", "020300000001", "0203020007"


@pytest.fixture
def bus(paper_bus):
    return paper_bus()


def there(bus, count: int) -> None:
    for _ in range(count):
        bus.exchange(FIVE, FIVES).exchange(OTHER, OTHERS)


def away(bus, count: int) -> None:
    for _ in range(count):
        bus.say(FIVE).exchange(OTHER, OTHERS, pause=300)


@pytest.mark.parametrize("rows", [1, 2, 3])
def test_who_is_away_for_a_while_was_off(bus, rows: int) -> None:
    there(bus, 25)
    for _ in range(rows):
        away(bus, 20)
        there(bus, 25)
    assert graves_of(bus) == {("MB003", "station 5")}
    (told,) = (one for one in findings_of(bus) if one.code == "MB003")
    assert told.count == 20 * rows
    assert ("rows of" in told.seen) is (rows > 1)


def test_who_hardly_answers_loses_requests(bus) -> None:
    for _ in range(6):
        there(bus, 3)
        away(bus, 8)
    there(bus, 3)
    assert graves_of(bus) == {("MB002", "station 5")}
