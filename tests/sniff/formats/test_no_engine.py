"""File formats know values of the engine (sessions, items, blocks) and run none: what needs frames is handed them."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

FORMATS = Path(__file__).parents[3] / "sniff" / "formats"
VALUES = {"blocks", "capture", "capture_error", "event_texts", "read_times", "session"}
"""Modules of `sniff.engine` that hold values only."""


def imported(path: Path) -> set[str]:
    """Modules that a file imports, at its head or later."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.ImportFrom):
            names |= {node.module or ""} | {f"{node.module}.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
    return names


@pytest.mark.parametrize("path", sorted(FORMATS.glob("*.py")), ids=lambda path: path.name)
def test_a_format_runs_no_engine(path: Path) -> None:
    for name in imported(path):
        parts = name.split(".")
        assert parts[:2] not in (["sniff", "analysis"], ["sniff", "bus"]), name
        assert parts[:2] != ["sniff", "engine"] or len(parts) < 3 or parts[2] in VALUES, name
