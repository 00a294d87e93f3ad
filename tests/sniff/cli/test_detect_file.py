"""`detect` on a file: what its octets are, what it says of the line, what nobody can know; no port is opened."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable
from pathlib import Path

import pytest

from sniff.cli import main
from tests.sniff.cli.conftest import Ran

CAPTURES = Path(__file__).parents[3] / "captures"
LOG = "".join(
    f"10:00:{second:02d}.100 TX 01 03 00 00 00 02 C4 0B\n10:00:{second:02d}.140 RX 01 03 04 00 06 00 05 DA 31\n"
    for second in range(5)
)


def test_a_file_says_its_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["detect", str(CAPTURES / "ascii-clean.cap.txt")]) == 0
    said = capsys.readouterr().out
    assert "Modbus ASCII, 19200,7E1" in said
    assert "next: sniff485 open " in said


def test_what_a_log_does_not_say_is_not_claimed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "x.log"
    path.write_text(LOG)
    assert main(["detect", str(path), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["outcome"], found["protocol"], found["frames"], found["octets"]) == ("found", "modbus-rtu", 10, 85)
    assert "rate and format" in found["cannot_tell"][0]


def test_octets_that_are_nothing_are_not_found(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "x.log"
    path.write_text("RX 11 22 33 44 55 66 77 88\n" * 5)
    assert main(["detect", str(path)]) == 3
    assert "no protocol makes good frames" in capsys.readouterr().out


def test_a_file_that_is_not_there_is_no_port_trouble(tmp_path: Path, sniff485: Callable[..., Ran]) -> None:
    ran = sniff485("detect", tmp_path / "night.mcap")
    assert (ran.code, ran.out) == (3, "")
    assert "no such file" in ran.err


def test_the_next_command_can_be_typed_as_it_is(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "plant room; night.log"
    path.write_text(LOG)
    assert main(["detect", str(path)]) == 0
    (line,) = [line for line in capsys.readouterr().out.splitlines() if "next: " in line]
    assert shlex.split(line)[1:4] == ["sniff485", "open", str(path)]
