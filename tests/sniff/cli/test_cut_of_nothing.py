"""A cut of a stretch with nothing in it writes nothing, and what was there stays."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.sniff.cli.conftest import Ran

CLEAN = Path(__file__).parents[3] / "captures" / "rtu-clean.cap.txt"


@pytest.mark.parametrize("words", [("--from", "+1000"), ("--frames", "1-9", "-Y", "dst == 99")])
def test_a_cut_of_nothing_leaves_what_was_there(
    words: tuple[str, ...], tmp_path: Path, sniff485: Callable[..., Ran]
) -> None:
    there, fresh = tmp_path / "there.mcap", tmp_path / "fresh.mcap"
    there.write_bytes(b"of before")
    for path, force in ((there, ["-f"]), (fresh, [])):
        ran = sniff485("cut", CLEAN, "-o", path, *force, *words)
        assert ran.code == 2
        assert "nothing in that stretch; nothing is written" in ran.err
    assert there.read_bytes() == b"of before"
    assert not fresh.exists()
    assert sniff485("cut", CLEAN, "-o", there, "-f", "--frames", "1-9").code == 0
    assert there.stat().st_size > len(b"of before")
