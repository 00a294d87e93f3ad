"""Several findings of a rule about one station are one line of the answer, found on one day."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from dissectors.checksums import crc16_modbus
from sniff.cli import main


def made(path: Path) -> None:
    """A station that refuses two of the three things that it is asked for."""
    lines, asked = ["#!sniff-capture 1", "# line: 19200,8E1", "# protocol: modbus-rtu"], 0
    for number in range(90):
        refused = number % 3 < 2
        for wait, octets in (
            (200, bytes((1, 3, number % 3, 0, 0, 1))),
            (15, b"\x01\x83\x02" if refused else b"\x01\x03\x02\x00\x07"),
        ):
            lines.append(f"+{wait} {(octets + crc16_modbus(octets).to_bytes(2, 'little')).hex(' ')}")
            asked += 1
    path.write_text("\n".join(lines) + "\n")


def test_it_says_how_many_and_of_how_many_days(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    made(tmp_path / "x.cap.txt")
    main(["check", str(tmp_path / "x.cap.txt"), "--json", "--only", "MB008"])
    found = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert len(found) == 2
    fleet = ["fleet", "--workers", "1", "--no-index", str(tmp_path)]
    main([*fleet, "--json"])
    (bus,) = [one for line in capsys.readouterr().out.splitlines() if "findings" in (one := json.loads(line))]
    (one,) = [each for each in bus["findings"] if each["code"] == "MB008"]
    assert (len(one["days"]), one["alike"]) == (1, 1)
    assert one["count"] == sum(each["count"] for each in found)
    main(fleet)
    (line,) = [line for line in capsys.readouterr().out.splitlines() if "MB008" in line]
    assert line.endswith("(and 1 more like it)")
    assert " days" not in line
