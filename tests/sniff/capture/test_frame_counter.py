from __future__ import annotations

import time

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.capture.frame_counter import FrameCounter
from sniff.engine.event_texts import SettingsChange
from sniff.engine.session import UNKNOWABLE, LineEvent, LineEventKind, Session

MS = 1_000_000
LINE = LineSettings.parse("19200,8E1")
POLL = bytes.fromhex("010300000002c40b")


def until(counter: FrameCounter, frames: int) -> None:
    deadline = time.monotonic() + 20
    while counter.frames < frames:
        assert time.monotonic() < deadline, counter.frames
        time.sleep(0.002)


def test_frames_are_counted_however_they_are_cut() -> None:
    counter = FrameCounter(Session("p", LINE, "modbus-rtu"))
    for number in range(50):
        counter.item(Chunk(number * 50 * MS, POLL[:5]))
        counter.item(Chunk(number * 50 * MS + 2 * MS, POLL[5:]))
    deadline = time.monotonic() + 20
    while counter.frames < 50:  # the last one when silence has followed
        assert time.monotonic() < deadline
        counter.advance(10_000 * MS)
        time.sleep(0.002)
    assert counter.frames == 50


def test_while_the_protocol_is_searched_for_nothing_is_counted() -> None:
    counter = FrameCounter(Session("p", LINE, "n2", unknown=UNKNOWABLE))
    counter.item(LineEvent(0, LineEventKind.SETTINGS, str(SettingsChange(LINE, searching=True))))
    counter.item(Chunk(10 * MS, POLL))
    counter.item(LineEvent(20 * MS, LineEventKind.SETTINGS, str(SettingsChange(LINE, "modbus-rtu", found=True))))
    counter.item(Chunk(100 * MS, POLL))
    counter.item(Chunk(200 * MS, POLL))
    until(counter, 2)
