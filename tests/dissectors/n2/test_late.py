"""A station that answers into the next command, and is hardly ever heard besides."""

from __future__ import annotations

import pytest

from dissectors.frame import Chunk
from dissectors.line import MS, Timing
from dissectors.n2.envelope import make_answer, make_command
from dissectors.n2.findings import N2Findings
from dissectors.n2.masters import Masters
from dissectors.n2.record import N2StationRecord
from dissectors.tracker import Interval, Transaction, Verdict
from tests.dissectors.n2.heard import BEGIN, LINE, in_turns, warned_of

SPOILT = b">031102@\x08140000E9\r"
"""A command to 3 that an answer fell on."""


def told(turns: list[list[bytes]], wait: int = 270) -> set[tuple[str, str]]:
    """What is said as a warning at least of turns, `wait` ms apart: a command, and what follows it after 12 ms."""
    return warned_of(in_turns(turns, wait))


def asked(station: int) -> list[bytes]:
    return [make_command(f"{station:02X}110103"), make_answer("0041A00000")]


@pytest.mark.parametrize(
    ("late", "is_told"),
    [([asked(2)[:1], [SPOILT]], True), ([[SPOILT], asked(2)[:1]], False), ([asked(2)[:1], asked(3)], False)],
)
def test_commands_damaged_behind_one_to_it_show_who_is_late(late: list[list[bytes]], is_told: bool) -> None:
    turns = [asked(2)]
    for _ in range(8):
        turns += [asked(1), asked(3), asked(1), asked(3), *late]
    assert (("N2014", "station 2") in told(turns)) is is_told


def test_commands_damaged_where_an_answer_is_due_are_those_of_two_masters() -> None:
    """No master has given up 20 ms behind its command, so who was asked is not late."""
    turns = [asked(2)]
    for no in range(8):
        turns += [asked(1), asked(3), asked(1), asked(3), [*asked(2)[:1], SPOILT], asked(3)[: 1 + no % 2]]
    assert {one for one in told(turns) if one[0] in ("N2007", "N2014")} == {("N2007", "bus")}


def test_commands_damaged_anywhere_are_not_those_of_two_masters() -> None:
    """Three are behind one whose answer was not heard here, and as many where answers were."""
    turns = [asked(2)]
    for _ in range(3):
        turns += [asked(1), asked(3), [*asked(2)[:1], SPOILT], asked(1), [SPOILT], asked(1), [SPOILT], asked(2)]
        turns += [asked(3), *([asked(2)[:1]] * 2), asked(1), [SPOILT]]
    assert ("N2007", "bus") not in told(turns, 60)


@pytest.mark.parametrize(("wait", "is_told"), [(60, True), (400, False)])
def test_a_master_that_asks_for_the_next_point_soon_had_its_answer(wait: int, is_told: bool) -> None:
    """Several points of one station in a row: the next one is no repeat."""
    commands = [make_command(f"0211{point:02X}03") for point in (1, 2, 3)] * 6
    found = told([asked(1), *([one] for one in commands), asked(1)], wait)
    assert found == {("N2015", "bus") if is_told else ("N2005", "station 2")}


@pytest.mark.parametrize(("response", "is_told"), [(42, True), (43, False)])
def test_who_had_something_before_it_went_on_is_no_second_master(response: int, is_told: bool) -> None:
    """A command in row 40, one in row 41, and 20 ms after the first its answer; or a late one of an earlier command
    between the two, which the master took for its answer."""
    masters, took = Masters(1_000_000), Interval(20_000_000, 20_000_000, 20_000_000)
    late = Transaction(1, 3, "poll", 40, response, Verdict.LATE, 0, took.nominal, took)
    masters.see_late(late, N2StationRecord(answered=20))
    assert bool(masters.seen.count) is is_told


def test_an_answer_that_ends_a_cut_echo_by_chance_shows_no_second_master() -> None:
    """Echoes lack their last two characters, and the check of one command ends with the `A` that answers it."""
    commands = [make_command(f"01110{point}03") for point in (1, 2, 3)]
    ends_so = next(one for one in (make_command(f"01120{point:X}03") for point in range(1, 16)) if one[-2:] == b"A\r")
    now, chunks = BEGIN, []
    for turn in range(60):
        command = ends_so if turn % 4 == 3 else commands[turn % 4]
        answer = b"A\r" if turn % 4 == 3 else make_answer("0041A00000")
        for octets, silence in ((command, 30), (command[:-2], 1), (answer, 65)):
            now += silence * MS + len(octets) * LINE.char
            chunks.append(Chunk(now, octets))
    assert "N2007" not in {code for code, _ in warned_of(chunks)}


@pytest.mark.parametrize(("spoilt", "is_told"), [(0, True), (60, False)])
def test_of_many_spoilt_commands_some_seem_to_be_in_the_middle_of_another(spoilt: int, is_told: bool) -> None:
    """A flipped bit makes a `>` in noise: over a night twice."""
    judge = N2Findings(Timing(LINE))
    for no in range(2):
        judge.masters.seen.add(no, no)
    for no in range(spoilt):
        judge.master.add_bad(no, no)
    assert ("N2007" in {one.code for one in judge.findings()}) is is_told
