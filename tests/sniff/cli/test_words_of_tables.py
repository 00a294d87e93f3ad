"""What tables and pages say of times, stations and silence agrees with what `check` says of them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from dissectors.meaning import Meaning
from sniff.cli import main

CAPTURES = Path(__file__).parents[3] / "captures"


def said(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    assert main([*words]) in (0, 1)
    return capsys.readouterr().out


def test_an_adapter_without_delay_is_said_to_be_taken_as_exact(capsys: pytest.CaptureFixture[str]) -> None:
    page = said(capsys, "info", f"{CAPTURES}/devices/bacnet-three-objects.cap.txt")
    assert "times are taken as exact (assumed)" in page
    assert "up to 0.00 ms" not in page


def test_one_frame_is_one_frame(capsys: pytest.CaptureFixture[str]) -> None:
    assert "1 frame from, 1 to" in said(capsys, "info", f"{CAPTURES}/devices/bacnet-three-objects.cap.txt")


def test_octets_before_an_answer_are_not_said_to_be_the_answer(capsys: pytest.CaptureFixture[str]) -> None:
    page = said(capsys, "info", f"{CAPTURES}/rtu-noisy-ftdi.cap.txt")
    assert "2 × before the answer: 3 octets that are no frame" in page


def test_response_times_of_stations_stand_beside_what_the_adapter_adds(capsys: pytest.CaptureFixture[str]) -> None:
    first, *_ = said(capsys, "stats", f"{CAPTURES}/rtu-noisy-ftdi.cap.txt", "nodes", "--json").splitlines()
    assert json.loads(first)["plus_minus_ms"] == 17.5


def test_a_station_has_one_name_in_the_table_of_health(capsys: pytest.CaptureFixture[str]) -> None:
    table = said(capsys, "stats", f"{CAPTURES}/devices/acn-common-area.cap.txt", "health")
    assert "station 1 is at 60" in table
    assert "drive" not in table


def test_a_bus_that_was_not_heard_is_neither_well_nor_ill(capsys: pytest.CaptureFixture[str]) -> None:
    (row,) = said(capsys, "stats", f"{CAPTURES}/findings/silent-bus.cap.txt", "health", "--json").splitlines()
    assert json.loads(row) == {"subject": "bus", "health": None, "why": "nothing was heard"}


def test_a_station_is_called_what_its_people_call_it(capsys: pytest.CaptureFixture[str]) -> None:
    before, after = f"{CAPTURES}/mstp-clean.cap.txt", f"{CAPTURES}/findings/ms-tp-address-twice.cap.txt"
    subjects = {line.split("  ")[0] for line in said(capsys, "diff", before, after).splitlines()[1:]}
    assert subjects == {"bus", "MAC 2", "MAC 9"}
    assert Meaning(5, None, noun="MAC").who == "MAC 5"


def test_what_a_site_explains_costs_the_bus_no_health() -> None:
    told = (CAPTURES / "sites/power-lost.check.txt").read_text("utf-8")
    assert told.count("health 100") == 3


def test_every_link_type_that_the_help_names_can_be_asked_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "x.pcapng"
    assert main(["convert", f"{CAPTURES}/profibus-clean.cap.txt", str(out), "--link-type", "257"]) == 0
    assert out.stat().st_size > 10_000


def test_an_unknown_suffix_is_told_all_that_can_be_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["convert", f"{CAPTURES}/rtu-clean.cap.txt", str(tmp_path / "x.foo")]) != 0
    assert ".mcap .cap.txt .pcapng .pcap" in capsys.readouterr().err


def test_the_longest_of_two_answers_is_no_difference(capsys: pytest.CaptureFixture[str]) -> None:
    before, after = f"{CAPTURES}/mstp-clean.cap.txt", f"{CAPTURES}/findings/ms-tp-address-twice.cap.txt"
    assert "response" not in said(capsys, "diff", before, after)
