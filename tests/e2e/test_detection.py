"""`detect` and `-p auto` on pseudo-terminals with simulated stations: found, gone on with, never opened twice."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from itertools import islice
from pathlib import Path

import pytest

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.cli import main
from sniff.formats import read
from sniff.simulation.bus import VirtualBus
from sniff.simulation.ports import HAS_PTY
from sniff.simulation.scenarios import scenario
from tests.e2e.running import PATIENCE, rest_of

LONGEST = 40
"""Octets that a frame of the simulated bus has at most, on average."""

pytestmark = pytest.mark.skipif(not HAS_PTY, reason="this system has no pseudo-terminals")


def sniff485(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "sniff", *arguments], capture_output=True, text=True, timeout=100, check=False
    )


@pytest.mark.parametrize("protocol", ["modbus-rtu", "modbus-ascii", "n2", "mstp"])
def test_the_protocol_is_found_and_not_one_octet_leaves(protocol: str) -> None:
    with VirtualBus.from_scenario(scenario(protocol, 1)) as bus:
        port = bus.tap()
        ran = sniff485("detect", port, "--json", "--timeout", "60")
        written = bus.report().written
    assert ran.returncode == 0, ran.stderr
    found = json.loads(ran.stdout)
    assert (found["outcome"], found["protocol"]) == ("found", protocol)
    assert found["frames"] >= 3
    assert any("octets come through no line" in words for words in found["cannot_tell"])
    assert not any(written.get(name, 0) for name in written if name.startswith("tap"))


def test_a_silent_bus_is_called_silent() -> None:
    with VirtualBus(LineSettings.parse("9600,8N1")) as bus:
        ran = sniff485("detect", bus.tap(), "--timeout", "1")
    assert ran.returncode == 4
    assert "silent" in ran.stdout


def test_rubbish_is_not_called_silent() -> None:
    with VirtualBus(LineSettings.parse("115200,8N1")) as bus:
        port, noise = bus.tap(), bus.connect("noise")
        noise.write(bytes(range(7, 250, 3)) * 3)
        process = subprocess.Popen(
            [sys.executable, "-m", "sniff", "detect", port, "--json", "--timeout", "3"],
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        while process.poll() is None:
            noise.write(bytes(range(7, 250, 3)))
            noise.read(0.1)
        assert process.stdout is not None
        with process.stdout:
            found = json.loads(process.stdout.read())
    assert process.returncode == 4
    assert found["outcome"] == "unknown"
    assert found["octets"] > 0


def heard(path: Path) -> bytes:
    """What is in a file so far."""
    return b"".join(item.octets for item in read(path).items() if isinstance(item, Chunk)) if path.exists() else b""


def test_record_goes_on_with_what_was_found_on_the_same_opening(tmp_path: Path) -> None:
    path = tmp_path / "found.mcap"
    with VirtualBus.from_scenario(scenario("mstp", 1, False)) as bus:
        words = "record", bus.tap(), "-p", "auto", "-s", "38400,8N1", "-w", str(path)
        process = subprocess.Popen(
            [sys.executable, "-m", "sniff", *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        assert process.stderr is not None
        found = next((line for line in process.stderr if "BACnet MS/TP, 38400,8N1" in line), "")
        octets = len(heard(path))
        until = time.monotonic() + PATIENCE
        while len(heard(path)) < octets + 60 * LONGEST and time.monotonic() < until:
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        _, errors = rest_of(process)
    assert process.returncode == 0, found + errors
    capture = read(path)
    assert (capture.session.protocol, str(capture.session.line)) == ("mstp", "38400,8N1")
    shown = sniff485("info", "--json", str(path))
    info = json.loads(shown.stdout)
    assert info["complete"] is True
    assert info["frames"] > 50
    assert info["damaged"] <= 1  # recording began somewhere in a frame


def test_live_goes_on_with_what_was_found(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "sniff", "live", "-s", "auto", "-p", "n2", "--no-record", "--json"]
    with VirtualBus.from_scenario(scenario("n2", 1, False)) as bus:
        ran = subprocess.Popen([*command, bus.tap()], stdout=subprocess.PIPE, text=True)
        assert ran.stdout is not None
        heard = (row for row in map(json.loads, ran.stdout) if "record" not in row)
        rows = list(islice(heard, 6))
        ran.send_signal(signal.SIGINT)
        ran.communicate()
    assert ran.returncode == 0
    assert {row["proto"] for row in rows} <= {"n2", None}


def test_a_file_that_exists_is_refused_before_it_is_lost(tmp_path: Path) -> None:
    path = tmp_path / "kept.mcap"
    path.write_bytes(b"precious")
    with VirtualBus.from_scenario(scenario("n2", 1, False)) as bus:
        assert main(["record", bus.tap(), "-p", "auto", "-w", str(path), "--duration", "1"]) == 3
    assert path.read_bytes() == b"precious"
