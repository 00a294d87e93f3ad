"""Times count from the capture's start and are never negative; a table without rows says what is missing."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.engine.session import Session
from sniff.recording.writer import Recorder


@pytest.fixture
def foreign(tmp_path: Path) -> Path:
    path = tmp_path / "a.log"
    path.write_text("(0.010000) bus 01 03 00 00 00 02 C4 0B\n(0.900000) bus 01 03 00 00 00 02 C4 0B\n")
    return path


def test_the_first_read_began_before_its_stamp(foreign: Path, sniff485: Callable) -> None:
    shown = sniff485("show", foreign, "--json", "-s", "9600,8N1").out
    first, second = map(json.loads, shown.splitlines())
    assert (first["start_ns"], first["end_ns"]) == (0, 0)
    assert 0 < second["start_ns"] < second["end_ns"]
    assert second["end_ns"] == 890_000_000
    assert "-0." not in sniff485("show", foreign).out


def test_all_who_tell_when_a_row_began_count_alike(tmp_path: Path, sniff485: Callable) -> None:
    """A row that began before the start: `show`, filters, `check` and the page."""
    path = tmp_path / "a.cap.txt"
    text = "#!sniff-capture 1\n# line: 19200,8E1\n# protocol: modbus-rtu\n# start: 2026-03-01T10:00:00Z\n"
    path.write_text(text + "+0 01 03 00 00 00 02 C4 0B\n+500 01 03 00 00 00 02 C4 0B\n" * 4)
    rows = {row["no"]: row["start_ns"] for row in map(json.loads, sniff485("show", path, "--json").out.splitlines())}
    assert rows[1] == 0 < rows[2]
    found = [json.loads(line) for line in sniff485("check", path, "--json").out.splitlines()]
    told = [frame for finding in found for frame in finding["frames"]]
    assert 1 in {frame["no"] for frame in told}
    assert all(frame["start_ns"] == rows[frame["no"]] for frame in told)
    assert all(0 <= finding["first_ns"] <= finding["last_ns"] for finding in found)
    assert "-0." not in sniff485("check", path).out
    for finding in json.loads(sniff485("report", path, "--json").out)["findings"]:
        assert all(row["at"] == rows[row["no"]] / 1e9 for row in finding["evidence"])
        assert 0 <= finding["first"] <= finding["last"]
    assert sniff485("show", path, "-T", "fields", "-e", "frame.time_relative", "-c", "1").out == "0\n"
    for how in ((), ("--reference",)):
        for test in ("frame.time_relative == 0 s", "start_ns == 0"):
            shown = sniff485("show", path, "-Y", test, "-T", "fields", "-e", "no", *how).out
            assert shown.splitlines() == ["1"], (test, how)
        assert len(sniff485("show", path, "-Y", "frame.time_relative >= 0 s", *how).out.splitlines()) == len(rows)


def test_between_the_ends_of_what_a_file_can_say(tmp_path: Path, sniff485: Callable) -> None:
    """584 years, twice what int64 holds in ns: as text and as JSON, many rows at a time as one by one."""
    path = tmp_path / "a.mcap"
    session = Session("a", LineSettings.parse("19200,8E1"), "modbus-rtu", -(1 << 63), "a")
    recorder = Recorder(path, session)
    for time in (-(1 << 63), 500, (1 << 63) - 1):
        recorder.chunk(Chunk(time, bytes.fromhex("010300000002c40b")))
    recorder.close()
    for how in ((), ("--json",), ("-T", "fields", "-e", "start_ns")):
        quick, slow = (sniff485("show", path, *how, *more) for more in ((), ("--reference",)))
        assert (quick.code, quick.out) == (0, slow.out)
    assert "18446744073.70" in sniff485("show", path).out


def test_stats_without_stations_says_so(tmp_path: Path, sniff485: Callable) -> None:
    noise = tmp_path / "noise.hex"
    noise.write_text("FF\n")
    ran = sniff485("stats", noise)
    assert (ran.code, ran.out) == (0, "no stations were heard in 0 frames and 1 octets of noise\n")
    assert sniff485("stats", noise, "--json").out == ""
