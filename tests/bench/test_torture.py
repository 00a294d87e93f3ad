"""What a recording promises, attacked through the real command, with figures. Not in the suite: it measures times.

Run with `make bench ARGS="-k torture -s"`; each attack prints one line. The suite has the same attacks without clocks
(`tests/e2e/test_record_promises.py`).
"""

from __future__ import annotations

import contextlib
import os
import re
import signal
import socket
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.e2e.recording_bus import (
    Feeder,
    SlowDisk,
    capture_processes,
    octets_of,
    recordings,
    wait_until,
)

POLL = bytes.fromhex("010300000002c40b")
FULL = 11_520
"""Octets a second of 115200 Bd, 8N1."""


class Traffic:
    """Polls at full speed, with the time at which each was fed."""

    def __init__(self, bus: Feeder) -> None:
        self.bus, self.log = bus, [(time.monotonic(), 0)]
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        began = time.monotonic()
        while not self._stop.wait(0.005):
            due = int((time.monotonic() - began) * FULL) - len(self.bus.fed)
            if due >= len(POLL):
                self.bus.feed(POLL * (due // len(POLL)))
                self.log.append((time.monotonic(), len(self.bus.fed)))

    def stop(self) -> int:
        self._stop.set()
        self._thread.join()
        return len(self.bus.fed)

    def lost_before(self, when: float, there: int) -> float:
        """Seconds between the last octet that is there and a moment."""
        return when - next((at for at, fed in self.log if fed > there), when)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    made = tmp_path / "work"
    made.mkdir()
    return made


@pytest.fixture
def bus() -> Iterator[Feeder]:
    with contextlib.closing(Feeder()) as made:
        yield made


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[SlowDisk]:
    with contextlib.closing(SlowDisk(tmp_path / "disk")) as made:
        yield made


@pytest.fixture
def begin(folder: Path, bus: Feeder) -> Iterator[Any]:
    with recordings(folder, bus.path) as begin:
        yield begin


def say(promise: str, figure: str) -> None:
    print(f"\n  {promise}: {figure}")


@pytest.mark.parametrize("number", [signal.SIGHUP, signal.SIGKILL])
def test_torture_front_dies(benchmark: Any, begin: Any, bus: Feeder, folder: Path, number: int) -> None:
    benchmark.pedantic(lambda: None, rounds=1)
    began = time.monotonic()
    command = begin("--duration", "6")
    traffic = Traffic(bus)
    time.sleep(1)
    command.send(number)
    wait_until(lambda: not capture_processes(folder), "it goes on without end")
    say(
        f"--duration 6, front ended by signal {number}",
        f"capture ended {time.monotonic() - began:.1f} s after the start",
    )
    traffic.stop()


@pytest.mark.parametrize("what", ["write", "sync"])
def test_torture_disk_hangs(benchmark: Any, begin: Any, bus: Feeder, folder: Path, disk: SlowDisk, what: str) -> None:
    benchmark.pedantic(lambda: None, rounds=1)
    command = begin(environment=disk.environment)
    traffic = Traffic(bus)
    time.sleep(2)
    disk.shut(what)
    disk.until_it_waits(what)
    hung = time.monotonic()
    said = command.until_it_says("disk slow")
    told = time.monotonic() - hung
    time.sleep(max(0.0, hung + 20 - time.monotonic()))
    disk.open(what)
    command.until_it_says("caught up")
    fed = traffic.stop()
    bus.until_read()
    asked = time.monotonic()
    command.send(signal.SIGINT)
    code = command.end()
    there = len(octets_of(folder / "x.mcap"))
    say(f"{what} hangs for 20 s at 11 kB/s", f"said after {told:.1f} s ({said.split(': ', 2)[-1]}); {there} of {fed} "
        f"octets in the file, rc {code}, ended in {time.monotonic() - asked:.1f} s")  # fmt: skip
    assert there == fed


def test_torture_killed_while_a_sync_hangs(
    benchmark: Any, begin: Any, bus: Feeder, folder: Path, disk: SlowDisk
) -> None:
    benchmark.pedantic(lambda: None, rounds=1)
    command = begin(environment=disk.environment)
    traffic = Traffic(bus)
    disk.shut("sync")
    disk.until_it_waits("sync")
    time.sleep(6)
    for pid in capture_processes(folder):
        os.kill(pid, signal.SIGKILL)
    killed = time.monotonic()
    code = command.end()
    traffic.stop()
    there = len(octets_of(folder / "x.mcap"))
    say(
        "kill -9 six seconds into a sync that hangs",
        f"{1000 * traffic.lost_before(killed, there):.0f} ms lost, rc {code}",
    )


def test_torture_stopped_while_a_write_hangs(
    benchmark: Any, begin: Any, bus: Feeder, folder: Path, disk: SlowDisk
) -> None:
    benchmark.pedantic(lambda: None, rounds=1)
    command = begin(environment=disk.environment)
    traffic = Traffic(bus)
    time.sleep(2)
    disk.shut("write")
    time.sleep(5)
    fed = traffic.stop()
    bus.until_read()
    command.send(signal.SIGINT)
    asked = time.monotonic()
    command.until_it_says("waiting for the last")
    told = time.monotonic() - asked
    code = command.end()
    took = time.monotonic() - asked
    lost = int((re.search(r"(\d+) octets NOT", "\n".join(command.said)) or [0, 0])[1])
    there = len(octets_of(folder / "x.mcap"))
    say("Ctrl-C while a write never ends", f"said after {told:.1f} s, ended after {took:.1f} s, rc {code}: "
        f"{there} in the file + {lost} counted as lost = {there + lost} of {fed} fed")  # fmt: skip
    assert there + lost == fed


@pytest.mark.parametrize("end", ["SIGINT", "SIGTERM", "--duration"])
def test_torture_front_is_behind(benchmark: Any, begin: Any, bus: Feeder, folder: Path, end: str) -> None:
    benchmark.pedantic(lambda: None, rounds=1)
    command = begin(*(["--duration", "24"] if end == "--duration" else []))
    began = time.monotonic()
    traffic = Traffic(bus)
    time.sleep(1)
    command.send(signal.SIGSTOP)
    time.sleep(20)
    command.send(signal.SIGCONT)
    if end == "--duration":
        time.sleep(max(0.0, began + 24 - time.monotonic()))
    else:
        command.send(getattr(signal, end))
    asked = time.monotonic()
    command.end()
    took = time.monotonic() - asked
    traffic.stop()
    unseen = next((line for line in command.said if "not looked at" in line), "all looked at")
    say(
        f"{end} with the front 20 s behind at 11 kB/s", f"ended after {took:.1f} s; {unseen.removeprefix('sniff485: ')}"
    )


def test_torture_flood(benchmark: Any, begin: Any, folder: Path) -> None:
    benchmark.pedantic(lambda: None, rounds=1)
    sent = 0
    with socket.create_server(("127.0.0.1", 0)) as server:

        def flood() -> None:
            nonlocal sent
            client, _ = server.accept()
            block = POLL * 8192
            try:
                while True:
                    client.sendall(block)
                    sent += len(block)
            except OSError:
                return

        threading.Thread(target=flood, daemon=True).start()
        began = time.monotonic()
        command = begin("--duration", "5", port=f"socket://127.0.0.1:{server.getsockname()[1]}")
        pid = capture_processes(folder)[0]
        most = [0, 0]
        while command.process.poll() is None:
            for at, who in enumerate((pid, command.process.pid)):
                try:
                    most[at] = max(most[at], int(Path(f"/proc/{who}/statm").read_text().split()[1]) * 4096)
                except (OSError, IndexError):
                    continue
            time.sleep(0.05)
        took = time.monotonic() - began
        code = command.end()
    lost = int((re.search(r"(\d+) octets NOT", "\n".join(command.said)) or [0, 0])[1])
    there = sum(len(item.octets) for item in _chunks(folder / "x.mcap"))
    figures = (
        f"{sent / 1e6:.0f} MB sent, ended {took:.1f} s after the start, rc {code}",
        f"{there / 1e6:.0f} MB in the file, {lost / 1e6:.0f} MB counted as lost",
        f"memory capture {most[0] / 1e6:.0f} MB, front {most[1] / 1e6:.0f} MB",
    )
    say("a gateway that floods, --duration 5", "; ".join(figures))


def _chunks(path: Path) -> Iterator[Any]:
    from dissectors.frame import Chunk
    from sniff.formats import read

    return (item for item in read(path).items() if isinstance(item, Chunk))
