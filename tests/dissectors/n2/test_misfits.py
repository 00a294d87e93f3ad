"""Acknowledges of reads that do not hold what was asked for; who is not to blame for one."""

from __future__ import annotations

import pytest

from dissectors.findings import Severity
from dissectors.n2.envelope import make_answer, make_command
from tests.dissectors.n2.heard import findings_of, in_turns

VALUE, LONG, SHORT, NOTHING = make_answer("41A00000"), make_answer("0041A00000"), make_answer("41A0"), b"A\r"


def told(answers: list[bytes], attribute: str = "03", before: bytes = VALUE, wait: int = 60) -> list[tuple[str, str]]:
    """Severity and words of N2016 at station 2, which gives these answers in turn; station 1 is asked before it."""
    turns = (
        (make_command(f"{station:02X}1105{attribute if station == 2 else '03'}"), *([answer] if answer else []))
        for turn in range(40)
        for station, answer in ((1, before), (2, answers[turn % len(answers)]))
    )
    found = [one for one in findings_of(in_turns(turns, wait)) if one.code == "N2016"]
    assert {one.subject for one in found} <= {"station 2"}
    return [(one.severity.name, one.seen) for one in found if one.severity >= Severity.NOTE]


@pytest.mark.parametrize("answers", [[VALUE], [LONG], [VALUE, LONG]])
def test_a_value_with_and_without_its_status_fits(answers: list[bytes]) -> None:
    assert told(answers) == []


def test_a_value_that_is_missing() -> None:
    assert told([VALUE, VALUE, NOTHING]) == [("WARNING", "13 without a value among 40 acknowledged reads")]
    assert told([NOTHING]) == [("WARNING", "40 without a value among 40 acknowledged reads")]


def test_a_value_that_is_cut_now_and_then() -> None:
    assert told([VALUE, SHORT]) == [("WARNING", "20 of another length than else among 40 acknowledged reads")]


def test_a_length_of_its_own_is_its_way_of_writing() -> None:
    said = "analog input: object status always has another length than is known of it"
    assert told([VALUE], attribute="02") == [("NOTE", said)]


def test_of_attributes_of_unknown_layout_nothing_is_said() -> None:
    assert told([NOTHING], attribute="FE") == []


def test_what_comes_behind_a_command_without_answer_may_be_its_answer() -> None:
    assert told([NOTHING], before=b"", wait=300) == []
