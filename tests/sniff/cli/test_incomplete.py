"""A capture that ends too early: every command says so, also where its output has no place for it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from sniff.cli import main
from tests.sniff.cli.conftest import Ran

CAPTURES = Path(__file__).parents[3] / "captures"


@pytest.fixture
def cut(tmp_path: Path, poll: Path, sniff485: Callable[..., Ran]) -> Path:
    """A recording whose end is missing."""
    whole = tmp_path / "whole.mcap"
    assert sniff485("convert", poll, whole).code == 0
    path = tmp_path / "cut.mcap"
    path.write_bytes(whole.read_bytes()[:-400])
    return path


@pytest.mark.parametrize("table", ["nodes", "health", "transactions", "latency", "load", "polls"])
@pytest.mark.parametrize("style", [[], ["--json"]])
def test_stats_say_that_not_all_was_counted(
    table: str, style: list[str], cut: Path, poll: Path, sniff485: Callable[..., Ran]
) -> None:
    assert "cut at octet" in sniff485("stats", cut, table, *style).err
    assert sniff485("stats", poll, table, *style).err == ""


@pytest.mark.parametrize("form", ["json", "junit"])
def test_check_says_it_beside_what_programs_read(form: str, cut: Path, sniff485: Callable[..., Ran]) -> None:
    ran = sniff485("check", cut, "--format", form)
    assert ran.err.count("cut at octet") == 1
    assert ran.err.startswith(f"sniff485: {cut}: ")


def test_check_says_it_once_where_people_read(cut: Path, sniff485: Callable[..., Ran]) -> None:
    ran = sniff485("check", cut)
    assert (ran.out.count("cut at octet"), ran.err) == (1, "")


def test_a_folder_is_no_capture_and_no_missing_file(tmp_path: Path, sniff485: Callable[..., Ran]) -> None:
    folder = tmp_path / "archive"
    folder.mkdir()
    ran = sniff485("check", folder)
    assert ran.code == 3
    assert "a directory, not a capture" in ran.err
    assert "no such file" in sniff485("check", tmp_path / "none").err


def test_an_expectation_that_is_no_text_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    capture = tmp_path / "poll.cap.txt"
    capture.write_bytes((CAPTURES / "rtu-clean.cap.txt").read_bytes())
    (tmp_path / "poll.expect.txt").write_bytes(b"\xff\xfe")
    assert main(["snapshot", "--check", str(capture)]) == 3
    assert "not in UTF-8" in capsys.readouterr().err
