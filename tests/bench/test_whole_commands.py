"""Whole commands on a Modbus RTU capture of some 12,000 frames, against tshark on the same frames as pcapng (link type
252, what it reads without set-up): counting, fields of every frame, a filter, and opening."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from dissectors.frame import Chunk
from sniff.recording.writer import Recorder
from sniff.simulation.scenarios import scenario, simulate
from sniff.simulation.tap import EXACT

SECONDS = 100
ROUNDS = 2
pytestmark = [pytest.mark.benchmark(min_rounds=ROUNDS, warmup=False), pytest.mark.timeout(600)]
with_tshark = pytest.mark.skipif(shutil.which("tshark") is None, reason="tshark is not installed")


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Path:
    session, items = simulate(scenario("modbus-rtu-busy", seed=11), SECONDS, EXACT)
    path = tmp_path_factory.mktemp("bench") / "busy.mcap"
    recorder = Recorder(path, session)
    for item in items:
        if isinstance(item, Chunk):
            recorder.chunk(item)
    recorder.close()
    return path


@pytest.fixture(scope="module")
def packets(capture: Path) -> Path:
    path = capture.with_suffix(".pcapng")
    ours("convert", str(capture), str(path), "--link-type", "252")
    return path


def ours(*words: str) -> str:
    return run(sys.executable, "-m", "sniff", *words)


def run(*command: str) -> str:
    return subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True, timeout=300).stdout


@pytest.mark.benchmark(group="rtu: count everything")
class TestCounting:
    def test_ours(self, benchmark: Any, capture: Path) -> None:
        assert "frames" in benchmark.pedantic(ours, ("info", str(capture)), rounds=ROUNDS)

    @with_tshark
    def test_tshark(self, benchmark: Any, packets: Path) -> None:
        command = ("tshark", "-n", "-r", str(packets), "-q", "-z", "io,stat,0")
        assert "Frames" in benchmark.pedantic(run, command, rounds=ROUNDS)


@pytest.mark.benchmark(group="rtu: fields of every frame")
class TestFields:
    def test_ours(self, benchmark: Any, capture: Path) -> None:
        words = ("show", str(capture), "-T", "fields", "-e", "frame.number", "-e", "modbus.func_code")
        assert len(benchmark.pedantic(ours, words, rounds=ROUNDS).splitlines()) > 100 * SECONDS

    @with_tshark
    def test_tshark(self, benchmark: Any, packets: Path) -> None:
        command = ("tshark", "-n", "-r", str(packets), "-T", "fields", "-e", "frame.number", "-e", "modbus.func_code")
        assert len(benchmark.pedantic(run, command, rounds=ROUNDS).splitlines()) > 100 * SECONDS


@pytest.mark.benchmark(group="rtu: lines of a filter")
class TestFilter:
    def test_ours(self, benchmark: Any, capture: Path) -> None:
        assert benchmark.pedantic(ours, ("show", str(capture), "-Y", "modbus.func_code == 16"), rounds=ROUNDS)

    @with_tshark
    def test_tshark(self, benchmark: Any, packets: Path) -> None:
        command = ("tshark", "-n", "-r", str(packets), "-Y", "modbus.func_code == 16")
        assert benchmark.pedantic(run, command, rounds=ROUNDS)
