"""The captures and vectors of others (../shared/captures beside the checkout), read for tests.

Tests that need them skip with a reason where the folder is absent.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import pytest

CAPTURES = Path(__file__).parents[1] / "../shared/captures"


@dataclass(frozen=True, slots=True)
class Listed:
    """A line of a frames.txt: `when` as written (a time or an index), and what stands after `;`."""

    when: str
    octets: bytes
    note: str


@dataclass(frozen=True, slots=True)
class Timed:
    """One octet as a logic analyser saw it; ns from the begin of the capture."""

    start: int
    end: int
    line: str
    octet: int


def folder(name: str) -> Path:
    """The folder of a capture; skips the test where there is none."""
    path = CAPTURES / name
    if not path.is_dir():
        pytest.skip(f"shared captures are not here ({name})")
    return path


def listed(name: str) -> list[Listed]:
    """The frames of a capture, from its frames.txt; lines without octets are left out."""
    found = []
    for line in (folder(name) / "frames.txt").read_text().splitlines():
        if not line.strip() or line.startswith("#"):
            continue
        body, _, note = line.partition(";")
        when, _, text = body.strip().partition(" ")
        text = text.partition("|")[0].strip()
        if text and text != "-":
            found.append(Listed(when, bytes.fromhex(text), note.strip()))
    return found


def timed(name: str) -> list[Timed]:
    """The octets of a logic-analyser capture, its lines merged by time as a shared bus carries them."""
    with (folder(name) / "octets.csv").open(newline="") as file:
        found = [
            Timed(_ns(row["t_start_s"]), _ns(row["t_end_s"]), row["line"], int(row["octet"], 16))
            for row in csv.DictReader(file)
        ]
    return sorted(found, key=lambda octet: octet.end)


def _ns(seconds: str) -> int:
    whole, _, part = seconds.partition(".")
    return int(whole) * 1_000_000_000 + int(part.ljust(9, "0")[:9])
