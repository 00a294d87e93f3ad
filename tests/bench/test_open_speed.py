"""What a user of `open` waits for (`open_speed.py`), for `make bench`; FRAMES in the environment (100000)."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

from tests.bench import open_speed


@pytest.mark.benchmark(group="long captures in the terminal UI")
@pytest.mark.timeout(3600)
def test_table(benchmark: Any, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = open_speed.capture_file(tmp_path, int(os.environ.get("FRAMES", "100000")))

    def printed() -> None:
        with capsys.disabled():
            print()
            for line in open_speed.lines(path):
                print(line, flush=True)

    benchmark.pedantic(printed, rounds=1)
