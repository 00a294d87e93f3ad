"""Tables: what people read, and what programs are given."""

from __future__ import annotations

import pytest

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
