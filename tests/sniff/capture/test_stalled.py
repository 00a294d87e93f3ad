"""A capture that was not let run: what came meanwhile is behind a hole, and the disk is not blamed."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import pytest

from dissectors.frame import Chunk
from sniff.capture.run_watch import STALLED, RunWatch
from sniff.engine.session import LineEvent, LineEventKind
from sniff.formats import read
from tests.e2e.recording_bus import LINE, Command, Feeder, capture_processes, octets_of, wait_until

S = 1_000_000_000
pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="no process can be stopped here")


def test_who_was_stopped_says_that_nobody_read(tmp_path: Path) -> None:
    bus = Feeder()
    command = Command(tmp_path, "record", bus.path, *LINE, "-w", "x.mcap")
    try:
        wait_until(lambda: (tmp_path / "x.mcap").exists() and capture_processes(tmp_path), "it does not begin")
        poll = bytes.fromhex("010300000002c40b")
        wait_until(lambda: bus.feed(poll) or len(octets_of(tmp_path / "x.mcap")) > 0, "nothing is recorded")
        (pid,) = capture_processes(tmp_path)
        bus.until_read()
        os.kill(pid, signal.SIGSTOP)
        bus.feed(poll)
        time.sleep(STALLED / S + 1)
        os.kill(pid, signal.SIGCONT)
        bus.until_read()
        command.send(signal.SIGINT)
        assert command.end() == 0
    finally:
        command.close()
        bus.close()
    items = list(read(tmp_path / "x.mcap").items())
    holes = [at for at, item in enumerate(items) if isinstance(item, LineEvent) and item.kind.is_hole]
    assert len(holes) == 1
    hole, after = items[holes[0]], items[holes[0] + 1 :]
    assert isinstance(hole, LineEvent)
    assert hole.kind is LineEventKind.DROPPED
    assert hole.count == -1
    assert "did not run for" in hole.text
    assert [item.octets for item in after if isinstance(item, Chunk)] == [poll]
    assert not [item for item in items if isinstance(item, LineEvent) and "disk" in item.text]
    assert not [line for line in command.said if "disk" in line]


def test_a_long_wait_is_no_stall() -> None:
    runs = RunWatch(0)
    assert runs.see(10 * S, 10 * S) is None
    assert runs.runs_since(10 * S) is None
    assert runs.see(12 * S, S // 2) is None
    assert runs.see(15 * S, S // 2) == 3 * S
    assert runs.runs_since(16 * S) == S
    assert runs.see(16 * S, S) is None
