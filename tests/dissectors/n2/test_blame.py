"""Whose damage it is, and what no single master would do."""

from __future__ import annotations

from dissectors.frame import Check, Damage, FoundBy, Frame
from dissectors.n2.blame import blamed
from dissectors.n2.commands import parse_command
from dissectors.n2.masters import HASTE, Masters, OpenCommand
from dissectors.n2.record import Damages, Missing, N2StationRecord
from dissectors.strikes import Strikes

MS = 1_000_000
READ, OTHER = b">0111010387\r", b">02110A0398\r"


def sender(octets: int, bad: int) -> Damages:
    made = Damages(frames=octets // 10, octets=octets)
    for time in range(bad):
        made.add_bad(time, time)
    return made


def blame(in_a_row: bool = False, **senders: tuple[int, int]) -> dict[str, int]:
    strikes = Strikes()
    for name, (_, bad) in senders.items():
        for _ in range(bad):
            strikes.struck(name)
            if not in_a_row:
                strikes.whole()
    return {name: tally.count for name, tally in blamed({n: sender(*s) for n, s in senders.items()}, strikes).items()}


def test_noise_in_everybodys_share_of_the_time_is_the_bus():
    assert blame(master=(5000, 40), first=(5000, 45), second=(20_000, 170)) == {"bus": 255}


def test_a_sender_with_far_more_than_its_share_is_named_alone():
    assert blame(master=(5000, 1), first=(5000, 0), second=(5000, 60)) == {"second": 60, "bus": 1}
    assert blame(master=(5000, 0), first=(5000, 50), second=(5000, 60)) == {"bus": 110}


def test_the_only_one_that_is_struck_is_named():
    assert blame(master=(5000, 0), first=(5000, 6)) == {"first": 6}
    several = {f"station {number}": (5000, 0) for number in range(1, 8)}
    assert blame(**several, master=(5000, 0), last=(5000, 2)) == {"bus": 2}  # any of nine might have been struck twice
    assert blame(master=(5000, 0), first=(5000, 2)) == {"bus": 2}
    assert blame(master=(5000, 0), first=(5000, 0)) == {}


def test_who_is_named_has_no_part_in_what_is_left():
    """Of two stations, as long on the line as each other, chance often strikes one alone three times."""
    assert blame(master=(100_000, 800), first=(1000, 3), second=(1000, 0)) == {"master": 800, "bus": 3}


def test_with_many_senders_one_is_struck_more_than_others_by_chance():
    many = {f"station {number}": (5000, 1) for number in range(16)}
    assert blame(**many, last=(5000, 3)) == {"bus": 19}
    assert blame(**many, last=(5000, 12)) == {"last": 12, "bus": 16}


def test_what_is_repeated_into_one_disturbance_is_one_strike():
    assert blame(master=(5000, 0), first=(5000, 8)) == {"first": 8}
    assert blame(True, master=(5000, 0), first=(5000, 8)) == {"bus": 8}


def test_who_sends_most_of_the_time_is_struck_most_and_not_to_blame():
    assert blame(master=(1000, 2), first=(1000, 1), second=(50_000, 110)) == {"bus": 113}


def test_what_is_answered_late_is_not_missing():
    missing = Missing()
    for number in range(40):
        missing.add(number, number * MS, number)
    missing.take_back(39)
    missing.take_back(None)
    missing.take_back(1)  # too long ago
    assert missing.count == 39
    tally = missing.tally()
    assert (tally.count, tally.first, tally.last) == (39, 0, 38 * MS)


def asked(octets: bytes, start: int, damage: Damage | None = None) -> OpenCommand:
    check = Check.GOOD if damage is None else Check.ABSENT
    frame = Frame("n2", octets, start, start + len(octets) * MS, check, FoundBy.DELIMITER, damage)
    return OpenCommand(start, frame, parse_command(octets))


def seen(*commands: OpenCommand, quickest: int | None = 50 * MS, answered: int = 20) -> int:
    masters = Masters(MS)
    for command in commands:
        masters.see_command(command, N2StationRecord(answered=answered, quickest=quickest))
    return masters.seen.count


def test_a_command_before_the_answer_can_have_come_is_not_the_same_masters():
    assert seen(asked(READ, 0), asked(OTHER, 20 * MS)) == 1
    assert seen(asked(READ, 0), asked(OTHER, 70 * MS)) == 0  # the answer may have come, and not been heard here
    assert seen(asked(READ, 0), asked(OTHER, 20 * MS), quickest=None) == 0  # never answered: a scan
    assert seen(asked(READ, 0), asked(OTHER, 20 * MS), answered=2) == 0
    assert seen(asked(READ, 0), asked(READ, 20 * MS)) == 0  # a repeat, an echo


def test_a_command_in_the_middle_of_another_is_not_the_same_masters():
    assert seen(asked(READ[:5], 0, Damage.RESTARTED), asked(OTHER, 5 * MS), quickest=None) == 1
    assert seen(asked(READ[:5], 0, Damage.RESTARTED), asked(OTHER, 5 * MS + HASTE), quickest=None) == 0


def test_something_between_two_commands_may_have_been_an_answer():
    masters, station = Masters(MS), N2StationRecord(answered=20, quickest=50 * MS)
    masters.see_command(asked(READ, 0), station)
    masters.see_other()
    masters.see_command(asked(OTHER, 20 * MS), station)
    assert masters.seen.count == 0
