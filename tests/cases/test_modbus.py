"""Modbus contents after public reports, read as their readings say."""

from __future__ import annotations

import pytest

from dissectors.findings import Severity
from dissectors.frame import Role
from dissectors.tracker import Verdict
from tests.cases.reading import CaseReading, case, reading


def read(name: str) -> CaseReading:
    return reading(case(f"modbus/{name}.cap.txt"))


@pytest.mark.parametrize("name", ["b1-other-protocol-at-2400", "b4-garbage-one-of-two-stations"])
def test_the_same_octets_every_time_are_another_baud_rate(name: str) -> None:
    made = read(name)
    assert made.graves() == {("MB014", "station 1")}
    assert "always the same 15 octets" in made.said("MB014")
    assert "about 2400 Bd" in made.said("MB014")
    assert made.said("MB202") == ""


def test_an_answer_with_another_function_code_is_an_answer_that_does_not_fit() -> None:
    made = read("c1-answer-with-function-FF")
    assert made.verdicts() == [Verdict.ANSWERED] * 4
    assert made.graves() == {("MB010", "station 85")}
    assert "function 0xFF instead of 0x03 or 0x83" in made.said("MB010")
    assert {row.header.kind for row in made.rows if row.header is not None} == {
        "read-holding-registers",
        "function-0xFF",
    }


def test_swapped_check_octets_are_no_noise() -> None:
    made = read("d1-crc-octets-swapped")
    assert made.graves() == {("MB011", "station 1")}
    assert {row.header.error for row in made.rows if row.header is not None} == {None, "check octets swapped"}


def test_reads_of_address_0_name_the_station_that_answers() -> None:
    made = read("e1-reads-to-address-0")
    assert made.verdicts() == [Verdict.ANSWERED] * 5
    assert {one.station for one in made.transactions} == {10}
    assert made.graves() == {("MB017", "master")}
    assert "set the unit number in the master to 10" in made.said("MB017")


def test_vendor_functions_in_one_read_are_pairs() -> None:
    made = read("f1-vendor-function-glued")
    assert made.verdicts() == [Verdict.ANSWERED] * 5
    assert made.graves() == set()


def test_a_late_answer_is_not_lost_as_well() -> None:
    made = read("g1-late-answers")
    assert made.graves() == {("MB103", "station 3")}
    assert made.said("MB002") == ""
    assert [one.station for one in made.transactions if one.verdict is Verdict.LATE] == [3] * 4
    assert not any("without answer" in reason for reason in made.health.stations[3].reasons)


def test_the_begin_of_a_request_directly_behind_it_is_an_echo_cut_short() -> None:
    made = read("h1-echo-cut")
    errors = {one.code for one in made.findings if one.severity is Severity.ERROR}
    assert errors == {"MB013"}
    assert {row.placement.role for row in made.rows if row.placement is not None} == {Role.REQUEST}
    assert made.said("MB005") == ""


def test_a_byte_count_that_does_not_fit_is_the_masters() -> None:
    made = read("l1-write-count-does-not-fit")
    assert made.graves() == {("MB016", "master")}
    assert "byte count 2 for 2 registers" in made.said("MB016")
    assert made.said("MB008") == ""


def test_a_vendor_function_may_take_two_seconds_and_a_half() -> None:
    made = read("t1-vendor-answer-after-2500ms")
    assert made.verdicts() == [Verdict.ANSWERED] * 3
    assert made.graves() == set()


def test_a_confirmation_after_320_ms_is_an_answer() -> None:
    made = read("u1-slow-echo-320ms")
    assert made.verdicts() == [Verdict.ANSWERED] * 12
    assert made.graves() == set()
