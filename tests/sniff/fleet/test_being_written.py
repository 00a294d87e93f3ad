"""Which recordings of an archive somebody is still writing: looked at without waiting for anybody."""

from __future__ import annotations

import os
import struct
from pathlib import Path

import pytest

from sniff.cli import main
from sniff.fleet.archive import FileState, is_being_written
from sniff.recording.scan import MAGIC


def state(path: Path) -> FileState:
    status = path.stat()
    return FileState(str(path), status.st_size, status.st_mtime_ns)


@pytest.mark.parametrize(
    ("content", "written"), [(MAGIC + b"begun", True), (MAGIC + b"x" + MAGIC, False), (b"", False)]
)
def test_it_is_so_until_its_end_is_there(tmp_path: Path, content: bytes, written: bool) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(content)
    assert is_being_written(state(path), path.stat().st_mtime_ns) is written


def test_a_pipe_is_left_alone(tmp_path: Path) -> None:
    """It was opened, and waited for, while it was no older than two minutes."""
    fcntl, termios = pytest.importorskip("fcntl"), pytest.importorskip("termios")
    path = tmp_path / "a.mcap"
    os.mkfifo(path)
    both = os.open(path, os.O_RDWR)
    os.write(both, MAGIC)
    assert not is_being_written(state(path), path.stat().st_mtime_ns)
    assert struct.unpack("i", fcntl.ioctl(both, termios.FIONREAD, bytes(4)))[0] == len(MAGIC), "nobody took anything"
    os.close(both)


def test_it_is_said_that_it_was_not_looked_at(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.mcap").write_bytes(MAGIC + b"begun")
    main(["fleet", "--workers", "1", "--no-index", str(tmp_path)])
    assert "1 recording without an end changed just now" in capsys.readouterr().err
