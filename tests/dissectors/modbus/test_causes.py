"""What is always the same is said as what it is; nobody is accused of what something else explains."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import pytest

from dissectors.findings import Severity
from dissectors.frame import Flaw
from dissectors.modbus.garbage import Garbage, slower_by, text_of, whole_runs
from dissectors.modbus.header import peek_rtu
from dissectors.modbus.rules import RULES
from dissectors.modbus.text import text
from tests.dissectors.modbus.judged import findings_of, graves_of, say_damaged

READ, VALUES = "010300000001", "0103020007"
OTHER, OTHER_VALUES = "020300000001", "0203020007"
SLOW = bytes.fromhex("80f8007880f878807800f880")  # characters whose bits are four long


@pytest.fixture
def bus(paper_bus):
    return paper_bus()


def quiet(bus, count=8):
    """Another station that is well."""
    for _ in range(count):
        bus.exchange(OTHER, OTHER_VALUES)
    return bus


@pytest.mark.parametrize(
    ("flaw", "code"),
    [
        (Flaw.CHECK_SWAPPED, "MB011"),
        (Flaw.FIRST_MISSING, "MB012"),
        (Flaw.FIRST_SPOILT, "MB012"),
        (Flaw.LAST_MISSING, "MB006"),
        (Flaw.LAST_TWO_MISSING, "MB006"),
    ],
)
def test_damage_that_is_always_the_same_is_a_finding_of_its_own(bus, flaw, code):
    quiet(bus)
    for value in range(6):
        say_damaged(bus.say(READ, 200), f"01030200{value:02x}", flaw)
    bus.say(OTHER, 200)
    assert graves_of(bus) == {(code, "station 1")}
    assert any(flaw.value in one.seen for one in findings_of(bus) if one.code == code) or code == "MB006"


def test_the_values_of_a_repaired_frame_are_shown_and_marked(bus):
    frame = say_damaged(bus.say(READ), VALUES, Flaw.CHECK_SWAPPED).events[-1]
    header = peek_rtu(frame)
    assert (header.ok, header.source, header.error) == (False, 1, "check octets swapped")
    line = text(frame, header, header.role)
    assert "1 register: 7" in line
    assert "[repaired: check octets swapped]" in line


def test_damage_without_a_system_stays_damage(bus):
    for value in range(8):
        quiet(bus, 1).say(READ, 200).damage(f"01030200{value:02x}", at=3 + value % 4)
    assert graves_of(bus) == {("MB005", "station 1")}


def test_damage_in_one_stretch_is_nobodys_own(bus):
    """What the master repeats into one disturbance says no more than a single try."""
    quiet(bus)
    for value in range(8):
        bus.say(READ, 200).damage(f"01030200{value:02x}", at=3 + value % 4)
    assert graves_of(bus) == {("MB007", "bus")}


def test_the_same_octets_every_time_are_no_second_station(bus):
    quiet(bus)
    for _ in range(5):
        bus.say(READ, 200).noise(b"\xa1\x0c\x5e\x77\x12\x90\x33\x08")
    assert graves_of(bus) == {("MB014", "station 1")}


def test_long_bits_name_the_baud_rate(bus):
    quiet(bus)
    for turn in range(4):
        bus.say(READ, 200).noise(SLOW[turn:] + SLOW[:turn])
    (finding,) = (one for one in findings_of(bus) if one.code == "MB014")
    assert finding.severity is Severity.ERROR
    assert "about 4800 Bd, not 19200" in finding.seen


def with_parity(text, odd=0):
    return bytes(octet | (octet.bit_count() & 1 ^ odd) << 7 for octet in text)


@pytest.mark.parametrize(
    ("sent", "words"),
    [
        (bytes, "it is text: “(230.0 49.9 04\\r”"),
        (with_parity, "it is text with 7 data bits and even parity: “(230.0 49.9 04\\r”"),
        (partial(with_parity, odd=1), "it is text with 7 data bits and odd parity: “(230.0 49.9 04\\r”"),
    ],
)
def test_text_in_answer_is_another_protocol(bus, sent, words):
    quiet(bus)
    for turn in range(5):
        bus.say(READ, 200).noise(sent(b"(230.0 49.9 %02d\r" % turn))
    assert graves_of(bus) == {("MB014", "station 1")}
    assert words in next(one.seen for one in findings_of(bus) if one.code == "MB014")


def test_octets_that_are_no_text():
    assert text_of([b"(230.0 49.9\r"]) is None  # too few
    assert text_of([bytes(range(64))]) is None
    assert text_of([with_parity(b"(230.0 49.9 04\r")[:-2] + b"\xa1\xa2\xa4\xa8"] * 3) is None
    assert text_of([b"(\xb2\xb3\xb0.\xb0 \xb4\xb9.9 \xb04\xad"] * 3) is None  # bit 7 is no parity


def test_nothing_that_came_begins_as_an_answer(bus):
    """A device that sends twice as fast: hardly half of its octets are heard, and other ones each time."""
    quiet(bus)
    for turn in range(5):
        bus.say(READ, 200).noise(bytes((0xE0 + turn, 0x91, 0x0C + turn, 0xF5, 0x83)))
    (finding,) = (one for one in findings_of(bus) if one.code == "MB005")
    assert finding.means.startswith("the device has another baud rate, or speaks another protocol; or noise")


def test_noise_that_differs_is_no_other_baud_rate():
    garbage = Garbage()
    for turn in range(8):
        garbage.add(bytes((turn * 37 + k * 59) & 0xFF for k in range(12)), turn)
    assert garbage.always() is None
    assert garbage.slower_by() is None


def test_runs_of_equal_bits():
    assert whole_runs(0x78) == [4, 4]
    assert slower_by([SLOW]) == 4
    assert slower_by([b"\0\0\0\0\0\0\0\0"]) is None
    assert slower_by([bytes(range(64))]) is None
    eighth = bytes.fromhex("0080000080800000")
    assert slower_by([eighth, eighth[1:], eighth[:-1]]) == 8
    assert slower_by([b"\0\0\0\0\0\0\0"] * 8) is None  # breaks
    assert slower_by([b"\x80"] * 20) is None  # a driver that rings
    assert slower_by([b"\0\x80"] * 20) is None


def test_what_was_never_a_frame_may_be_another_baud_rate(bus):
    for turn in range(12):
        bus.exchange(OTHER, OTHER_VALUES)
        bus.say(READ, 200).noise(bytes((turn * 37 + k * 59) & 0xFF for k in range(5)))
    (finding,) = (one for one in findings_of(bus) if one.code == "MB005")
    assert finding.means.startswith("the device has another baud rate")


def test_an_answer_of_another_function_is_the_stations(bus):
    for _ in range(3):
        bus.exchange(READ, "01ff01")
    assert graves_of(bus) == {("MB010", "station 1")}


def test_a_read_of_address_0_is_the_masters(bus):
    for _ in range(3):
        bus.exchange("000300000001", "0903020007")
    assert graves_of(bus) == {("MB017", "master")}
    assert any(one.next == "set the unit number in the master to 9" for one in findings_of(bus))


def test_a_byte_count_that_does_not_fit_is_the_masters(bus):
    quiet(bus)
    for _ in range(2):
        bus.exchange("01100090000202 06c4", "019003")
    assert graves_of(bus) == {("MB016", "master")}


def test_an_echo_cut_short_explains_the_silence(bus):
    for _ in range(4):
        bus.say(READ, 2000).cut(READ, 7, 0.7)
    assert {code for code, _ in graves_of(bus)} == {"MB013"}
    assert [one.cause for one in findings_of(bus) if one.code == "MB001"] == [("MB013", "bus")]


def test_requests_that_one_station_gives_back(bus):
    for _ in range(5):
        bus.exchange(OTHER, OTHER_VALUES).say(READ, 40).say(READ, 0.8).say(VALUES, 6)
    assert ("MB018", "station 1") in graves_of(bus)


def test_a_late_answer_is_not_lost_as_well(bus):
    for _ in range(4):
        bus.say(READ, 900).say(OTHER, 1000).say(VALUES, 15).say(OTHER_VALUES, 5)
    assert graves_of(bus) == {("MB103", "station 1")}


def test_a_second_answer_with_the_same_octets_may_be_a_converters(bus):
    for _ in range(4):
        bus.exchange(READ, VALUES).say(VALUES, 5)
    (finding,) = (one for one in findings_of(bus) if one.code == "MB201")
    assert finding.severity is Severity.WARNING
    assert "octet for octet" in finding.seen


def test_a_station_that_is_an_answer_behind_is_no_second_one(bus):
    bus.exchange(READ, VALUES, 30)
    for _ in range(3):  # what it says to the second request fits the first, and comes sooner than any answer did
        bus.exchange("010400000001", "0104020007", 30).exchange(READ, "0104020007", 11)
        quiet(bus)
    assert graves_of(bus) == {("MB010", "station 1")}


def test_what_comes_too_late_and_once_more_is_no_second_station(bus):
    quiet(bus)
    for _ in range(4):  # asked three times in all, answered as often
        bus.say(READ, 300).say(OTHER, 120).say(READ, 120).say(VALUES, 30).say("0103020008", 20)
    assert "MB201" not in {code for code, _ in graves_of(bus)}


def test_a_second_answer_with_other_octets_is_a_second_station(bus):
    for _ in range(4):
        bus.exchange(READ, VALUES).say("0103020008", 5)
    (finding,) = (one for one in findings_of(bus) if one.code == "MB201")
    assert finding.severity is Severity.ERROR


def test_noise_that_falls_anywhere_is_the_buses(bus):
    for turn in range(60):
        bus.exchange(OTHER, OTHER_VALUES)
        if turn % 10 == 3:
            bus.say(READ, 40).damage(VALUES, at=turn // 10).say(READ, 300).say(VALUES)
        elif turn % 10 == 7:
            bus.say(OTHER, 40).damage(OTHER_VALUES, at=turn // 10).say(OTHER, 300).say(OTHER_VALUES)
        else:
            bus.exchange(READ, VALUES)
    assert {code for code, _ in graves_of(bus)} == {"MB007"}


@pytest.mark.parametrize(("is_noisy", "root"), [(True, "MB007"), (False, "MB207")])
def test_an_answer_behind_rubbish_had_its_request(bus, is_noisy, root):
    for turn in range(80):
        for asked, value in ((OTHER, OTHER_VALUES), (READ, VALUES)):
            if turn % 8 == 3:
                bus.say(asked, 40).damage(value, at=turn // 8 % 6).say(asked, 300).say(value)
            elif turn % 16 == 13 and is_noisy:
                bus.noise(bytes((0xA7, 0x55, 0x13, 0xC9, 0x08, turn)), 40).say(value)
            elif turn % 16 == 13:
                bus.say(value, 60)
            else:
                bus.exchange(asked, value)
    assert {code for code, subject in graves_of(bus) if subject == "bus"} == {root}


def test_who_has_more_than_its_share_is_blamed(bus):
    for turn in range(60):
        bus.exchange(OTHER, OTHER_VALUES)
        if turn % 4 == 3:
            bus.say(READ, 40).damage(VALUES, at=turn // 4 % 6).say(READ, 300).say(VALUES)
        else:
            bus.exchange(READ, VALUES)
    assert {code for code, _ in graves_of(bus)} == {"MB005"}


def test_a_search_for_stations_is_one_fact(bus):
    bus.exchange(OTHER, OTHER_VALUES, pause=200)
    for unit in range(3, 30):
        bus.say(f"{unit:02x}0300000001", 200).say(f"{unit:02x}0300000001", 200)
    bus.exchange(OTHER, OTHER_VALUES, pause=200)
    assert graves_of(bus) == set()
    assert [one.code for one in findings_of(bus) if one.severity is not Severity.NOTE and "MB4" in one.code] == [
        "MB402"
    ]


def test_a_master_that_asks_two_at_once_is_one_master(bus):
    quiet(bus)
    for _ in range(8):
        bus.exchange(READ, VALUES)
    for _ in range(8):
        bus.say(READ, 40).say(OTHER, 3).say(VALUES, 6).say(OTHER_VALUES, 3)
    assert not any(one.code in ("MB203", "MB103") for one in findings_of(bus) if one.severity >= Severity.WARNING)


def test_two_masters_ask_sooner_than_anybody_can_answer(bus):
    for _ in range(12):
        bus.exchange(READ, VALUES, answer=20).exchange(OTHER, OTHER_VALUES, answer=20)
    for gap in (2, 5, 9, 13, 16):
        bus.say(READ, 40).say(OTHER, gap).say(VALUES, 20).say(OTHER_VALUES, 20)
    assert ("MB203", "bus") in graves_of(bus)


def test_reads_that_came_late_are_not_slow(bus):
    for turn in range(60):
        late = turn % 10 == 5
        bus.exchange(READ, VALUES, answer=900 if late else 10, pause=0 if turn % 10 == 6 else 100)
    assert not any(one.code == "MB101" for one in findings_of(bus))


def test_every_code_that_a_rule_explains_can_exist():
    prefixes = ("MB", "LN")
    for rule in RULES.values():
        assert all(code.startswith(prefixes) for code in rule.explains)
        assert all(code in RULES for code in rule.explains if code.startswith("MB"))
        assert rule.code not in rule.explains


def test_frames_torn_by_a_late_read_are_nobodys_damage(bus):
    for turn in range(30):
        bus.exchange(OTHER, OTHER_VALUES).exchange(READ, VALUES)
        if turn % 5 == 2:
            bus.say(READ).cut(VALUES, 4).say(READ, 60).say(VALUES)
            bus.events[-2] = replace(bus.events[-2], slack=60_000_000)
    assert graves_of(bus) == set()


def test_damage_that_seems_to_ask_a_station_nobody_knows_is_a_damaged_answer(bus):
    quiet(bus)
    for _ in range(5):
        bus.say(READ, 200).damage("300100010100", at=5)
    assert graves_of(bus) == {("MB014", "station 1")}
    assert not [one for one in findings_of(bus) if one.code in ("MB001", "MB009")]


@pytest.mark.parametrize(("left", "severity"), [(0, Severity.ERROR), (1, Severity.ERROR), (3, Severity.NOTE)])
def test_few_second_answers_of_who_leaves_more_may_be_to_tries_before(paper_bus, left, severity):
    one, values, others = "010300000002", "01030400010002", "01030400010003"
    bus = paper_bus()
    for _ in range(30):
        bus.exchange(one, values).exchange("020300000002", "02030400030004")
    for _ in range(2):
        bus.exchange(one, values).say(others, 2).exchange("020300000002", "02030400030004", pause=60)
    for _ in range(left):
        bus.say(one).exchange("020300000002", "02030400030004", pause=400)
    (finding,) = (one for one in findings_of(bus) if one.code == "MB201")
    assert finding.severity is severity
