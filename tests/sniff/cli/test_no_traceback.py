"""No command ends in a traceback: one line, and an exit code that means what happened."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.bus.capture_writer import create
from sniff.cli import demo, main
from sniff.cli.standard_streams import OUTPUT
from sniff.engine.session import Session

CAPTURE = """#!sniff-capture 1
# line: 19200,8E1
# protocol: modbus-rtu
+0 01 03 00 00 00 02 C4 0B
+20 01 03 04 00 00 00 00 FA 33
"""
LONG = "x" * 260


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "a.cap.txt").write_text(CAPTURE)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def ended(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str]:
    code = main(list(words))
    return code, capsys.readouterr().err


@pytest.mark.parametrize(
    ("redirected", "words"),
    [
        ("show a.cap.txt > /dev/full", "standard output: no space left on the disk"),
        ("show a.cap.txt --json >&-", "standard output: it is closed"),
        ("--help > /dev/full", "standard output: no space left on the disk"),
        ("info - <&-", "standard input: it is closed"),
    ],
)
@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")
def test_streams_that_are_full_or_closed(folder: Path, redirected: str, words: str) -> None:
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])}
    ran = subprocess.run(
        f"{sys.executable} -m sniff {redirected}", shell=True, cwd=folder, env=environment, capture_output=True,
        text=True, timeout=120, check=False,
    )  # fmt: skip
    assert ran.returncode == 3
    assert ran.stderr.startswith(f"sniff485: {words}")
    assert len(ran.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    "words",
    [
        ("show", f"{LONG}.cap.txt"),
        ("info", f"{LONG}.mcap"),
        ("check", f"{LONG}.pcap"),
        ("convert", "a.cap.txt", f"{LONG}.pcap"),
        ("record", "/dev/null", "-s", "9600,8N1", "-w", f"{LONG}.mcap"),
    ],
)
def test_names_that_are_too_long(folder: Path, capsys: pytest.CaptureFixture[str], words: tuple[str, ...]) -> None:
    code, said = ended(capsys, *words)
    assert code == 3
    assert said.splitlines()[-1].endswith("File name too long")
    assert "Traceback" not in said


@pytest.mark.parametrize("time", [-(1 << 63), (1 << 63) - 1])
def test_times_at_the_ends(folder: Path, capsys: pytest.CaptureFixture[str], time: int) -> None:
    with create("ends.mcap", Session("p", LineSettings(19200, 8, "E", 1), "modbus-rtu")) as writer:
        writer.write(Chunk(time, bytes.fromhex("010300000002c40b")))
    for command in ("check", "show", "info", "stats", "points"):
        code, said = ended(capsys, command, "ends.mcap")
        assert code in (0, 1, 2), said
        assert "internal error" not in said


def test_a_full_output_is_no_fault_of_a_virtual_bus(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> int:
        raise OSError(errno.ENOSPC, "No space left on device", OUTPUT)

    pytest.importorskip("termios")
    monkeypatch.setattr(demo.listening, "start", lambda *_: None)
    monkeypatch.setattr(demo, "show", full)
    code, said = ended(capsys, "demo", "--lines", "--duration", "1")
    assert (code, said.splitlines()[-1]) == (
        3, "sniff485: standard output: no space left on the disk; make room, or write elsewhere",
    )  # fmt: skip


@pytest.mark.parametrize("suffix", ["", ".mcap"])
def test_a_port_of_a_name_that_is_too_long(folder: Path, capsys: pytest.CaptureFixture[str], suffix: str) -> None:
    code, said = ended(capsys, "record", f"./{LONG}{suffix}", "-s", "9600,8N1", "-w", "x.mcap")
    assert (code, said.count("\n"), "Errno" in said) == (4, 1, False)


def test_what_nobody_foresaw(folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(_: object) -> int:
        raise RuntimeError("hostile \x1b]0;text\x07")

    monkeypatch.setattr("sniff.cli.show.run", broken)
    code, said = ended(capsys, "show", "a.cap.txt")
    assert code == 70
    assert said.startswith("sniff485: internal error: RuntimeError: hostile \\x1b]0;text\\x07 (")
    assert "please report" in said
    assert len(said.splitlines()) == 1
    code, said = ended(capsys, "--traceback", "show", "a.cap.txt")
    assert code == 70
    assert "Traceback" in said


def test_memory_that_does_not_suffice(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def greedy(_: object) -> int:
        raise MemoryError

    monkeypatch.setattr("sniff.cli.show.run", greedy)
    assert ended(capsys, "show", "a.cap.txt") == (3, "sniff485: not enough memory for that\n")


# -- what is no file -------------------------------------------------------------------------------------------


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs pipes with a name")
@pytest.mark.parametrize("name", ["p.mcap", "p.cap.txt", "p.pcap", "p.pcapng", "p.log", "p.csv", "p.txt"])
def test_a_pipe_is_refused_and_never_waited_for(folder: Path, capsys: pytest.CaptureFixture[str], name: str) -> None:
    os.mkfifo(folder / name)
    for command in ("show", "info", "check"):
        code, said = ended(capsys, command, name)
        assert code == 3
        assert said == f"sniff485: {name}: not a regular file but a pipe; read it as standard input: `- < PIPE`\n"


@pytest.mark.skipif(not os.path.exists("/dev/zero"), reason="needs /dev/zero")
@pytest.mark.parametrize("name", ["z.mcap", "z.cap.txt", "z.log"])
def test_a_device_is_refused(folder: Path, capsys: pytest.CaptureFixture[str], name: str) -> None:
    (folder / name).symlink_to("/dev/zero")
    code, said = ended(capsys, "show", name)
    assert code == 3
    assert "not a regular file but a device" in said


def test_a_file_that_grows_is_read_as_far_as_it_went(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from sniff.formats.files import open_capture

    path = folder / "grows.log"
    path.write_bytes(b"one\ntwo\n")
    with open_capture(path) as stream:
        with path.open("ab") as more:
            more.write(b"three\n" * 10_000)
        assert stream.readline() == b"one\n"
        assert stream.read() == b"two\n"
        stream.seek(0)
        assert list(stream) == [b"one\n", b"two\n"]
    with open_capture(path) as stream:
        assert len(stream.read()) > 60_000


def test_a_port_by_a_link_outside_dev_can_be_checked(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("termios")
    master, slave = os.openpty()
    try:
        (folder / "bus.tty").symlink_to(os.ttyname(slave))
        code, said = ended(capsys, "check", "./bus.tty", "-s", "19200,8E1", "--duration", "0.2")
        assert code in (0, 1), said
        assert "listening to ./bus.tty" in said
    finally:
        os.close(slave)
        os.close(master)
