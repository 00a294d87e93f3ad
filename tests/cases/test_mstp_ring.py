"""MS/TP rings whose first reading accused somebody innocent, or missed who is at fault."""

from __future__ import annotations

import pytest

from dissectors.findings import Severity
from dissectors.frame import Flaw, Frame
from dissectors.tracker import Verdict
from tests.cases.reading import CaseReading, case, reading


def of(name: str) -> CaseReading:
    return reading(case(f"mstp/{name}.cap.txt"))


def test_a_poll_after_a_failed_token_is_not_its_use() -> None:
    read = of("late-use-of-innocent-often")
    assert read.graves() == {("MS102", "1 → 5"), ("MS105", "1 → 5")}
    assert read.health.stations[1].score == read.health.stations[8].score == 100


def test_frames_in_one_late_read_have_no_times_of_their_own() -> None:
    assert of("bunched-reads-3ms").graves() <= {("MS109", "MAC 4")}


def test_a_slave_that_speaks_unasked_has_no_token() -> None:
    read = of("slave-speaks-thrice")
    assert read.graves() == {("MS111", "MAC 200")}
    assert "3 times" in read.said("MS111")
    assert "MAC 1 had the token" in read.said("MS111")
    assert read.health.stations[1].score == 100


def test_a_station_that_is_shut_out_of_the_ring() -> None:
    read = of("rusty465-shut-out-short")
    assert read.graves() == {("MS110", "MAC 7")}
    said = read.said("MS110")
    for words in ("0.16 s", "301 rounds", "MAC 3 passes the token on to MAC 0", "never 4 … 127"):
        assert words in said


def test_a_driver_that_is_switched_off_before_its_last_octet() -> None:
    read = of("issue798-last-octet-missing")
    assert read.graves() == {("MS405", "MAC 6")}
    damaged = [row for row in read.rows if isinstance(row.event, Frame) and not row.event.ok]
    assert len(damaged) == 30
    for row in damaged:
        assert isinstance(row.event, Frame)
        assert row.event.repair is not None
        assert row.event.repair.flaw is Flaw.LAST_MISSING
        assert row.placement is not None
        assert (row.placement.source, row.placement.destination) == (6, 3)
    assert read.health.stations[3].score == 100
    assert read.health.stations[6].score < 100


def test_a_number_that_nobody_defends_is_free() -> None:
    read = of("zero-config-clean-join")
    assert {one.severity for one in read.findings} == {Severity.INFO}
    assert read.health.bus.score == 100
    assert {station.score for station in read.health.stations.values()} == {100}
    assert Verdict.NO_RESPONSE not in read.verdicts()


def test_where_no_token_was_seen_none_is_lost() -> None:
    assert of("issue415-slow-polls").graves() == {("MS109", "MAC 1"), ("MS203", "MAC 1")}


@pytest.mark.parametrize("name", ["issue916-confirmed-without-reply-bit", "mac-16-behind-router"])
def test_rings_in_order(name: str) -> None:
    assert of(name).graves() == set()
