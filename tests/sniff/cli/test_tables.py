"""Tables: what people read, and what programs are given."""

from __future__ import annotations

import contextlib
import io

import pytest

from sniff.cli import tables
from sniff.cli.tables import name_of


@pytest.mark.parametrize(
    ("heading", "name"),
    [
        ("p50 ms", "p50_ms"),
        ("± ms", "plus_minus_ms"),
        ("load %", "load_percent"),
        ("frames/hold", "frames_per_hold"),
        ("MAC", "address"),
        ("slave", "address"),
        ("no answer", "unanswered"),
        ("GAP polls", "gap_polls"),
    ],
)
def test_programs_have_names_for_headings(heading: str, name: str) -> None:
    assert name_of(heading) == name


class _Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize("room", [20, 40, 60, 200])
def test_a_table_fits_its_terminal_where_it_can(room: int, monkeypatch: pytest.MonkeyPatch) -> None:
    words = "no answer to any of 140 requests, and octets that are no good answer followed 23 times"
    rows = [("station 1", words, 7), ("bus", "not found", 123)]
    monkeypatch.setenv("COLUMNS", str(room))
    shown = _Terminal()
    with contextlib.redirect_stdout(shown):
        tables.write(("subject", "what", "times"), rows)
    lines = shown.getvalue().splitlines()
    fits = room >= len("station 1") + tables.APART + tables.LEAST + tables.APART + len("times")
    assert (max(map(len, lines)) <= room) == fits
    if fits:
        at, end = lines[0].index("what"), lines[0].index("times")
        assert " ".join(line[at:end].strip() for line in lines[1:-1]) == words
