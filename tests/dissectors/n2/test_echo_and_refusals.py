"""Echoes that are cut short, and stations that refuse everything."""

from __future__ import annotations

from dissectors.n2.envelope import make_answer, make_command
from tests.dissectors.n2.heard import in_turns, warned_of


def told(turns: list[list[bytes]], wait: int = 270, pause: int = 12) -> set[tuple[str, str]]:
    """What is said as a warning at least of turns, `wait` ms apart: a command, and what follows it after `pause` ms."""
    return warned_of(in_turns(turns, wait, pause))


def asked(station: int) -> list[bytes]:
    return [make_command(f"{station:02X}110103"), make_answer("0041A00000")]


def test_an_echo_that_is_cut_short_is_no_damage_of_the_master() -> None:
    command, answer = asked(2)
    heard = told([[command, command[:-2], answer]] * 20, pause=2)
    assert not [subject for _, subject in heard if subject == "master"]


def test_a_station_that_refuses_everything_is_told() -> None:
    assert ("N2009", "station 2") in told([[asked(2)[0], b"N05\r"], asked(3)] * 6)


def test_a_station_that_refuses_some_is_not() -> None:
    assert not told([[asked(2)[0], b"N05\r"]] * 6 + [asked(2)] * 6)
