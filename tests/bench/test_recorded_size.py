"""Size of a recording with everything derived, and what each topic costs, from an hour of a bus.

Run with `make bench ARGS="-k recorded_size"`; the figures stand in `extra_info`, MB a day.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.bench.recorded_bus import polls, record

SECONDS = 3600
MOST = 80.0
"""MB a day at 50 frames a second."""

TOPICS = {
    "octets alone": ("",),
    "with /bus": ("/bus",),
    "with /nodes": ("/nodes",),
    "with /values": ("/values",),
    "with everything": ("/",),
}


@pytest.mark.benchmark(group="recorded size, MB a day")
@pytest.mark.parametrize("name", TOPICS)
def test_recorded_size(benchmark: Any, tmp_path: Path, name: str) -> None:
    (prefix,) = TOPICS[name]
    path = tmp_path / "a.mcap"
    size = benchmark.pedantic(
        record, (path, polls(SECONDS), lambda topic: bool(prefix) and topic.startswith(prefix)), rounds=1
    )
    a_day = size * 86_400 / SECONDS / 1e6
    benchmark.extra_info["mb_a_day"] = round(a_day, 1)
    print(f"{name}: {a_day:.1f} MB a day")
    assert a_day <= MOST
