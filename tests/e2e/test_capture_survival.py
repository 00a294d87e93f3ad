"""What a recording survives: the death of its own process, of the main process, a reader that does not read."""

from __future__ import annotations

import os
import signal
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from dissectors.frame import Chunk
from dissectors.line import NS_PER_S, LineSettings
from sniff.capture.ipc import Message, ReceivedMessage, Status, Tick
from sniff.capture.ipc_sender import BACKLOG
from sniff.capture.link import CaptureLink, RecordSpec, SourceSpec
from sniff.formats import read

pytest.importorskip("termios")
if not os.path.isdir("/proc/self"):
    pytest.skip("needs /proc", allow_module_level=True)

LINE = LineSettings.parse("115200,8N1")


class Bus:
    """A port that is fed numbered lines from a thread. `log`: when how many octets had been fed."""

    def __init__(self) -> None:
        import tty

        self.master, slave = os.openpty()
        tty.setraw(slave)
        self.path = os.ttyname(slave)
        os.close(slave)
        self.log: list[tuple[float, int]] = []
        self.fed = 0
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        os.set_blocking(self.master, False)
        while not self._stop.wait(0.003):
            self.feed(text(self.fed, 40))

    def feed(self, octets: bytes) -> None:
        while octets:
            try:
                taken = os.write(self.master, octets)
            except BlockingIOError:  # nobody reads; as a bus, go on regardless
                if self._stop.wait(0.001):
                    return
                continue
            octets = octets[taken:]
            self.fed += taken
        self.log.append((time.monotonic(), self.fed))

    def pause(self) -> None:
        self._stop.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    def close(self) -> None:
        self.pause()
        os.close(self.master)


def text(begin: int, length: int) -> bytes:
    """Octets `begin` … of an endless stream that never repeats within 4 GiB and holds FF."""
    words = b"".join(
        (0xFF000000 | number).to_bytes(4, "big") for number in range(begin // 4, (begin + length) // 4 + 1)
    )
    return words[begin % 4 :][:length]


@pytest.fixture
def bus() -> Iterator[Bus]:
    bus = Bus()
    yield bus
    bus.close()


def recorded(path: Path | str) -> bytes:
    return b"".join(item.octets for item in read(path).items() if isinstance(item, Chunk))


def promised(messages: list[Message]) -> int:
    """Octets that must be in the file, by the capture's own clock and by what it said of its disk: a machine that
    gives it no turn stops that clock too."""
    now = max((one.now for one in messages if isinstance(one, Tick)), default=0)
    behind = max((one.behind for one in messages if isinstance(one, Status)), default=0.0)
    chunks = [one.item for one in messages if isinstance(one, ReceivedMessage) and isinstance(one.item, Chunk)]
    return sum(len(chunk.octets) for chunk in chunks if chunk.time < now - (1.2 + behind) * NS_PER_S)


def test_killed_under_load_it_lacks_at_most_the_last_second(bus, tmp_path) -> None:
    file = tmp_path / "night.mcap"
    link = CaptureLink.start([SourceSpec(bus.path, LINE)], RecordSpec(str(file)))
    bus.start()
    heard: list[Message] = []
    while promised(heard) <= 10_000:
        heard += link.receive(0.5)
    os.kill(link.pid, signal.SIGKILL)
    while link.ended is None:
        heard += link.receive(1)
    bus.pause()
    link.stop()
    there = recorded(file)
    assert there == text(0, len(there))
    assert len(there) >= promised(heard)
    completeness = read(file).completeness()
    assert not completeness.whole
    assert completeness.text


MAIN = """
import signal, sys, time
signal.signal(signal.SIGINT, signal.default_int_handler)  # whoever runs the tests in the background ignores it
signal.signal(signal.SIGHUP, signal.SIG_DFL)  # and this one, under nohup
from dissectors.line import LineSettings
from sniff.capture.link import CaptureLink, RecordSpec, SourceSpec
link = CaptureLink.start([SourceSpec(sys.argv[1], LineSettings.parse("115200,8N1"))], RecordSpec(sys.argv[2]))
print(link.pid, flush=True)
while True:
    link.receive(1)
"""


@pytest.mark.parametrize(
    ("how", "end"),
    [("kill -9", signal.SIGTERM), ("Ctrl-C", signal.SIGINT), ("terminal closed", signal.SIGTERM)],
)
def test_the_recording_outlives_the_main_process(bus, tmp_path, how, end) -> None:
    file = tmp_path / "night.mcap"
    main = subprocess.Popen(
        [sys.executable, "-c", MAIN, bus.path, str(file)],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    with main:
        assert main.stdout is not None
        pid = int(main.stdout.readline())
        try:
            bus.feed(text(0, 1000))
            if how == "kill -9":
                main.kill()
            else:  # a signal to everybody at the terminal
                os.killpg(main.pid, signal.SIGINT if how == "Ctrl-C" else signal.SIGHUP)
            main.wait(10)
            for _ in range(20):
                bus.feed(text(bus.fed, 1000))
                time.sleep(0.005)
            os.kill(pid, 0)  # still there
            wait_until_read(bus)
        finally:
            main.kill()
            os.kill(pid, end)
            wait_until_gone(pid)
    assert recorded(file) == text(0, bus.fed) != b""
    assert read(file).completeness().whole


def test_a_main_process_that_does_not_read_costs_neither_octets_nor_memory(bus, tmp_path) -> None:
    file = tmp_path / "night.mcap"
    with CaptureLink.start([SourceSpec(bus.path, LINE)], RecordSpec(str(file))) as link:
        for _ in range(300):  # more than the backlog holds
            bus.feed(text(bus.fed, 10_000))
        before = resident(link.pid)
        for _ in range(300):
            bus.feed(text(bus.fed, 10_000))
        wait_until_read(bus)
        after = resident(link.pid)
        messages = link.stop()
    status = [message for message in messages if isinstance(message, Status)][-1]
    shown = sum(len(m.item.octets) for m in messages if isinstance(m, ReceivedMessage) and isinstance(m.item, Chunk))
    assert status.dropped > 0
    assert status.lost == 0
    assert shown < BACKLOG + 1_000_000 < bus.fed, "no more is held than the backlog and what the socket takes"
    assert recorded(file) == text(0, bus.fed)
    assert after - before < 8_000_000, "memory grows with what was fed"


def resident(pid: int) -> int:
    """Octets of memory of a process."""
    with open(f"/proc/{pid}/statm", encoding="ascii") as statm:
        return int(statm.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def wait_until_read(bus: Bus) -> None:
    """Until the tty holds nothing more for the capture process to read."""
    import fcntl
    import termios

    slave = os.open(bus.path, os.O_RDONLY | os.O_NOCTTY | os.O_NONBLOCK)
    try:
        until = time.monotonic() + 20
        quiet = 0
        while quiet < 5:
            waiting = struct.unpack("i", fcntl.ioctl(slave, termios.FIONREAD, b"\0" * 4))[0]
            quiet = 0 if waiting else quiet + 1
            assert time.monotonic() < until
            time.sleep(0.02)
    finally:
        os.close(slave)


def wait_until_gone(pid: int) -> None:
    until = time.monotonic() + 10
    while time.monotonic() < until:
        try:
            with open(f"/proc/{pid}/stat", encoding="ascii") as stat:
                if stat.read().rsplit(")", 1)[1].split()[0] == "Z":
                    return  # ended; whoever inherited it has not looked yet
        except FileNotFoundError:
            return
        time.sleep(0.02)
    os.kill(pid, signal.SIGKILL)
    pytest.fail(f"process {pid} did not end")
