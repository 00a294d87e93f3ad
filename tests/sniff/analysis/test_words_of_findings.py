"""What findings say is what was seen and no more: whose it is, by how much, and which of a rule's causes are left."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from dissectors.findings import Finding, Severity, with_consequences
from dissectors.findings import found as found_by
from sniff.analysis.judging import all_rules
from sniff.cli.rule import to_json
from sniff.testing.capture_reading import read_capture

FINDINGS = Path(__file__).parents[3] / "captures/findings"


def found(capture: str, code: str, subject: str = "") -> Finding:
    """The one finding of a capture by this rule (about this subject)."""
    made = read_capture(FINDINGS / f"{capture}.cap.txt").findings
    (one,) = (one for one in made if one.code == code and subject in ("", one.subject))
    return one


@pytest.mark.parametrize(
    ("capture", "code"),
    [
        ("rtu-bit-errors-of-one-station", "LN101"),
        ("rtu-bit-errors-of-the-master", "LN101"),
        ("rtu-bit-errors-of-one-station", "MB005"),
        ("ftdi-write-repeated-at-once", "MB007"),
    ],
)
def test_what_struck_one_alone_a_few_times_is_not_said_to_strike_all(capture: str, code: str) -> None:
    one = found(capture, code)
    assert "whoever sends" not in one.seen
    assert "a cause common to all" not in one.means


def test_senders_are_listed_in_the_order_of_their_addresses_and_who_is_not_known_last() -> None:
    one = found("ftdi-two-masters-that-ask-the-same", "LN101")
    assert one.seen.endswith("(master: 8, station 1: 12, station 2: 7, station 3: 10, station 4: 8, unknown: 1)")


def test_noise_beside_the_frames_of_one_alone_is_not_said_to_be_beside_everybodys() -> None:
    assert "whoever sends" not in found("line-noise-anywhere-held-back", "LN203").seen
    assert "whoever sends" in found("line-noise-anywhere", "LN203").seen


def test_n2_damage_is_everybodys_only_where_there_is_enough_of_several() -> None:
    assert "too few to say whose" in found("n2-bit-errors-everywhere", "N2004").seen
    assert "too few to say whose" in found("n2-answers-into-the-next-station", "N2004", "bus").seen  # 3 is named
    assert "of each sender about as much" in found("line-hum-beside-n2", "N2004").seen


def test_a_comparison_with_frames_that_were_not_struck_is_not_told() -> None:
    assert "elsewhere" not in found("rtu-answers-into-the-next-station-no-repeats", "MB106").seen


def test_of_the_causes_of_a_rule_only_those_are_told_that_are_left() -> None:
    assert "driver" not in found("n2-checksum-off", "N2012").means
    assert "too soon" in found("n2-last-octet-missing", "N2012").means
    assert "too late" in found("n2-first-octet-of-all-missing", "N2012").means
    assert "adapter" in found("n2-first-octet-of-all-missing", "N2012").means  # all stations have it
    assert "ordered" in found("n2-reset-that-was-ordered", "N2001").means
    assert "not heard" not in found("n2-late-in-another-s-turn", "N2011").means
    assert "damaged" in found("n2-bit-errors-of-the-master", "N2009").means


def test_a_silence_in_which_no_token_was_lost_asks_about_no_holder() -> None:
    one = found("line-silent-for-a-moment-ms-tp", "MS101")
    assert "holder" not in one.next
    assert "the station that had the token" not in one.means
    assert "last holder" in found("ms-tp-lost-token", "MS101").next


def test_addresses_that_are_never_polled_are_told_without_those_that_are() -> None:
    assert found("ms-tp-shut-out-of-the-ring", "MS110").seen.endswith("polls only 41, never 42 … 127, 0 … 5")
    assert found("ms-tp-several-stations-shut-out", "MS110", "MAC 9").seen.endswith("never 3 … 127, 0")


def test_the_time_that_polls_take_is_told_only_where_the_adapter_tells_it() -> None:
    assert "of the time" in found("profibus-slave-restarts", "PB016", "station 1").seen
    assert "of the time" not in found("profibus-slave-restarts-ftdi-16-ms", "PB016", "station 1").seen


def test_answers_in_pieces_are_not_more_than_all_telegrams() -> None:
    assert found("profibus-answers-cut-short", "PB008").seen == "5 of 55 answers damaged"


@pytest.mark.parametrize(
    ("capture", "code", "subject", "cause"),
    [
        ("ms-tp-address-twice", "MS402", "MAC 2", "MS501"),  # hit by the second token of the two
        ("ms-tp-station-comes-and-goes", "MS301", "MAC 9", "MS105"),
        ("ms-tp-broadcast-storm", "LN402", "bus", "MS602"),
        ("ms-tp-one-uses-most-of-the-line", "MS603", "bus", "LN401"),
        ("ms-tp-noise-between-frames", "MS403", "bus", "LN202"),
        ("profibus-master-silent-beyond-the-watchdog", "PB007", "station 5", "PB019"),
        ("profibus-master-silent-beyond-the-watchdog", "PB017", "station 6", "PB019"),
        ("ftdi-two-masters-that-ask-the-same", "LN205", "bus", "MB203"),
        ("rtu-bit-errors-of-the-master", "LN101", "bus", "MB009"),
    ],
)
def test_what_has_one_cause_is_told_once(capture: str, code: str, subject: str, cause: str) -> None:
    one = found(capture, code, subject)
    assert one.cause is not None
    assert one.cause[0] == cause


def test_what_disturbs_the_line_explains_damage_of_every_protocol() -> None:
    rules = all_rules()
    hum = found_by(rules["LN301"], "bus", "")
    for code in ("MB007", "N2004", "MS401", "PB008"):
        assert with_consequences((hum, found_by(rules[code], "bus", "")), rules)[1].cause == ("LN301", "bus")


def test_a_rule_names_each_code_once() -> None:
    for rule in all_rules().values():
        explained = to_json(rule)["explains"]
        assert len(explained) == len(set(explained)), rule.code


@pytest.mark.parametrize(
    ("capture", "code"),
    [("drive-read-only-register", "PR003"), ("drive-reserved-register", "PR002"), ("drive-told-too-much", "PR001")],
)
def test_what_a_device_refuses_as_its_manual_says_is_told_once(capture: str, code: str) -> None:
    assert found(capture, "MB008").cause == (code, "drive 2")


def test_a_refusal_of_something_else_stands_for_itself() -> None:
    rules = all_rules()
    written = found_by(rules["PR003"], "drive 2", "", count=2, evidence=(1, 15))
    for evidence, count, is_told in (((1, 2), 1, True), ((7, 8), 1, False), ((1, 2, 7, 8, 9, 10), 3, False)):
        refused = found_by(rules["MB008"], "station 2", "", count=count, evidence=evidence)
        assert (with_consequences((written, refused), rules)[1].cause is not None) is is_told


def test_what_one_request_writes_is_one_finding() -> None:
    made = read_capture(FINDINGS / "drive-frame-too-long.cap.txt").findings
    graves = [one.code for one in made if one.severity >= Severity.WARNING]
    assert graves == ["PR002", "PR003", "PR006"]
    assert "2506h, 2508h, 2509h, 250Ah and 6 more" in found("drive-frame-too-long", "PR002").seen


def test_a_value_that_was_written_is_no_failed_sensor() -> None:
    assert "sensor" not in found("drive-told-too-much", "PR001").means


def test_a_station_that_was_away_for_a_while_lost_no_single_frames() -> None:
    one = found("rtu-station-away-for-a-while", "MB003")
    assert one.severity is Severity.WARNING
    assert "in a row within 5.47 s; then it answered again" in one.seen
    assert "loose wire" not in one.means
    assert "loose wire" in found("rtu-slow-station", "MB002").means


def test_what_is_for_everybody_is_not_called_a_station() -> None:
    assert "comes back to address 0 (" in found("line-many-broadcasts", "MB401").seen


def test_damage_of_one_station_of_which_nothing_tells_whose_it_is_names_it_once() -> None:
    rules = all_rules()
    damage = replace(found_by(rules["MB007"], "bus", "", count=4), stations=(1,))
    for station, is_told in ((1, True), (2, False)):
        line = found_by(rules["LN101"], f"station {station}", "", count=4)
        assert (with_consequences((line, damage), rules)[0].cause == ("MB007", "bus")) is is_told


def test_damage_of_the_line_does_not_explain_a_station_that_was_away() -> None:
    rules = all_rules()
    away = found_by(rules["MB003"], "station 2", "", count=39, severity=Severity.WARNING)
    repeats = found_by(rules["MB104"], "station 2", "", count=20)
    _, of_station, of_repeats = with_consequences((found_by(rules["MB007"], "bus", ""), away, repeats), rules)
    assert of_station.cause is None
    assert of_repeats.cause == ("MB003", "station 2")  # its own trouble explains more of it than the bus's


@pytest.mark.parametrize("code", ["MB203", "N2007"])
def test_two_masters_that_only_collide_for_a_while_are_no_other_baud_rate(code: str) -> None:
    rules = all_rules()
    made = with_consequences((found_by(rules["LN303"], "bus", ""), found_by(rules[code], "bus", "")), rules)
    assert made[0].cause == (code, "bus")


def test_a_late_answer_of_one_n2_station_is_no_second_station_with_the_address_of_the_next() -> None:
    made = read_capture(FINDINGS / "n2-slow-station-and-lost-answers-of-another.cap.txt").findings
    assert "N2008" not in {one.code for one in made}
    assert {one.subject for one in made if one.severity >= Severity.WARNING} == {"station 1", "station 2"}
    own = {one.subject: one.cause for one in made if one.code == "N2005"}
    assert own == {"station 1": None, "station 2": ("N2011", "station 2")}  # who loses answers is not slow
