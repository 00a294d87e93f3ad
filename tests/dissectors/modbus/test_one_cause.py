"""What has one cause is told once, and as what it is: searches, probes, relays, checks, drivers."""

from __future__ import annotations

import pytest

from dissectors.findings import Severity
from dissectors.frame import Flaw
from tests.dissectors.modbus.judged import findings_of, graves_of, say_damaged


def read(unit, first=0):
    return f"{unit:02x}03{first:04x}0002"


def values(unit, value=1):
    return f"{unit:02x}0304{value & 0xFFFF:04x}0002"


@pytest.fixture
def bus(paper_bus):
    return paper_bus()


def polls(bus, count=3, units=(1, 2), took=8.0):
    for _ in range(count):
        for unit in units:
            bus.exchange(read(unit), values(unit), took)
    return bus


# ---- searches and probes


def search(bus, last, rounds, polled=1):
    for _ in range(rounds):
        for unit in range(3, last + 1):
            polls(bus.say(read(unit)).exchange(read(1), values(1), pause=250), polled)
    return bus


def test_a_search_that_goes_on_is_told_once(bus):
    assert graves_of(search(polls(bus), 14, 2)) == set()
    assert any(one.code == "MB402" and "up to twice" in one.seen for one in findings_of(bus))


def test_stations_that_are_off_are_no_search(bus):
    for _ in range(2):
        for unit in range(1, 12):
            pause = 250 if unit > 3 or unit == 1 else 40
            bus.say(read(unit), pause) if unit > 2 else bus.exchange(read(unit), values(unit), pause=pause)
    bus.exchange(read(1), values(1), pause=250)
    assert len([one for one in graves_of(bus) if one[0] == "MB001"]) == 9


def test_what_is_only_tried_beside_polling_is_a_note(bus):
    polls(bus, 10)
    for first in range(0x100, 0x600, 0x100):
        bus.exchange(read(1, first), "018302")
    polls(bus, 10)
    probes = [one for one in findings_of(bus) if one.code == "MB008"]
    assert [(one.severity, one.count) for one in probes] == [(Severity.NOTE, 5)]


def test_what_is_polled_and_refused_is_a_warning(bus):
    for _ in range(4):
        polls(bus, 2).exchange(read(1, 0x100), "018302")
    assert graves_of(bus) == {("MB008", "station 1")}


# ---- requests that come twice


def twice(bus, count, after=60.0, units=(1, 2)):
    for _ in range(count):
        for unit in units:
            bus.say(read(unit)).say(read(unit), after).say(values(unit), 20)
    return bus


def test_a_relay_that_repeats_all_requests_accuses_nobody(bus):
    assert graves_of(twice(bus, 10)) == {("MB018", "bus")}


def test_one_station_that_needs_two_tries_is_no_relay(bus):
    for _ in range(10):
        polls(twice(bus, 1, 180.0, (2,)), 1, (1, 3))
    assert ("MB018", "bus") not in graves_of(bus)
    assert ("MB002", "station 2") in graves_of(bus)


def test_writes_that_are_given_back_whole_are_what_does_not_fit(bus):
    write = "0210001400020400010002"
    for _ in range(8):
        polls(bus.say(write).say(write, 12), 2)
    assert graves_of(bus) == {("MB010", "station 2")}


# ---- damage that is not the line's


def test_a_check_that_is_always_wrong_is_the_devices_doing(bus):
    for turn in range(12):
        polls(bus.say(read(3)).damage(values(3, turn)), 1)
    assert graves_of(bus) == {("MB021", "station 3")}


def test_the_same_answer_spoilt_alike_is_no_check_of_its_own(bus):
    for _ in range(12):
        polls(bus.say(read(3)).damage(values(3, 7)), 1)
    assert "MB021" not in {code for code, _ in graves_of(bus)}


def test_a_check_that_is_wrong_now_and_then_is_damage(bus):
    for turn in range(24):
        bus.say(read(3)).say(values(3, turn), 8) if turn % 2 else bus.say(read(3)).damage(values(3, turn), at=4)
        polls(bus, 1)
    assert graves_of(bus) == {("MB005", "station 3")}


@pytest.mark.parametrize(("good", "is_said"), [(0, True), (1, False)])
def test_where_every_answer_is_damaged_two_stations_are_thought_of(bus, good, is_said):
    for turn in range(16):
        bus.say(read(3)).damage(values(3, turn), at=2 + turn % 5)
        polls(bus, 1, (1, 2, *(3,) * good))
    means = [one.means for one in findings_of(bus) if one.code == "MB005"]
    assert ["two stations" in one for one in means] == [is_said]


def first_lost(bus, slow):
    for turn in range(8):
        for unit in (2, 3, 4):
            say_damaged(bus.say(read(unit)), values(unit, turn), Flaw.FIRST_MISSING, 5.0)
        polls(bus, 1, (1,), slow)
    return bus


def test_first_octets_lost_of_all_that_answer_soon_are_the_masters_doing(bus):
    assert graves_of(first_lost(bus, 20.0)) == {("MB012", "master")}


def test_first_octets_lost_are_the_stations_where_another_answers_as_soon(bus):
    assert graves_of(first_lost(bus, 4.0)) == {("MB012", f"station {unit}") for unit in (2, 3, 4)}


def test_requests_that_only_this_tap_hears_damaged_explain_answers_unasked(bus):
    for turn in range(12):
        polls(bus.damage(read(1), 40).say(values(1, turn), 8), 3)
    assert graves_of(bus) == {("MB022", "bus")}


def lossy_and_damaged_here(bus, lost):
    """Requests to station 1 that only this tap hears damaged; `lost` requests to station 2 stay without an answer."""
    for turn in range(12):
        polls(bus.damage(read(1), 40).say(values(1, turn), 8), 3)
        for _ in range(lost):
            polls(bus.say(read(2)).exchange(read(1), values(1), pause=250), 1)
    return bus


def test_requests_damaged_here_explain_as_few_that_are_left_unanswered(bus):
    assert graves_of(lossy_and_damaged_here(bus, 1)) == {("MB022", "bus")}
    assert any(one.cause == ("MB022", "bus") for one in findings_of(bus) if one.code == "MB002")


def test_requests_damaged_here_do_not_explain_more_losses_than_that(bus):
    assert ("MB002", "station 2") in graves_of(lossy_and_damaged_here(bus, 2))


@pytest.mark.parametrize(
    ("took", "said"),
    [((1.0, 1.0), {("MB301", "bus", Severity.NOTE)}), ((1.0, 8.0), {("MB301", "station 1", Severity.WARNING)})],
)
def test_where_all_stations_answer_too_soon_it_is_how_this_bus_speaks(bus, took, said):
    for _ in range(6):
        for unit, after in zip((1, 2), took, strict=True):
            bus.exchange(read(unit), values(unit), after)
    assert {(one.code, one.subject, one.severity) for one in findings_of(bus) if one.code == "MB301"} == said


# ---- times


def test_another_mix_of_requests_is_no_drift(bus):
    for turn in range(160):
        slow = turn % 4 < turn // 40
        bus.exchange(read(2, 0x100 * slow), values(2), 60.0 if slow else 8.0)
    assert not any(one.code == "MB102" for one in findings_of(bus))


def test_answers_to_one_request_that_come_later_and_later_drift(bus):
    for turn in range(160):
        bus.exchange(read(2), values(2), 8.0 + turn / 3)
    assert ("MB102", "station 2") in graves_of(bus)


def test_a_few_short_silences_behind_an_adapter_that_nobody_named_are_its_own(paper_bus):
    """It reads one frame late, and the next one sooner: so often as not a silence seems too short."""
    bus = paper_bus("9600,8N1")
    for turn in range(30):
        late = turn % 5 == 0
        bus.exchange("020300000001", "0203020007", answer=2.0 if late else 6.0)
    assert not any(one.code == "MB301" for one in findings_of(bus, is_told=False))
    assert any(one.code == "MB301" for one in findings_of(bus))
