"""What a file says of itself reaches the terminal only escaped, whichever command prints it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

HOSTILE = r"\u001b[2J\u202eboo"
TEXT = f"""\
#!sniff-capture 1
# line: 19200,8E1
# protocol: modbus-rtu
# start: 2026-03-01T10:00:00Z
# port: "{HOSTILE}"
# adapter: "{HOSTILE}"
# detail: "{HOSTILE}"
# note site: "{HOSTILE}"
+0        01 03 00 00 00 02 C4 0B
#! +1 note "{HOSTILE}"
#! +2 unplugged "{HOSTILE}"
#! +2 errors count=3 "{HOSTILE}"
+8.2      01 03 04 00 D7 00 1A CB C0
"""


@pytest.fixture
def hostile(tmp_path: Path) -> Path:
    path = tmp_path / "hostile.cap.txt"
    path.write_text(TEXT)
    return path


@pytest.mark.parametrize(
    "command",
    ["show", "show -V", "show --json --fields", "info", "info --json", "stats", "points",
     "points --csv", "diff {file}", "snapshot --check", "snapshot", "live --lines --no-record"],
)  # fmt: skip
def test_no_control_character_reaches_the_terminal(command: str, hostile: Path, sniff485: Callable) -> None:
    name, *options = command.format(file=hostile).split()
    ran = sniff485(name, hostile, *options)
    assert ran.code in (0, 1), ran.err
    assert ran.out + ran.err
    harmful = {character for character in ran.out + ran.err if not character.isprintable()} - {"\n"}
    assert not harmful


def test_nor_does_it_reach_an_expectation(hostile: Path, sniff485: Callable) -> None:
    assert sniff485("snapshot", hostile).code == 0
    written = hostile.with_name("hostile.expect.txt").read_text("utf-8")
    assert r"note 0 \x1b[2J\u202eboo" in written
    assert all(character.isprintable() for character in written.replace("\n", ""))
