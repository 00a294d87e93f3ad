"""`record A B C`: one process, one clock, one file; a port that goes away does not stop the others."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tty
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from dissectors.frame import Chunk
from dissectors.modbus.envelope import seal_rtu
from sniff.engine.session import LineEvent, LineEventKind
from sniff.recording.reader import McapCapture

pytest.importorskip("termios")

from sniff.cli import main
from tests.e2e.recording_bus import wait_until
from tests.e2e.running import rest_of

POLL, ANSWER = seal_rtu(b"\1\3\0\0\0\2"), seal_rtu(b"\1\3\4\0\1\0\2")


@dataclass
class Line:
    """A pseudo-terminal under a name of its own."""

    link: Path
    master: int
    slave: int
    sent: bytes = b""

    def send(self, octets: bytes) -> None:
        os.write(self.master, octets)
        self.sent += octets


@pytest.fixture
def lines(tmp_path: Path) -> Iterator[list[Line]]:
    made = []
    for name in ("boiler", "roof", "cellar"):
        master, slave = os.openpty()
        tty.setraw(slave)
        (tmp_path / name).symlink_to(os.ttyname(slave))
        made.append(Line(tmp_path / name, master, slave))
    yield made
    for line in made:
        for descriptor in (line.master, line.slave):
            try:
                os.close(descriptor)
            except OSError:
                continue


@pytest.fixture
def record(tmp_path: Path) -> Iterator:
    running: list[subprocess.Popen[str]] = []

    def begin(*words: str) -> subprocess.Popen[str]:
        environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
        command = [sys.executable, "-m", "sniff", "record", *words, "-w", "site.mcap"]
        running.append(
            subprocess.Popen(
                command, cwd=tmp_path, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
            )
        )
        return running[-1]

    yield begin
    for process in running:
        if process.poll() is None:
            process.terminate()  # a killed one would leave its capture behind
            rest_of(process)


def begun(path: Path) -> bool:
    """Whether the file is there, with its begin."""
    return path.exists() and path.stat().st_size > 0


def octets(path: Path, bus: int) -> bytes:
    return b"".join(item.octets for item in McapCapture(path, bus).items() if isinstance(item, Chunk))


def test_every_octet_of_every_port_is_in_one_file(tmp_path: Path, lines: list[Line], record) -> None:
    path = tmp_path / "site.mcap"
    process = record(*(str(line.link) for line in lines), "-s", "19200,8E1", "-p", "modbus-rtu")
    wait_until(lambda: begun(path), "no file")
    for turn in range(60):
        for number, line in enumerate(lines):
            if turn % (number + 1) == 0:
                line.send(POLL)
                line.send(ANSWER)
    wait_until(lambda: all(octets(path, bus) == line.sent for bus, line in enumerate(lines)), "not all is in the file")
    process.send_signal(signal.SIGINT)
    output, errors = rest_of(process)
    assert process.returncode == 0, errors
    assert output == ""
    assert errors.count("recorded to site.mcap") == 1
    for bus, line in enumerate(lines):
        capture = McapCapture(path, bus)
        assert capture.session.bus == line.link.name
        assert capture.completeness().whole
        assert octets(path, bus) == line.sent
        assert f"{line.link.name}: " in errors


def test_a_port_that_goes_does_not_stop_the_others(tmp_path: Path, lines: list[Line], record) -> None:
    path = tmp_path / "site.mcap"
    process = record(*(str(line.link) for line in lines), "-s", "19200,8E1", "-p", "modbus-rtu")
    wait_until(lambda: begun(path), "no file")
    for line in lines:
        line.send(POLL)
    wait_until(lambda: all(octets(path, bus) == line.sent for bus, line in enumerate(lines)), "not all is in the file")
    gone = lines[1]
    gone.link.unlink()
    os.close(gone.master)
    os.close(gone.slave)
    for line in (lines[0], lines[2]):
        line.send(POLL + ANSWER)
    wait_until(lambda: all(octets(path, bus) == lines[bus].sent for bus in (0, 2)), "not all is in the file")
    assert process.poll() is None
    process.send_signal(signal.SIGTERM)
    _, errors = rest_of(process)
    assert process.returncode == 0, errors
    assert octets(path, 1) == gone.sent


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["boiler", "boiler"], "named twice"),
        (["boiler", "--all"], "name no port beside it"),
        (["--all"], "no bus with a port is configured"),
    ],
)
def test_what_cannot_be_meant_is_said(
    words: list[str],
    said: str,
    lines: list[Line],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    named = [str(tmp_path / word) if not word.startswith("-") else word for word in words]
    assert main(["record", *named, "-s", "9600,8N1", "-w", "site.mcap"]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "site.mcap").exists()


def test_all_buses_of_the_configuration(tmp_path: Path, lines: list[Line], record) -> None:
    text = "".join(
        f'[bus.{name}]\nport = {json.dumps(str(tmp_path / name))}\nline = "19200,8E1"\nprotocol = "modbus-rtu"\n'
        for name in ("boiler", "roof")
    )
    (tmp_path / "sniff485.toml").write_text(text)
    process = record("--all", "--count", "3")
    wait_until(lambda: begun(tmp_path / "site.mcap"), "no file")
    lines[0].send(POLL)
    lines[1].send(POLL + ANSWER)
    lines[0].send(ANSWER)
    _, errors = rest_of(process)
    assert process.returncode == 0, errors
    assert [McapCapture(tmp_path / "site.mcap", bus).session.bus for bus in (0, 1)] == ["boiler", "roof"]


def test_only_what_surrounds_a_trigger_is_kept_of_all_buses(tmp_path: Path, lines: list[Line], record) -> None:
    path = tmp_path / "site.mcap"
    refusal = seal_rtu(b"\1\x83\2")
    asked = ("-s", "19200,8E1", "-p", "modbus-rtu", "--on", "verdict == exception", "--before", "3600", "--after", "1")
    process = record(*(str(line.link) for line in lines[:2]), *asked)
    wait_until(lambda: begun(path), "no file")
    lines[1].send(POLL + ANSWER)
    lines[0].send(POLL + refusal)
    wait_until(lambda: octets(path, 0) == lines[0].sent and octets(path, 1) == lines[1].sent, "no trigger fired")
    process.send_signal(signal.SIGINT)
    _, errors = rest_of(process)
    assert process.returncode == 0, errors
    assert "triggered by verdict == exception: frame " in errors
    events = [item for bus in (0, 1) for item in McapCapture(path, bus).items() if isinstance(item, LineEvent)]
    assert [event.text for event in events if event.kind is LineEventKind.TRIGGER] == [
        "verdict == exception: frame 1",
        "on boiler: verdict == exception: frame 1",
    ]


def test_without_a_trigger_nothing_is_kept_and_all_is_counted(tmp_path: Path, lines: list[Line], record) -> None:
    path = tmp_path / "site.mcap"
    asked = ("-s", "19200,8E1", "-p", "modbus-rtu", "--on", "MB001", "--before", "1", "--count", "2")
    process = record(str(lines[0].link), *asked)
    wait_until(lambda: begun(path), "no file")
    lines[0].send(POLL + ANSWER)
    _, errors = rest_of(process)
    assert process.returncode == 0, errors
    assert octets(path, 0) == b""
    assert f"{len(lines[0].sent)} octets not kept: no trigger asked for them" in errors
