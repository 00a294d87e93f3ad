"""Answers in the shape of requests, and requests that stand where an answer could."""

from __future__ import annotations

from dataclasses import replace

import pytest

from dissectors.frame import Flaw
from dissectors.modbus.station_record import StationRecord
from tests.dissectors.modbus.judged import findings_of, graves_of

OTHER, OTHER_VALUES = "020300000001", "0203020007"
READ, VALUES = "010300100002", "01030400070008"


@pytest.fixture
def bus(paper_bus):
    return paper_bus()


def well(bus, count=4):
    for _ in range(count):
        bus.exchange(OTHER, OTHER_VALUES).exchange(READ, VALUES)
    return bus


@pytest.mark.parametrize(
    ("asked", "answer", "words"),
    [
        ("050300100001", "050001", "function 0x00 instead of 0x03 or 0x83"),
        ("050300100001", "054301", "function 0x43 instead of 0x03 or 0x83"),
        ("0510001000010200ff", "0506001000ff", "function 0x06 instead of 0x10 or 0x90"),
        ("050300100002", "050303000700", "3 data octets for 2 registers asked for, expected 4"),
        ("050300100002", "05030000070008", "9 octets where its own count makes it 8"),
        ("050300100002", "0503000400070008", "10 octets where its own count makes it 8"),
        ("050400100002", "05050400070008", "function 0x05 instead of 0x04 or 0x84"),
        ("050300100002", "050304015401", "8 octets where its own count makes it 9"),
        ("050600100065", "05060065", "6 octets where its own count makes it 8"),
        ("050600100065", "050602", "5 octets where its own count makes it 8"),
    ],
)
def test_an_answer_in_the_shape_of_a_request_does_not_fit(bus, asked, answer, words):
    bus.line = "9600,8N1"
    well(bus)
    for _ in range(5):
        bus.exchange(OTHER, OTHER_VALUES).exchange(asked, answer, answer=20)
    if "own count" in words or "0x05 instead" in words:  # the framer says how long it should have been
        bus.events[:] = [
            replace(one, expected=8) if one.octets[:-2] == bytes.fromhex(answer) else one for one in bus.events
        ]
    assert graves_of(bus) == {("MB010", "station 5")}
    assert words in next(one.seen for one in findings_of(bus) if one.code == "MB010")


def test_a_function_of_makers_that_is_asked_is_no_answer_to_what_was_asked_before(bus):
    """The tap missed the answer to the read; the next request is prompt."""
    well(bus)
    for _ in range(4):
        bus.exchange("01410001", "0141000100ff")
    bus.exchange(OTHER, OTHER_VALUES).say(READ).exchange("01410001", "0141000100ff", pause=30).exchange(READ, VALUES)
    assert bus.run().verdicts.count("no-response") == 1
    assert graves_of(bus) == set()


WRITE = "0306000500{:02x}"


def late_confirmations(bus, rounds=8, answers=True):
    """Station 3 confirms each write 10 ms into the wait for station 1, or its master repeats it there by itself."""
    for value in range(rounds):
        bus.exchange(OTHER, OTHER_VALUES).say(WRITE.format(value), 60).say(READ, 1000).say(WRITE.format(value), 10)
        if answers:
            bus.say(VALUES, 8)
    return bus


def test_a_late_confirmation_in_the_wait_for_another_station_is_late(bus):
    late_confirmations(bus).exchange(OTHER, OTHER_VALUES)
    assert graves_of(bus) == {("MB103", "station 3")}


def test_a_dead_station_that_is_written_to_again_is_not_late(bus):
    """The answers of station 1 are not heard here, and the master goes on at once."""
    late_confirmations(bus, answers=False).exchange(OTHER, OTHER_VALUES, pause=1000)
    assert ("MB103", "station 3") not in graves_of(bus)


def test_the_second_of_two_that_answer_a_read_of_address_0_answers_not_twice(bus):
    for value in range(6):
        bus.exchange("000300200001", f"0a03020{value:x}07", pause=200).say(f"0c03020{value:x}07", 8)
    assert set(bus.run().verdicts) == {"answered", "unsolicited"}
    assert graves_of(bus) == {("MB017", "master")}
    assert "stations 10, 12 answered" in next(one.seen for one in findings_of(bus) if one.code == "MB017")


def test_another_interface_behind_function_43_may_take_long(bus):
    for value in range(6):
        bus.exchange(f"012b0d0107{value:02x}", f"012b0d0107{value:02x}0304", answer=400, pause=900)
        bus.exchange(OTHER, OTHER_VALUES)
    assert graves_of(bus) == set()


@pytest.mark.parametrize("answer", [115, 240])
def test_bits_whose_answer_looks_like_a_request_may_take_long(bus, answer):
    """Twenty coils from 0310 on: request and answer have eight octets each and could be either."""
    bus.exchange("010600010002", "010600010002", answer=answer - 5)
    for value in range(4):
        bus.exchange("010103100014", f"010103f601{value:02x}", answer=answer).exchange(OTHER, OTHER_VALUES)
    assert set(bus.run().verdicts) == {"answered"}
    assert graves_of(bus) == set()


def test_bits_of_a_station_that_is_not_there_are_not_its_answers(bus):
    for _ in range(4):
        bus.say("010103100014").say("010103300014", 300).exchange(OTHER, OTHER_VALUES, pause=300)
    assert graves_of(bus) == {("MB001", "station 1")}


def test_a_value_sent_for_ever_is_not_answered_twice(bus):
    """Beside it others are written to now and then, with a longer pause."""
    for round_ in range(8):
        bus.say(f"00060003{round_:04x}", 30)
        for turn in range(6):
            bus.exchange("011613067f7126ff", "011613067f7126ff", answer=6, pause=200 if not turn else 7)
    assert graves_of(bus) == set()


def test_a_confirmation_that_was_cut_short_is_no_echo_where_reads_have_none(bus):
    well(bus, 6)
    for value in range(4):
        bus.exchange(OTHER, OTHER_VALUES).say(WRITE.format(value)).cut(WRITE.format(value), 5, gap=0.5)
    bus.exchange(OTHER, OTHER_VALUES, pause=300)
    assert {subject for _, subject in graves_of(bus)} == {"station 3"}
    assert "echo" not in bus.run().verdicts


def test_the_begin_of_a_confirmed_request_behind_its_confirmation_is_no_request(paper_bus):
    bus = paper_bus(latency=16_000_000)
    well(bus, 6)
    for value in range(5):
        bus.exchange(OTHER, OTHER_VALUES, pause=60)
        bus.exchange(WRITE.format(value), WRITE.format(value), answer=9).cut(WRITE.format(value), 5, gap=0.0)
    bus.exchange(OTHER, OTHER_VALUES, pause=300)
    assert not any(subject == "master" for _, subject in graves_of(bus))


def test_a_repeat_that_could_be_an_answer_is_no_late_copy(bus):
    """Ten inputs from 0300 on, asked twice; the first try is answered when the second has come."""
    for _ in range(4):
        bus.exchange(OTHER, OTHER_VALUES).say("01020300000a").say("01020300000a", 500).say("01020255 02", 4)
    assert bus.run().verdicts.count("late") + bus.run().verdicts.count("retry") == 4


def test_the_echo_of_a_write_comes_when_echoes_of_reads_do(paper_bus):
    """0.4 ms are more than 3.5 characters of 115200 Bd, where a station could answer."""
    bus = paper_bus("115200,8N1")
    for value in range(6):
        bus.say(READ).say(READ, 0.4).say(VALUES, 8)
        bus.say(WRITE.format(value)).say(WRITE.format(value), 0.4).say(WRITE.format(value), 9)
    assert set(bus.run().verdicts) == {"echo", "answered"}
    assert graves_of(bus) == set()


@pytest.mark.parametrize(
    ("asked", "answer", "hit"),
    [
        (WRITE, WRITE, ("0106000900{:02x}", "0106000900{:02x}")),
        ("034100{:02x}", "034100{:02x}0102", (READ, VALUES)),
        ("03160004{:04x}0025", "03160004{:04x}0025", (READ, VALUES)),
    ],
)
def test_whatever_is_confirmed_late_in_the_wait_for_whatever_is_late(bus, asked, answer, hit):
    for value in range(8):
        bus.exchange(OTHER, OTHER_VALUES).say(asked.format(value), 60).say(hit[0].format(value), 800)
        bus.say(answer.format(value), 10).say(hit[1].format(value), 8)
    bus.exchange(OTHER, OTHER_VALUES)
    assert graves_of(bus) == {("MB103", "station 3")}


@pytest.mark.parametrize("timeout", [40, 300])
def test_two_dead_stations_that_are_written_to_in_turns_are_dead(bus, timeout):
    for _ in range(8):
        bus.exchange(OTHER, OTHER_VALUES).say("030600050007", 60).say("010600090007", timeout)
        bus.say("030600050007", timeout).say("010600090007", timeout)
        bus.exchange(OTHER, OTHER_VALUES, pause=timeout)
    assert graves_of(bus) >= {("MB001", "station 1"), ("MB001", "station 3")}


def test_the_first_frame_of_a_capture_may_be_a_write_that_is_confirmed_late(bus):
    for number in range(5):
        bus.say("0306000500ff", 900).say(OTHER, 1000).say("0306000500ff", 10)
        bus.say(f"020302{number:04x}", 20)
    assert graves_of(bus) == {("MB103", "station 3")}


def test_a_makers_answer_after_all_waiting_is_over_leaves_open_what_it_is(bus):
    for value in range(4):
        bus.exchange("020300000002", "020304000700ff").say(f"01410603450{value:x}", 150)
        bus.say(f"01410613450{value:x}4a564a56", 6000)
    assert {code for code, _ in graves_of(bus)} == set()
    assert "MB403" in {one.code for one in findings_of(bus)}


def test_a_makers_request_every_few_seconds_that_nobody_answers_stays_unanswered(bus):
    for value in range(6):
        bus.say(f"01410603450{value % 2:x}", 6000)
    bus.exchange("020300000002", "020304000700ff")
    assert graves_of(bus) == {("MB001", "station 1")}


def test_an_answer_is_explained_once_though_two_ways_explain_it() -> None:
    record = StationRecord()
    for no in range(1, 4):
        record.damaged.add(no, no)
    for flaw in (Flaw.LAST_MISSING, Flaw.FIRST_SPOILT):
        for no in range(1, 4):
            record.flaw(flaw).add(no, no)
    assert record.explained == record.damaged.count == 3
