"""Frames for the N2 tests: those of the protocol notes, those of another implementation, and makers."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

SHARED = Path(__file__).parents[3] / "../shared"


def shared(name: str) -> Path:
    path = SHARED / name
    if not path.exists():
        pytest.skip(f"{name}: not here")
    return path


@pytest.fixture(scope="session")
def noted_frames() -> list[bytes]:
    """All tagged N2 frames of the protocol notes, in order."""
    notes = shared("protocols/n2.md").read_text(encoding="utf-8")
    return [m[1].encode("ascii") + b"\r" for m in re.finditer(r"^N2[CR] +(\S+)<CR>", notes, re.MULTILINE)]


@pytest.fixture(scope="session")
def digimat_frames() -> list[bytes]:
    """The 30 requests and replies made by the rules of digimat.n2, in order."""
    lines = shared("captures/vectors-n2open-digimat/frames.txt").read_text(encoding="utf-8").splitlines()
    return [bytes.fromhex(line.split("|")[0].split(" ", 1)[1]) for line in lines if not line.startswith("#")]
