"""Protocols do not know each other, and what they share knows none of them: for whatever the registry has."""

from __future__ import annotations

import ast
from pathlib import Path

import dissectors
from dissectors import registry

ROOT = Path(dissectors.__file__).parent
PROTOCOLS = sorted({target.partition(":")[0].split(".")[1] for target in registry.BUILT_IN.values()})


def imported(path: Path) -> set[str]:
    """The rooms of `dissectors` that a file imports from."""
    rooms: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import | ast.ImportFrom) else []
        if isinstance(node, ast.ImportFrom):
            names = [f"{node.module}.{name}" for name in names]
        rooms |= {name.split(".")[1] for name in names if name.startswith("dissectors.")}
    return rooms


def test_protocols_live_in_folders() -> None:
    assert all((ROOT / room / "__init__.py").exists() for room in PROTOCOLS)


def test_no_protocol_is_imported_from_outside_its_folder() -> None:
    own = {path: path.relative_to(ROOT).parts[0] for path in sorted(ROOT.rglob("*.py"))}
    assert {*own.values()} >= {*PROTOCOLS}
    strange = {path: imported(path) & {*PROTOCOLS} - {room} for path, room in own.items()}
    assert {str(path.relative_to(ROOT)): rooms for path, rooms in strange.items() if rooms} == {}
