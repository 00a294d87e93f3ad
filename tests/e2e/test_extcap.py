"""Wireshark captures from a bus through us: its questions are answered, and what it reads is a live capture."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

COMMAND = [sys.executable, "-m", "sniff", "extcap"]


def ask(*arguments: str) -> str:
    ran = subprocess.run([*COMMAND, *arguments], capture_output=True, text=True, timeout=60, check=True)
    return ran.stdout


def test_wiresharks_questions() -> None:
    assert ask("--extcap-interfaces", "--extcap-version=4.2").startswith("extcap {version=")
    dlts = ask("--extcap-dlts", "--extcap-interface", "sniff485:/dev/ttyUSB0", "--protocol", "mstp")
    assert "dlt {number=165}" in dlts
    config = ask("--extcap-config", "--extcap-interface", "sniff485:/dev/ttyUSB0", "--extcap-new-thing", "7")
    assert "{call=--protocol}" in config
    assert "{value=n2}" in config
    assert ask("--script").startswith("#!/bin/sh\n")


@pytest.mark.skipif(shutil.which("tshark") is None, reason="tshark is not installed")
@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
def test_tshark_reads_a_live_bus_and_its_going_ends_the_capture(tmp_path: Path, virtual_bus: Callable) -> None:
    fifo = tmp_path / "fifo"
    os.mkfifo(fifo)
    bus = virtual_bus("modbus-rtu", faults=False)
    port = f"sniff485:{bus.tap()}"
    capture = subprocess.Popen([*COMMAND, "--capture", "--fifo", str(fifo), "--extcap-interface", port,
                                "-p", "modbus-rtu", "-s", "19200,8E1"])  # fmt: skip
    try:
        with fifo.open("rb") as stream:
            command = [
                "tshark",
                "-n",
                "-i",
                "-",
                "-c",
                "8",
                "-T",
                "fields",
                "-e",
                "mbrtu.unit_id",
                "-e",
                "_ws.malformed",
            ]
            ran = subprocess.run(command, stdin=stream, capture_output=True, text=True, timeout=60, check=True)
        assert capture.wait(30) == 0
    finally:
        capture.kill()
        capture.wait()
    units = [line.split("\t") for line in ran.stdout.splitlines()]
    assert len(units) == 8
    told = [unit for unit, _ in units if unit]  # noise has none: whoever begins to listen may hear half a frame
    assert len(told) >= 6
    assert set(told) <= {"0", "1", "2", "3", "4"}
    assert all(not malformed for _, malformed in units)
