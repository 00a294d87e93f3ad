"""Files that do not say their line settings: what is assumed is said, and follows the protocol that the user names."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

SAID = "no line settings in "


@pytest.fixture
def hex_log(tmp_path: Path) -> Path:
    path = tmp_path / "a.hex"
    path.write_text("01 03 00 00 00 02 C4 0B\n")
    return path


@pytest.mark.parametrize("command", ["info", "show", "check", "stats", "points"])
def test_the_guess_is_said_once(sniff485: Callable[..., Any], hex_log: Path, command: str) -> None:
    said = sniff485(command, hex_log).err
    assert said.count(f"{SAID}{hex_log}: assuming 19200,8E1 for modbus-rtu; -s names them") == 1
    assert SAID not in sniff485(command, hex_log, "-s", "9600,8N1").err


def test_info_marks_the_guess(sniff485: Callable[..., Any], hex_log: Path) -> None:
    assert "Modbus RTU, 19200,8E1 (assumed)" in sniff485("info", hex_log).out
    assert "19200,8E1 (assumed)" not in sniff485("info", hex_log, "-s", "19200,8E1").out
    assert '"line_assumed":true' in sniff485("info", hex_log, "--json").out.replace(" ", "")


def test_the_guess_follows_the_protocol(sniff485: Callable[..., Any], hex_log: Path) -> None:
    assert "BACnet MS/TP, 38400,8N1 (assumed)" in sniff485("info", hex_log, "-p", "mstp").out


def test_a_file_that_knows_its_line_keeps_it(sniff485: Callable[..., Any], poll: Path) -> None:
    known = sniff485("info", poll)
    assert SAID not in known.err
    line = next(row.split(",", 1)[1] for row in known.out.splitlines() if row.startswith("  protocol"))
    assert f"Metasys N2,{line}" in sniff485("info", poll, "-p", "n2").out


@pytest.mark.parametrize("command", ["convert", "anonymise"])
def test_a_copy_does_not_make_it_a_fact(
    sniff485: Callable[..., Any], hex_log: Path, tmp_path: Path, command: str
) -> None:
    copy = tmp_path / "copy.mcap"
    out = [copy] if command == "convert" else ["-o", copy]
    assert sniff485(command, hex_log, *out).code == 0
    assert f"{SAID}{copy}" in sniff485("info", copy).err
    assert sniff485(command, hex_log, *out, "-f", "-s", "9600,8N1").code == 0
    assert SAID not in sniff485("info", copy).err
