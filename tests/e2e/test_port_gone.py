"""A port that is gone for good ends a recording with exit code 4; a capture file that ends is no trouble."""

from __future__ import annotations

import os
import subprocess
import sys
import tty
from pathlib import Path

import pytest

from sniff.formats import read

pytest.importorskip("termios")
POLL = bytes.fromhex("010300000002c40b")
CAPTURE = "#!sniff-capture 1\n# line: 19200,8E1\n# protocol: modbus-rtu\n+0 01 03 00 00 00 02 C4 0B\n"


def sniff485(folder: Path, *arguments: str) -> subprocess.Popen[str]:
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    command = [sys.executable, "-m", "sniff", *arguments, "-s", "19200,8E1"]
    return subprocess.Popen(command, cwd=folder, env=environment, stderr=subprocess.PIPE, text=True)


@pytest.mark.parametrize("quiet", [(), ("-q",)])
def test_a_port_that_is_gone_for_good(tmp_path: Path, quiet: tuple[str, ...]) -> None:
    master, slave = os.openpty()
    tty.setraw(slave)
    name = os.ttyname(slave)
    process = sniff485(tmp_path, "record", name, "-w", "x.mcap", *quiet)
    try:
        while not (tmp_path / "x.mcap").exists():
            assert process.poll() is None, process.stderr and process.stderr.read()
        os.write(master, POLL)
        os.close(slave)
        os.close(master)
        _, said = process.communicate(timeout=20)
    finally:
        process.kill()
        process.communicate()
    assert process.returncode == 4
    assert f"sniff485: {name}: gone for good" in said
    assert read(tmp_path / "x.mcap").completeness().whole


def test_a_capture_file_that_ends(tmp_path: Path) -> None:
    (tmp_path / "a.cap.txt").write_text(CAPTURE)
    process = sniff485(tmp_path, "record", "a.cap.txt", "-w", "x.mcap")
    _, said = process.communicate(timeout=20)
    assert process.returncode == 0, said
    assert "gone" not in said
