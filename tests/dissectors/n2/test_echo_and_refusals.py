"""Echoes that are cut short, and stations that refuse everything."""

from __future__ import annotations

from dissectors.findings import Severity
from dissectors.frame import Chunk
from dissectors.line import MS, LineSettings, Timing
from dissectors.n2 import N2
from dissectors.n2.envelope import make_answer, make_command
from dissectors.n2.findings import N2Findings
from sniff.engine.engine import Engine, Output

LINE = LineSettings.parse("9600,8N1")


def told(turns: list[list[bytes]], wait: int = 270, pause: int = 12) -> set[tuple[str, str]]:
    """What is said as a warning at least of turns, `wait` ms apart: a command, and what follows it after `pause` ms."""
    judge, engine, now = N2Findings(Timing(LINE)), Engine(N2, Timing(LINE)), 10**12

    def take(output: Output) -> None:
        for row in output.rows:
            judge.see(row.no, row.event, row.header, row.placement)
        for transaction in output.transactions:
            judge.settle(transaction)

    for turn in turns:
        for at, octets in enumerate(turn):
            now += (pause if at else wait) * MS + len(octets) * LINE.char
            take(engine.feed(Chunk(now, octets)))
    take(engine.close())
    return {(one.code, one.subject) for one in judge.findings() if one.severity >= Severity.WARNING}


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
