"""The application names no protocol: whatever it must know of one, it asks the manifest."""

from __future__ import annotations

import re
from pathlib import Path

SNIFF = Path(__file__).parents[2] / "sniff"
NAMES = re.compile(r"modbus|bacnet|\bms/?tp\b|\bmstp|metasys|\bn2\b|profibus|\brtu\b", re.IGNORECASE)

OTHERS_TOOLS = {"log_shapes.py"}
"""Data about tools of others, which bear the names of protocols."""


def test_no_module_names_a_protocol() -> None:
    paths = sorted(path for path in SNIFF.rglob("*.py") if path.name not in OTHERS_TOOLS)
    assert len(paths) > 400
    assert [
        f"{path.relative_to(SNIFF)}:{no}: {line.strip()}"
        for path in paths
        for no, line in enumerate(path.read_text().splitlines(), 1)
        if NAMES.search(line)
    ] == []
