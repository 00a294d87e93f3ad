"""The README of a folder names its files, all of them, and none that is not there."""

from __future__ import annotations

import re
from pathlib import Path

from sniff.cli import COMMANDS

ROOT = Path(__file__).parents[2]
FILE = re.compile(r"(?<![\w/*>])[\w/]+\.py\b")
"""Not one of any folder: `dissectors/<protocol>/text.py`."""


def read() -> list[tuple[Path, list[str]]]:
    """Each folder with a README, and the files that this names."""
    readmes = [path for package in ("dissectors", "sniff") for path in sorted((ROOT / package).rglob("README.md"))]
    return [(path.parent, FILE.findall(path.read_text(encoding="utf-8"))) for path in readmes]


def test_every_file_is_named() -> None:
    commands = {f"{name}.py" for name in COMMANDS}  # of which there is a table
    missing = []
    for folder, named in read():
        known = {"__init__.py", *(Path(name).name for name in named), *(commands if folder.name == "cli" else ())}
        missing += [str(file.relative_to(ROOT)) for file in sorted(folder.glob("*.py")) if file.name not in known]
    assert missing == []


def test_no_file_is_named_that_is_not_there() -> None:
    everywhere = {path.name for package in ("dissectors", "sniff", "tests") for path in (ROOT / package).rglob("*.py")}
    gone = []
    for folder, named in read():
        places = (folder, ROOT, ROOT / "sniff")
        away = [name for name in named if not any((place / name).exists() for place in places)]
        gone += [f"{folder.relative_to(ROOT)}: {name}" for name in away if "/" in name or name not in everywhere]
    assert gone == []
