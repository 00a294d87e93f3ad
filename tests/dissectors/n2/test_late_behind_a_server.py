"""A master that repeats, heard through what may hold octets back for longer than it waits."""

from __future__ import annotations

from dissectors.frame import Chunk
from dissectors.line import MS, LineSettings, Timing
from dissectors.n2 import N2
from dissectors.n2.envelope import make_answer, make_command
from dissectors.tracker import Verdict
from sniff.engine.engine import Engine

LINE = LineSettings.parse("9600,8N1")


def verdicts(steps: list[tuple[int, bytes]], latency: int) -> list[Verdict]:
    """What becomes of octets that come so many ms behind those before."""
    engine, now, found = Engine(N2, Timing(LINE, latency * MS)), 10**12, []
    for silence, octets in steps:
        now += silence * MS + len(octets) * LINE.char
        found += engine.feed(Chunk(now, octets)).transactions
    return [one.verdict for one in (*found, *engine.close().transactions)]


COMMAND, ANSWER = make_command("01110203"), make_answer("0043E60000")


def test_a_command_that_comes_again_as_late_as_masters_repeat_is_no_echo() -> None:
    again = [(60, COMMAND), (260, COMMAND), (12, ANSWER), (8, ANSWER)]
    assert Verdict.ECHO not in verdicts(again * 3, latency=672)


def test_what_comes_back_within_what_the_adapter_holds_back_is_one() -> None:
    echoed = [(60, COMMAND), (12, COMMAND), (12, ANSWER)]
    for latency in (18, 672):
        assert verdicts(echoed * 3, latency).count(Verdict.ECHO) == 3
