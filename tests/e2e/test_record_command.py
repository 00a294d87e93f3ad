"""`record` and `live` as somebody uses them who trusts nothing: what goes wrong is one line with the way out."""

from __future__ import annotations

import fcntl
import json
import os
import signal
import socket
import subprocess
import sys
import termios
import threading
import time
import tty
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.capture import link as link_module
from sniff.capture.config import SourceSpec
from sniff.capture.link import CaptureLink
from sniff.cli import main
from sniff.formats import read

pytest.importorskip("termios")

from tests.e2e.recording_bus import octets_of, wait_until
from tests.e2e.running import rest_of

POLL = bytes.fromhex("010300000002c40b")
LINE = ("-s", "19200,8E1")


class Bus:
    """A pseudo-terminal under a name of its own, on which polls come until it is unplugged."""

    def __init__(self, link: Path, octets: Callable[[], bytes] = lambda: POLL, every: float = 0.05) -> None:
        self.link = link
        self.octets, self.every = octets, every
        self.plug()

    def plug(self) -> None:
        self.master, slave = os.openpty()
        tty.setraw(slave)
        os.set_blocking(self.master, False)
        self.link.symlink_to(os.ttyname(slave))
        os.close(slave)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self._stop.wait(self.every):
            try:
                os.write(self.master, self.octets())
            except OSError:
                continue

    def unplug(self) -> None:
        if self.master >= 0:
            self._stop.set()
            self._thread.join()
            self.link.unlink()
            os.close(self.master)
            self.master = -1


@pytest.fixture
def bus(tmp_path: Path) -> Iterator[Bus]:
    made = Bus(tmp_path / "tty")
    yield made
    made.unplug()


@pytest.fixture
def begin(tmp_path: Path) -> Iterator:
    running: list[subprocess.Popen[str]] = []

    def begin(*arguments: str, **options) -> subprocess.Popen[str]:
        command = [sys.executable, "-m", "sniff", *arguments]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        running.append(subprocess.Popen(command, cwd=tmp_path, env=environment(), **pipes, **options))
        return running[-1]

    yield begin
    for process in running:
        if process.poll() is None:
            process.kill()
        process.communicate()


def environment() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}


@pytest.fixture
def refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    """What ends before it has begun needs no process of its own, but for the capture's."""
    from sniff.cli import main

    monkeypatch.chdir(tmp_path)

    def refused(*arguments: str) -> tuple[int, str, str]:
        try:
            code = main(list(arguments))
        except SystemExit as end:  # argparse
            code = int(end.code or 0)
        return code, *capsys.readouterr()

    return refused


@pytest.fixture
def run(begin):
    def run(*arguments: str, **options) -> tuple[int, str, str]:
        process = begin(*arguments, **options)
        said, errors = rest_of(process)
        return process.returncode, said, errors

    return run


def next_line(process: subprocess.Popen[str]) -> str:
    """The next line on standard error, but for what it says of a disk that others keep busy here."""
    assert process.stderr is not None
    while "the disk has caught up" in (line := process.stderr.readline()) or "disk slow" in line:
        pass
    return line


def wait_for(path: Path) -> None:
    """Until something that was heard is in a file."""
    until = time.monotonic() + 60
    while not (path.exists() and octets_of(path)):
        assert time.monotonic() < until
        time.sleep(0.05)


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["-w", "folder.mcap"], 3, "folder.mcap: a directory; name a file in it"),
        (["-w", "new/"], 3, "new/: a directory; name a file in it"),
        (["-w", "there.mcap"], 3, "there.mcap: exists already; choose another name or remove it"),
        (["-w", "missing/x.mcap"], 3, "missing/x.mcap: no such directory; create missing first"),
        (["-w", "-"], 2, "-w -: a recording needs a file; `sniff485 live PORT --json` gives frames as they come"),
        (["-w", "/dev/stdout"], 2, "/dev/stdout: recordings are .mcap"),
        (["-w", "x.pcap"], 2, "x.pcap: recordings are .mcap; convert it afterwards"),
        (["-w", "x.mcap", "--rotate", "daily"], 2, "rotation 'daily': expected size:64MB, time:1h"),
        (
            ["-w", "x.mcap", "--keep", "3"],
            2,
            "--keep, --keep-free: of which rotation? say when a new file begins with --rotate",
        ),
        (["-w", "x.mcap", "--rotate", "time:1h", "--keep", "0"], 2, "'0': expected a whole number from 1 on"),
        (["-w", "x.mcap", "--count", "-3"], 2, "'-3': expected a whole number from 1 on"),
        (["-w", "x.mcap", "--duration", "0"], 2, "duration '0'"),
        (["-w", "x.mcap", "--on", "verdict == foo"], 2, "--on: unknown verdict 'foo'"),
        (["-w", "x.mcap", "--on", "ZZ999"], 2, "--on: ZZ999: no such rule"),
    ],
)
def test_what_cannot_be_recorded_to(refused, bus, tmp_path, arguments, code, words) -> None:
    (tmp_path / "folder.mcap").mkdir()
    (tmp_path / "there.mcap").write_bytes(b"precious")
    before = sorted(os.listdir(tmp_path))
    result, said, errors = refused("record", str(bus.link), *LINE, *arguments)
    assert (result, said) == (code, "")
    assert words in errors.splitlines()[-1]
    assert "Traceback" not in errors
    assert sorted(os.listdir(tmp_path)) == before
    assert (tmp_path / "there.mcap").read_bytes() == b"precious"


@pytest.mark.parametrize("port", ["/dev/null", "/dev/no-such-port", "socket://127.0.0.1:1", "."])
def test_a_port_that_is_none(refused, tmp_path, port) -> None:
    code, _, errors = refused("record", port, *LINE, "-w", "x.mcap")
    assert code == 4
    assert len(errors.splitlines()) == 1
    assert errors.startswith(f"sniff485: {port}: ")
    assert not (tmp_path / "x.mcap").exists()


def test_the_second_recorder_is_told_who_has_the_port(begin, refused, bus, tmp_path) -> None:
    first = begin("record", str(bus.link), *LINE, "-w", "first.mcap")
    wait_for(tmp_path / "first.mcap")
    code, _, errors = refused("record", str(bus.link), *LINE, "-w", "second.mcap", "--duration", "1")
    assert code == 4
    assert "held by pid" in errors
    assert "to end it: kill" in errors
    assert not (tmp_path / "second.mcap").exists()
    first.send_signal(signal.SIGINT)
    rest_of(first)
    assert first.returncode == 0
    assert read(tmp_path / "first.mcap").completeness().whole


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_whole(begin, bus, tmp_path, number) -> None:
    process = begin("record", str(bus.link), *LINE, "-w", "x.mcap")
    wait_for(tmp_path / "x.mcap")
    process.send_signal(number)
    errors = rest_of(process)[1]
    assert process.returncode == 0
    assert "recorded to x.mcap" in errors
    assert read(tmp_path / "x.mcap").completeness().whole


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_while_it_begins_ends_it_whole(bus, tmp_path, monkeypatch, capsys, number) -> None:
    """The recording has begun, and nobody has come to listen to it."""
    start = CaptureLink.start

    def start_and_be_stopped(*words: object) -> CaptureLink:
        link = start(*words)
        os.kill(os.getpid(), number)
        return link

    monkeypatch.setattr(CaptureLink, "start", start_and_be_stopped)
    path = tmp_path / "x.mcap"
    assert main(["record", str(bus.link), *LINE, "-w", str(path)]) == 0
    assert f"recorded to {path}" in capsys.readouterr().err
    assert read(path).completeness().whole


@pytest.mark.parametrize(
    "words", [("points", "PORT", *LINE), ("stats", "PORT", "nodes", *LINE), ("demo", "--lines", "-w", "x.mcap")]
)
def test_a_signal_while_anybody_begins_to_listen_ends_it_in_order(bus, tmp_path, monkeypatch, capsys, words) -> None:
    start = CaptureLink.start

    def start_and_be_stopped(*given: object) -> CaptureLink:
        link = start(*given)
        os.kill(os.getpid(), signal.SIGTERM)
        return link

    monkeypatch.setattr(CaptureLink, "start", start_and_be_stopped)
    monkeypatch.chdir(tmp_path)
    assert main([str(bus.link) if word == "PORT" else word for word in words]) == 0
    capsys.readouterr()
    assert all(read(path).completeness().whole for path in tmp_path.glob("*.mcap"))


def test_one_that_is_not_wanted_any_more_need_not_begin(bus, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(link_module, "LEFT_TO_GREET", 0.0)
    monkeypatch.setattr(CaptureLink, "_fill", lambda self, timeout: True)  # it never greets
    with pytest.raises(KeyboardInterrupt):
        CaptureLink.start(
            [SourceSpec(str(bus.link), LineSettings.parse(LINE[1]), "modbus-rtu")], is_given_up=lambda: True
        )


def test_a_port_that_goes_and_comes_back(begin, bus, tmp_path) -> None:
    process = begin("record", str(bus.link), *LINE, "-w", "x.mcap")
    wait_for(tmp_path / "x.mcap")
    bus.unplug()
    assert next_line(process) == f"sniff485: {bus.link} is gone (hung up)\n"
    bus.plug()
    assert next_line(process) == f"sniff485: {bus.link} is back\n"
    before = len(octets_of(tmp_path / "x.mcap"))
    until = time.monotonic() + 20
    while len(octets_of(tmp_path / "x.mcap")) <= before + 40:
        assert time.monotonic() < until
        time.sleep(0.1)
    process.send_signal(signal.SIGTERM)
    rest_of(process)
    assert process.returncode == 0
    kinds = [item.kind.value for item in read(tmp_path / "x.mcap").items() if not isinstance(item, Chunk)]
    assert [kind for kind in kinds if kind != "note"] == ["unplugged", "replugged"]


def test_a_gateway_that_closes_is_waited_for(begin, tmp_path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = f"socket://127.0.0.1:{server.getsockname()[1]}"
        process = begin("record", port, *LINE, "-w", "x.mcap")
        for number in (1, 2):
            client, _address = server.accept()
            with client:
                client.sendall(POLL)
                wait_until(lambda due=number * POLL: octets_of(tmp_path / "x.mcap") == due, "not recorded")
        assert next_line(process) == f"sniff485: {port} is gone (closed by the gateway)\n"
        assert next_line(process) == f"sniff485: {port} is back\n"
        process.send_signal(signal.SIGTERM)
        rest_of(process)
    assert process.returncode == 0
    assert octets_of(tmp_path / "x.mcap") == 2 * POLL


@pytest.mark.parametrize("quiet", [(), ("-q",)])
def test_a_full_disk_is_said_at_once_and_ends_in_an_error(begin, tmp_path, quiet) -> None:
    """A limit on the size of files stands for the disk: writing fails in the same way, without any rights."""
    import resource

    noisy = Bus(tmp_path / "noisy", lambda: os.urandom(400), 0.01)
    try:
        limit = (50_000, 50_000)
        process = begin(
            "record", str(noisy.link), "-s", "115200,8N1", "-w", "x.mcap", *quiet,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, limit),
        )  # fmt: skip
        line = next_line(process)
        assert "recording: x.mcap: File too large" in line
        assert process.poll() is None, "it goes on, for there may be room again"
        process.send_signal(signal.SIGINT)
        errors = rest_of(process)[1]
    finally:
        noisy.unplug()
    assert process.returncode == 3
    assert "octets NOT RECORDED" in errors
    there = read(tmp_path / "x.mcap")
    assert not there.completeness().whole
    assert octets_of(tmp_path / "x.mcap")


def test_no_space_left_says_the_way_out() -> None:
    import errno

    from sniff.formats.files import explain

    assert str(explain("x.mcap", OSError(errno.ENOSPC, "No space left on device"))).startswith(
        "x.mcap: no space left on the disk; make room"
    )


def test_a_rotation_that_keeps_some(run, bus, tmp_path) -> None:
    code, _, errors = run(
        "record", str(bus.link), *LINE, "-w", "r.mcap", "--rotate", "count:1", "--keep", "2", "--duration", "2.5"
    )
    assert code == 0, errors
    parts = sorted(path.name for path in tmp_path.glob("r*.mcap"))
    assert len(parts) == 2
    assert parts[-1] > "r-0002.mcap", "there was something to remove"
    assert parts[-1] in errors
    assert all(read(tmp_path / part).completeness().whole for part in parts)


def test_what_cannot_fire_ends_a_capture_that_searches_its_protocol(run, bus, tmp_path) -> None:
    code, _, errors = run("record", str(bus.link), *LINE, "-p", "auto", "-w", "x.mcap", "--on", "ZZ999")
    assert (code, errors.splitlines()[-1]) == (2, "sniff485: --on: ZZ999: no such rule; `sniff485 rule` lists them")


def test_a_count_ends_it(run, bus, tmp_path) -> None:
    code, _, errors = run("record", str(bus.link), *LINE, "-w", "x.mcap", "--count", "5", "-q")
    assert (code, errors) == (0, "")
    assert len(octets_of(tmp_path / "x.mcap")) >= 5 * len(POLL)


def test_its_reader_going_away_ends_it(begin, bus, tmp_path) -> None:
    """`live --json | head`: nobody would know of a recording that goes on."""
    process = begin("live", str(bus.link), *LINE, "--json", "-w", "x.mcap")
    assert process.stdout is not None
    frame = next(line for line in process.stdout if "record" not in json.loads(line))
    assert POLL.hex() in frame
    process.stdout.close()
    assert process.wait(20) == 0
    assert read(tmp_path / "x.mcap").completeness().whole


def test_a_reader_that_takes_nothing_keeps_nobody_from_ending(begin, tmp_path) -> None:
    """`live --json | less`: what it does not take is given up, the recording is whole."""
    busy = Bus(tmp_path / "busy", lambda: POLL * 8, 0.002)
    try:
        process = begin("live", str(busy.link), "-s", "115200,8N1", "--json", "-w", "x.mcap")
        waiting = bytearray(4)

        def is_full() -> bool:
            fcntl.ioctl(process.stdout, termios.FIONREAD, waiting)
            return int.from_bytes(waiting, sys.byteorder) > 60_000

        wait_until(is_full, "nothing is printed")
        process.send_signal(signal.SIGINT)
        assert process.wait(60) == 0
    finally:
        busy.unplug()
    errors = process.stderr.read()
    assert "standard output: nobody takes what is printed" in errors
    assert "recorded to x.mcap" in errors
    assert read(tmp_path / "x.mcap").completeness().whole


def test_live_without_a_recording_leaves_nothing(run, refused, bus, tmp_path) -> None:
    code, said, _ = run("live", str(bus.link), *LINE, "--no-record", "--duration", "1", "--json")
    assert code == 0
    told = [json.loads(line) for line in said.splitlines()]
    assert [one["hex"] for one in told if "record" not in one][-1] == POLL.hex()
    assert not list(tmp_path.glob("*.mcap"))
    code, _, errors = refused("live", str(bus.link), *LINE, "--no-record", "-w", "x.mcap")
    assert (code, errors) == (2, "sniff485: --no-record and -w contradict each other\n")


def test_on_a_terminal_it_says_that_it_searches(tmp_path, begin) -> None:
    quiet = Bus(tmp_path / "quiet", bytes, 10)
    terminal, errors = os.openpty()
    try:
        process = subprocess.Popen(
            [sys.executable, "-m", "sniff", "record", str(quiet.link), "-s", "auto", "-w", "x.mcap"],
            cwd=tmp_path, env=environment(), stderr=errors, stdout=subprocess.DEVNULL,
        )  # fmt: skip
        said = b""
        while b"searching: " not in said:
            said += os.read(terminal, 1000)
        process.send_signal(signal.SIGINT)
        assert process.wait(20) == 130
    finally:
        quiet.unplug()
        os.close(errors)
        os.close(terminal)
