"""What earlier runs left: cut parts of several buses are made whole in their place; nothing else is touched."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from sniff.box import past, shipped
from sniff.recording.reader import McapCapture, buses_of
from sniff.recording.recovery import recover
from sniff.recording.rotated import RotatedCapture
from sniff.recording.rotation import Rotation, part_name
from sniff.recording.writer import SharedFile
from tests.sniff.recording.test_several_buses import SESSIONS, close, given, record


@pytest.fixture
def parts(tmp_path: Path) -> list[Path]:
    """Three parts of three buses, the last one cut in its middle."""
    shared = SharedFile(tmp_path / "site.mcap", SESSIONS, Rotation(count=150))
    recorders = shared.recorders()
    record(recorders, given(3, 400))
    close(recorders)
    paths = list(recorders[0].paths)
    assert len(paths) == 3
    octets = paths[-1].read_bytes()
    paths[-1].write_bytes(octets[: len(octets) * 2 // 3])
    return paths


def test_a_cut_part_is_closed_and_keeps_its_place(tmp_path: Path, parts: list[Path]) -> None:
    before = [list(capture.items()) for capture in buses_of(parts[-1])]
    together = [list(RotatedCapture([McapCapture(one, bus) for one in parts]).items()) for bus in range(3)]
    assert past.cut_parts(tmp_path / "site.mcap") == [parts[-1]]
    told = past.close_part(parts[-1], 0)
    assert told.closed
    assert "cut at octet" in told.text
    assert past.cut_parts(tmp_path / "site.mcap") == []
    after = buses_of(parts[-1])
    assert [list(capture.items()) for capture in after] == before
    assert all(capture.completeness().whole for capture in after)
    assert [capture.part for capture in after] == [3] * 3
    assert [capture.session.notes["recovered"] for capture in after] == [told.text] * 3
    for bus, items in enumerate(together):
        whole = RotatedCapture([McapCapture(one, bus) for one in parts])
        assert whole.completeness().whole
        assert list(whole.items()) == items


def test_a_whole_recording_of_several_buses_is_as_it_was(tmp_path: Path, parts: list[Path]) -> None:
    assert recover(parts[0], tmp_path / "again.mcap").whole
    again = buses_of(tmp_path / "again.mcap")
    assert [list(one.items()) for one in again] == [list(one.items()) for one in buses_of(parts[0])]


def test_what_cannot_be_closed_is_left_and_said(tmp_path: Path, parts: list[Path], monkeypatch) -> None:
    octets = parts[-1].read_bytes()
    free = shutil.disk_usage(tmp_path).free
    told = past.close_part(parts[-1], free)
    assert (told.closed, parts[-1].read_bytes()) == (False, octets)
    assert "no room" in told.why_not
    parts[-1].write_bytes(bytes(4096))  # what some file systems leave
    told = past.close_part(parts[-1], 0)
    assert not told.closed
    assert "not an MCAP file" in told.why_not
    assert parts[-1].exists()
    parts[-1].write_bytes(b"")
    assert past.close_part(parts[-1], 0).why_not == "removed"
    assert not parts[-1].exists()


def test_a_part_that_somebody_has_open_is_nobodys_business(tmp_path: Path, parts: list[Path]) -> None:
    with parts[-1].open("ab"):
        assert past.cut_parts(tmp_path / "site.mcap") == []


def test_other_files_stay(tmp_path: Path, parts: list[Path]) -> None:
    (tmp_path / ".site-0003.mcap.99.tmp").touch()
    (tmp_path / ".other-0003.mcap.99.tmp").touch()
    past.remove_half_written(tmp_path / "site.mcap")
    assert [one.name for one in tmp_path.iterdir() if one.suffix == ".tmp"] == [".other-0003.mcap.99.tmp"]


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc")
def test_a_capture_left_behind_is_known_by_more_than_its_number(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    remembered = past.CapturePid(tmp_path / "site.capture")
    assert remembered.left_behind() is None
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as process:
        remembered.remember(process.pid)
        assert remembered.left_behind() == process.pid
        (tmp_path / "site.capture").write_text(f"{process.pid} 1\n")  # another one had the number before
        assert remembered.left_behind() is None
        remembered.remember(process.pid)
        assert "is closed now" in remembered.end(process.pid)
    assert not (tmp_path / "site.capture").exists()
    begins = iter((7, 8, 8, 8))  # its number is another one's at once, who is left alone
    monkeypatch.setattr(past, "_begun", lambda pid: next(begins))
    monkeypatch.setattr(os, "kill", lambda pid, number: None)
    assert "is closed now" in remembered.end(4711)
    monkeypatch.undo()
    (tmp_path / "site.capture").write_text("nonsense")
    assert remembered.left_behind() is None


def test_keep_counts_the_parts_of_earlier_runs(tmp_path: Path) -> None:
    for run in range(3):
        shared = SharedFile(tmp_path / "site.mcap", SESSIONS, Rotation(count=100), 2, keep_of_all=True)
        recorders = shared.recorders()
        record(recorders, given(run, 150))
        close(recorders)
    left = sorted(tmp_path.glob("site-*.mcap"))
    assert len(left) <= 3
    assert left[-1] == part_name(tmp_path / "site.mcap", 6)


@pytest.mark.parametrize(("folder", "said"), [("my tools", '"{}"'), ("tools", "{}"), ("100%", "{}")])
def test_a_path_in_the_unit_is_one_word(
    tmp_path: Path, folder: str, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = tmp_path / folder / "sniff485"
    program.parent.mkdir()
    program.touch()
    monkeypatch.setattr(sys, "executable", str(program.with_name("python")))
    assert f"ExecStart={said.format(program).replace('%', '%%')} box\n" in shipped.unit()


def test_what_is_shipped(tmp_path: Path) -> None:
    unit = shipped.unit("/opt/sniff485/bin/sniff485")
    assert "ExecStart=/opt/sniff485/bin/sniff485 box\n" in unit
    assert "@" not in unit
    rules = [line for line in shipped.rules().splitlines() if line and not line.startswith("#")]
    assert all('"' in line and line.count('"') % 2 == 0 for line in rules)
    assert sum("LABEL=" in line for line in rules) == 1
    if shutil.which("systemd-analyze") is None:
        return
    program = tmp_path / "sniff485"
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    path = tmp_path / shipped.UNIT
    path.write_text(shipped.unit(str(program)))
    environment = {**os.environ, "SYSTEMD_LOG_LEVEL": "warning"}
    done = subprocess.run(["systemd-analyze", "verify", path], capture_output=True, text=True, env=environment)
    assert (done.returncode, done.stderr) == (0, "")
