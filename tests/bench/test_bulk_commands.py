"""The table of whole commands against tshark (`bulk_commands.py`), for `make bench`; FRAMES in the environment."""

from __future__ import annotations

import os
from typing import Any

import pytest

from tests.bench import bulk_commands


@pytest.mark.benchmark(group="long captures, whole commands")
@pytest.mark.timeout(3600)
def test_table(benchmark: Any, capsys: pytest.CaptureFixture[str]) -> None:
    def printed() -> None:
        with capsys.disabled():
            print()
            for line in bulk_commands.lines(int(os.environ.get("FRAMES", "100000")), bulk_commands.ROUNDS):
                print(line, flush=True)

    benchmark.pedantic(printed, rounds=1)
