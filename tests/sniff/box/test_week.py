"""An hour of the box in simulated time, with everything bad in it; a week is `python -m tests.bench.box_week`."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("termios")

from tests.bench.box_week import week

SEED = 1212603882  # three captures of one box are killed


def test_an_hour_with_everything_bad_in_it(tmp_path: Path) -> None:
    counts = week(tmp_path, SEED, 1).counts
    assert counts["looks"] > 30
    assert counts["power cut"] + counts["capture killed"] >= 2
    assert counts["kept"] + counts["removed for room"] > 50
