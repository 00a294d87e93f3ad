"""An hour of a busy bus at 115200 Bd through the `record` command itself, ten times as fast as it was.

    python -m pytest tests/bench/test_recorded_hour.py -o norecursedirs=.venv -s

The hour is simulated into a capture, `replay` plays it to a TCP port at ten times its speed, and `record` hears it as a
bus of 1,152,000 Bd. Takes some seven minutes; says what both processes of `record` hold every simulated minute.
"""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from dissectors.frame import Chunk
from sniff.recording.writer import Recorder
from sniff.simulation.scenarios import scenario, simulate
from sniff.simulation.tap import FTDI_LOW_LATENCY

SPEED = 10
MINUTES = 60
ALLOWED = 8_000_000
"""Octets that a process may grow by between a quarter of the hour and its end: what a reader that was behind holds."""


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_record_holds_an_hour_in_flat_memory(tmp_path: Path) -> None:
    played, recorded = tmp_path / "hour.mcap", tmp_path / "recorded.mcap"
    octets = _simulate(played)
    replay = _command("replay", str(played), "--to", "tcp", "--speed", str(SPEED), stdout=subprocess.PIPE)
    assert replay.stdout is not None
    port = _announced_port(replay.stdout.readline())
    record = _command(
        "record",
        f"socket://127.0.0.1:{port}",
        "-s",
        f"{115200 * SPEED},8N1",
        "-p",
        "modbus-rtu",
        "-q",
        "-w",
        str(recorded),
    )
    held: list[dict[int, int]] = []
    try:
        while replay.poll() is None and len(held) < 2 * MINUTES:
            time.sleep(60 / SPEED)
            held.append(_resident_of(record.pid))
            print(
                f"{len(held):3d} min  " + "  ".join(f"{size / 1e6:6.1f} MB" for size in held[-1].values()), flush=True
            )
    finally:
        record.send_signal(signal.SIGINT)
        record.wait(60)
        replay.kill()
        replay.wait(60)
    told = json.loads(_output("info", "--json", str(recorded)))
    print(told)
    assert told["octets"] == octets
    early, late = held[MINUTES // 4], held[MINUTES - 2]
    assert early.keys() == late.keys()
    for process, size in late.items():
        assert size < early[process] + ALLOWED


def _simulate(path: Path) -> int:
    session, items = simulate(scenario("modbus-rtu-busy", seed=11), 60 * MINUTES, FTDI_LOW_LATENCY)
    recorder = Recorder(path, session)
    for item in items:
        if isinstance(item, Chunk):
            recorder.chunk(item)
        else:
            recorder.line(item)
    recorder.close()
    return recorder.octets


def _command(*words: str, stdout: int | None = None) -> subprocess.Popen[str]:
    return subprocess.Popen([sys.executable, "-m", "sniff", *words], stdout=stdout, text=True)


def _output(*words: str) -> str:
    return subprocess.run([sys.executable, "-m", "sniff", *words], stdout=subprocess.PIPE, text=True, check=True).stdout


def _announced_port(line: str) -> int:
    found = re.search(r":(\d+)", line)
    assert found, line
    return int(found[1])


def _resident_of(pid: int) -> dict[int, int]:
    """Octets that the process and its children hold in memory, by process."""
    tasks = Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii").split()
    return {each: _resident(each) for each in (pid, *map(int, tasks))}


def _resident(pid: int) -> int:
    return int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1]) * os.sysconf("SC_PAGE_SIZE")
