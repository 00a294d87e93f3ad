"""Every code block of the README and of the documentation is carried out."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import pytest

from docs.generate.running import run
from tests.docs.blocks import ROOT, SAMPLE, carry_out, fenced, furnish, indented

PAGES = sorted((ROOT / "docs" / "pages").rglob("*.md"))


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An own folder with the captures; the program is on the path."""
    furnish(tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", os.path.dirname(sys.executable), prepend=os.pathsep)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    return tmp_path


@pytest.mark.timeout(600)  # some pages hold programs of their own; a busy machine takes its time
@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT / "docs" / "pages")))
def test_blocks_of_pages(page: Path, folder: Path) -> None:
    names: dict[str, Any] = {}
    for block in fenced(page.read_text(encoding="utf-8")):
        wrong = carry_out(block, names)
        assert not wrong, f"{page.name}:{block.line}: {wrong[0]}"


@pytest.mark.timeout(600)
def test_blocks_of_the_readme(folder: Path) -> None:
    for name in ("night", "before", "after", "near", "far"):
        assert run(["convert", SAMPLE, f"{name}.mcap"]).code == 0
    Path("meter.csv").write_text("address,name,type\n1,flow,u16\n")
    Path("sniff485.toml").write_text('[bus.boiler]\nport = "/dev/ttyUSB0"\n')
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    blocks = [*indented(text), *fenced(text)]
    assert {block.kind for block in blocks} >= {"commands", "toml", "python", "picture"}
    for block in blocks:
        wrong = carry_out(block, {})
        assert not wrong, f"README.md:{block.line}: {wrong[0]}"
