"""Pauses inside frames are a sender's fault only where the adapter cannot have made them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from dissectors.frame import FoundBy, Frame
from dissectors.line import LineSettings, Timing
from dissectors.modbus.header import peek_rtu
from dissectors.modbus.observer import ModbusFindings
from dissectors.tracker import Placement

MS = 1_000_000
READ = "01 03 00 00 00 0A C5 CD"


@pytest.mark.parametrize(
    ("baud", "latency", "judged"),
    [
        (19200, 0, True),
        (1200, 0, True),
        (19200, 3 * MS, False),  # longer than 1.5 characters
        (600, 3 * MS, True),
        (1200, 3 * MS, False),  # a pseudo-terminal: a busy computer is late by several slices
        (115200, 3 * MS, False),
    ],
)
def test_pauses_are_judged_where_the_adapter_is_quick_enough(
    frame_of: Callable[..., Frame], baud: int, latency: int, judged: bool
) -> None:
    timing = Timing(LineSettings.parse(f"{baud},8E1"), latency)
    judge = ModbusFindings(timing)
    now = 0
    for no in range(1, 41):
        pause = 2 * timing.t15 + 2 * latency if no > 30 else 0
        frame = frame_of(READ, start=now, end=now + 8 * timing.char + pause, slack=latency)
        judge.see(no, frame, peek_rtu(frame), Placement(no, no, peek_rtu(frame).role, None, 1))
        now = frame.end + 200 * MS
    codes = {finding.code for finding in judge.findings()}
    assert ("MB302" in codes) is judged
    assert ("MB303" in codes) is not judged


@pytest.mark.parametrize(
    ("found", "is_told", "is_said"),
    [(FoundBy.JOINED, True, True), (FoundBy.GAP, True, False), (FoundBy.JOINED, False, False)],
)
def test_a_sender_that_always_pauses_at_one_place_is_told_from_even_spacing(
    frame_of: Callable[..., Frame], found: FoundBy, is_told: bool, is_said: bool
) -> None:
    timing = Timing(LineSettings.parse("9600,8N1"), 0, is_told)
    judge = ModbusFindings(timing)
    for no in range(1, 21):
        now = no * 200 * MS
        frame = replace(frame_of(READ, start=now, end=now + 8 * timing.char + 8 * MS), found=found)
        judge.see(no, frame, peek_rtu(frame), Placement(no, no, peek_rtu(frame).role, None, 1))
    assert any(finding.code == "MB302" for finding in judge.findings()) is is_said


@pytest.mark.parametrize("is_told", [True, False])
def test_what_a_fifo_holds_back_is_nobodys_pause_where_nobody_said_the_adapter(
    frame_of: Callable[..., Frame], is_told: bool
) -> None:
    timing = Timing(LineSettings.parse("9600,8N1"), 0, is_told)
    judge = ModbusFindings(timing)
    for no in range(1, 41):
        now, held = no * 200 * MS, 4 * timing.char if no > 30 else 0
        frame = frame_of(READ, start=now, end=now + 8 * timing.char + held)
        judge.see(no, frame, peek_rtu(frame), Placement(no, no, peek_rtu(frame).role, None, 1))
    assert any(finding.code == "MB302" for finding in judge.findings()) is is_told
