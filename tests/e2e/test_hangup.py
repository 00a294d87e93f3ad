"""A terminal that is gone ends what draws on it, even where no SIGHUP comes; who is asked to end leaves it in order."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from sniff.formats import read
from tests.e2e.recording_bus import LINE, Feeder, capture_processes, octets_of, wait_until
from tests.e2e.running import PATIENCE

pytest.importorskip("termios")

ROOT = Path(__file__).parents[2]
CAPTURE = ROOT / "captures" / "devices" / "n2-polls.cap.txt"

LEADER = """
import fcntl, signal, subprocess, sys, termios
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
signal.signal(signal.SIGHUP, lambda *_: None)  # it stays, as make does, and tells nobody
def effect():
    signal.signal(signal.SIGHUP, signal.SIG_IGN if sys.argv[1] == "ignored" else signal.SIG_DFL)
with open(sys.argv[2], "w") as told:
    told.write(str(subprocess.call([sys.executable, "-m", "sniff", "open", sys.argv[3]], preexec_fn=effect)))
"""


@pytest.mark.parametrize(("effect", "code"), [("default", -signal.SIGHUP), ("ignored", 128 + signal.SIGHUP)])
def test_the_terminal_ui_ends_with_its_terminal(effect: str, code: int, tmp_path: Path) -> None:
    screen, terminal = os.openpty()
    told = tmp_path / "told"
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "TERM": "xterm"}
    with subprocess.Popen(
        [sys.executable, "-c", LEADER, effect, str(told), str(CAPTURE)],
        cwd=tmp_path, env=environment, stdin=terminal, stdout=terminal, stderr=terminal, start_new_session=True,
    ) as leader:  # fmt: skip
        os.close(terminal)
        try:
            drawn = b""
            while b"Frames" not in drawn:
                drawn += os.read(screen, 4096)
            os.close(screen)
            leader.wait(PATIENCE)
        except BaseException:
            os.killpg(leader.pid, signal.SIGKILL)
            raise
    assert int(told.read_text()) == code


def test_asked_to_end_it_leaves_terminal_port_and_recording_in_order(tmp_path: Path) -> None:
    bus = Feeder()
    screen, terminal = os.openpty()
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "TERM": "xterm"}
    recording = tmp_path / "x.mcap"
    with subprocess.Popen(
        [sys.executable, "-m", "sniff", "live", bus.path, *LINE, "-w", str(recording)],
        cwd=tmp_path, env=environment, stdin=terminal, stdout=terminal, stderr=terminal, start_new_session=True,
    ) as process:  # fmt: skip
        os.close(terminal)
        try:
            drawn = b""
            while b"Frames" not in drawn:
                drawn += os.read(screen, 4096)
            bus.feed(bytes.fromhex("010300000002c40b"))
            wait_until(lambda: octets_of(recording), "nothing is recorded")
            process.send_signal(signal.SIGTERM)
            while b"recorded to" not in drawn:
                drawn += os.read(screen, 4096)
            assert process.wait(PATIENCE) == 0
        finally:
            for pid in [process.pid, *capture_processes(tmp_path)]:
                if process.poll() is None or pid != process.pid:
                    os.kill(pid, signal.SIGKILL)
            os.close(screen)
            bus.close()
    assert b"\x1b[?1049l" in drawn, "the screen of before"
    assert read(recording).completeness().whole
