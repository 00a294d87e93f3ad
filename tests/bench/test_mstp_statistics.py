"""From a file of 65,535 MS/TP frames to statistics, as whole processes: ours against tshark's."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

CAPTURE = Path(__file__).parents[3] / "shared/captures/mstp-md5-2018-good1/mstp_2018_Good1.cap"
pytestmark = [
    pytest.mark.benchmark(group="mstp-statistics", min_rounds=2, warmup=False),
    pytest.mark.skipif(not CAPTURE.exists(), reason="shared captures are not here"),
    pytest.mark.timeout(600),
]


def run(*command: str) -> str:
    return subprocess.run(command, capture_output=True, text=True, check=True, timeout=300).stdout


def test_ours_ring_and_nodes(benchmark: Any) -> None:
    out = benchmark.pedantic(run, (sys.executable, "-m", "sniff", "stats", str(CAPTURE), "ring"), rounds=2)
    assert "ring of 3: 2 → 17 → 47 → 2" in out


@pytest.mark.skipif(shutil.which("tshark") is None, reason="tshark is not installed")
def test_tshark_io_stat(benchmark: Any) -> None:
    out = benchmark.pedantic(run, ("tshark", "-n", "-r", str(CAPTURE), "-q", "-z", "io,stat,0"), rounds=2)
    assert "65535" in out
