"""Words that are no command, no profile: one line, with the way out."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest


@pytest.mark.parametrize(
    ("word", "way_out"), [("shw", "'show'"), ("chek", "'check'"), ("xyzzy", "sniff485 --help"), ("/dev/null", "live")]
)
def test_a_word_that_is_no_command(word: str, way_out: str, sniff485: Callable) -> None:
    ran = sniff485(word)
    assert ran.code == 2
    assert ran.out == ""
    assert len(ran.err.splitlines()) == 1
    assert way_out in ran.err


def test_a_file_without_a_command(poll: Path, sniff485: Callable) -> None:
    ran = sniff485(str(poll))
    assert ran.code == 2
    assert f"sniff485 open {poll}" in ran.err


def test_profiles_are_checked_by_name_or_file(tmp_path: Path, sniff485: Callable) -> None:
    assert sniff485("profile", "check", "teco-e510").code == 0
    ran = sniff485("profile", "check", "teco-e51O")
    assert ran.code == 3
    assert "did you mean 'teco-e510'?" in ran.err
    broken = tmp_path / "pump.toml"
    broken.write_text("nothing = ")
    assert sniff485("profile", "check", str(broken)).code == 3
