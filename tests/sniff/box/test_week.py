"""An hour of the box in simulated time, with everything bad in it; a week is `python -m tests.bench.box_week`."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

pytest.importorskip("termios")

from tests.bench.box_week import week


def test_an_hour_with_everything_bad_in_it(tmp_path: Path) -> None:
    seed = random.SystemRandom().randrange(1, 1 << 31)
    print(f"seed {seed}: python -m tests.bench.box_week --hours 1 --seed {seed}")
    counts = week(tmp_path, seed, 1).counts
    assert counts["looks"] > 30
    assert counts["power cut"] + counts["capture killed"] >= 2
    assert counts["kept"] + counts["removed for room"] > 50
