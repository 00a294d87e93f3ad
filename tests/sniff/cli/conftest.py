"""Small captures, and the command line in this process."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from sniff.cli import main

POLL = """\
#!sniff-capture 1
# line: 19200,8E1
# protocol: modbus-rtu
# start: 2026-03-01T10:00:00Z
+0        01 03 00 00 00 02 C4 0B       # poll unit 1
+8.2      01 03 04 00 D7 00!P 1A CB C0  # parity error marked on one octet
~4.1      00!B                          # a break
+250      02 03 00 00 00 02 C4 38       # unit 2 does not answer
+1000     01 03 00 00 00 02 C4 0B
+9        01 83 02 C0 F1
+500      01 03 00 00 00 02 C4 0A       # wrong CRC
"""


@dataclass(frozen=True)
class Ran:
    """What a command did."""

    code: int
    out: str
    err: str


@pytest.fixture
def poll(tmp_path: Path) -> Path:
    path = tmp_path / "poll.cap.txt"
    path.write_text(POLL)
    return path


@pytest.fixture
def sniff485(capsys: pytest.CaptureFixture[str]) -> Callable[..., Ran]:
    def run(*arguments: object) -> Ran:
        try:
            code = main([str(argument) for argument in arguments])
        except SystemExit as end:  # argparse
            code = end.code if isinstance(end.code, int) else 1
        captured = capsys.readouterr()
        return Ran(code, captured.out, captured.err)

    return run
