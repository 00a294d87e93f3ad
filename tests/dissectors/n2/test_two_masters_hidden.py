"""Two masters behind an adapter that hides how soon a command follows another one."""

from __future__ import annotations

import pytest

from dissectors.frame import Check, FoundBy, Frame
from dissectors.line import MS
from dissectors.n2.clocked import PAUSES_LEAST, Clocked
from dissectors.n2.commands import parse_command
from dissectors.n2.envelope import make_command
from dissectors.n2.masters import Masters, OpenCommand
from dissectors.n2.record import N2StationRecord

CHAR, HELD = MS, 18 * MS


def followed(gaps: list[int]) -> Masters:
    """Commands to one station, each `gap` ms behind one to another that nothing came to."""
    masters, station, now, row = Masters(CHAR), N2StationRecord(answered=99, quickest=0), 10**12, 0
    for gap in gaps:
        for octets, wait in ((make_command("01110203"), 500 * MS), (make_command("020400"[:4]), gap * MS)):
            now, row = now + wait, row + 1
            end = now + len(octets) * CHAR
            frame = Frame("n2", octets, now, end, Check.GOOD, FoundBy.DELIMITER, slack=HELD)
            masters.see_command(OpenCommand(row, frame, parse_command(octets)), station)
            now = end
        masters.see_other()
    return masters


def pauses(*times: int) -> Clocked:
    made = Clocked()
    made.rhythm.turns.extend((60 * MS + time * MS, 60 * MS) for time in times)
    return made


@pytest.mark.parametrize(
    ("gaps", "told"),
    [
        ([0, 5, 9, 0, 3], 5),
        ([0, 5, 9, 0], 0),  # so few may be chance
        ([0, 5, 9, 0, 3, *[55] * 20], 0),  # answers that were not heard leave their time and a pause
        ([70] * 20, 0),
    ],
)
def test_commands_sooner_than_pauses_are_another_masters(gaps: list[int], told: int) -> None:
    masters = followed(gaps)
    assert masters.seen.count == 0
    assert masters.sooner_than(pauses(*range(45, 45 + PAUSES_LEAST)).short_pause).count == told


def test_where_pauses_are_as_short_nothing_is_told() -> None:
    soon = pauses(*[0] * (PAUSES_LEAST // 2), *[40] * (PAUSES_LEAST // 2))
    assert followed([0, 5, 9, 0, 3] * 3).sooner_than(soon.short_pause).count == 0


def test_a_few_pauses_tell_nothing() -> None:
    few = pauses(*[50] * (PAUSES_LEAST - 1))
    assert few.short_pause is None
    assert followed([0] * 9).sooner_than(few.short_pause).count == 0
