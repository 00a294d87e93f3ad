"""Words that are no command, no profile: one line, with the way out."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.sniff.cli.conftest import Ran


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


def test_a_bus_that_is_not_there_is_missed_in_the_file(poll: Path, sniff485: Callable[..., Ran]) -> None:
    ran = sniff485("info", poll, "--bus", "west")
    assert ran.code == 3
    assert ran.err.startswith(f"sniff485: {poll}: no bus 'west' in it")


def test_a_stretch_that_ends_before_it_begins_is_not_cut(
    poll: Path, tmp_path: Path, sniff485: Callable[..., Ran]
) -> None:
    out = tmp_path / "out.cap.txt"
    ran = sniff485("cut", poll, "-o", out, "--from", "+5", "--to", "+3")
    assert (ran.code, ran.err) == (2, "sniff485: --from +5 is after --to +3\n")
    assert not out.exists()
