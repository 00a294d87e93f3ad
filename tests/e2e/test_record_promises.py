"""What `record` promises, whatever becomes of its main process, its disk and its file. No test waits for a clock."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import signal
import socket
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from sniff.engine.session import LineEvent, LineEventKind
from sniff.formats import read

pytest.importorskip("termios")

from tests.e2e.recording_bus import Feeder, SlowDisk, capture_processes, octets_of, recordings, wait_until

if not os.path.isdir("/proc/self"):
    pytest.skip("needs /proc", allow_module_level=True)

POLL = bytes.fromhex("010300000002c40b")


@pytest.fixture
def bus() -> Iterator[Feeder]:
    with contextlib.closing(Feeder()) as made:
        yield made


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[SlowDisk]:
    with contextlib.closing(SlowDisk(tmp_path / "disk")) as made:
        yield made


@pytest.fixture
def record(tmp_path: Path, bus: Feeder) -> Iterator:
    folder = tmp_path / "work"
    folder.mkdir()
    with recordings(folder, bus.path) as record:
        record.folder = folder
        yield record


# -- limits are the capture's own ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("limit", "number"), [(("--duration", "2"), signal.SIGHUP), (("--count", "50"), signal.SIGKILL)]
)
def test_limits_hold_without_the_main_process(record, bus, limit, number) -> None:
    command = record(*limit)
    bus.poll(POLL)
    wait_until(lambda: capture_processes(record.folder), "no capture process")
    command.send(number)
    command.end()
    wait_until(lambda: not capture_processes(record.folder), "the capture goes on without end")
    assert read(record.folder / "x.mcap").completeness().whole
    if limit[0] == "--count":
        assert len(octets_of(record.folder / "x.mcap")) >= 50 * len(POLL)


# -- a slow disk -----------------------------------------------------------------------------------------------


def test_a_disk_that_hangs_is_said_and_costs_nothing(record, bus, disk) -> None:
    command = record(environment=disk.environment)
    bus.poll(POLL)
    wait_until(lambda: octets_of(record.folder / "x.mcap"), "nothing is recorded")
    disk.shut("write")
    assert re.search(r"disk slow: \d+ s behind", command.until_it_says("disk slow"))
    disk.open("write")
    assert command.until_it_says("the disk has caught up").endswith("nothing lost")
    bus.quiet()
    bus.until_read()
    command.send(signal.SIGINT)
    assert command.end() == 0, command.said
    assert octets_of(record.folder / "x.mcap") == bytes(bus.fed)
    notes = [item.text for item in read(record.folder / "x.mcap").items() if isinstance(item, LineEvent)]
    assert any("disk slow" in note for note in notes)
    assert any("caught up" in note for note in notes)


def test_a_sync_that_hangs_keeps_nothing_from_the_file(record, bus, disk) -> None:
    disk.shut("sync")
    command = record(environment=disk.environment)
    bus.poll(POLL)
    disk.until_it_waits("sync")
    assert re.search(r"disk slow: syncing takes \d+ s", command.until_it_says("disk slow"))
    before = len(octets_of(record.folder / "x.mcap"))
    wait_until(lambda: len(octets_of(record.folder / "x.mcap")) > before + 500, "the file grows no more")
    for pid in capture_processes(record.folder):
        os.kill(pid, signal.SIGKILL)
    assert command.end() in (3, 4), "4, but that the sync was late"
    assert any("was ended by SIGKILL" in line for line in command.said)
    assert any("recorded to x.mcap, cut where the capture was ended" in line for line in command.said)


def test_stopping_waits_for_a_disk_and_says_so(record, bus, disk) -> None:
    command = record(environment=disk.environment)
    bus.feed(POLL * 100)
    wait_until(lambda: len(octets_of(record.folder / "x.mcap")) == len(bus.fed), "nothing is recorded")
    disk.shut("write")
    bus.feed(POLL * 400)
    disk.until_it_waits("write")
    bus.until_read()
    command.send(signal.SIGINT)
    command.until_it_says("waiting for the last")
    disk.open("write")
    assert command.end() == 0, command.said
    assert octets_of(record.folder / "x.mcap") == bytes(bus.fed)


def test_stopped_twice_it_counts_what_is_lost(record, bus, disk) -> None:
    command = record(environment=disk.environment)
    bus.feed(POLL * 100)
    wait_until(lambda: len(octets_of(record.folder / "x.mcap")) == len(bus.fed), "nothing is recorded")
    disk.shut("write")
    bus.feed(POLL * 400)
    disk.until_it_waits("write")
    bus.until_read()
    command.send(signal.SIGINT)
    command.until_it_says("waiting for the last")
    command.send(signal.SIGINT)
    assert command.end() == 3, command.said
    lost = int(re.search(r"(\d+) octets NOT RECORDED", "\n".join(command.said))[1])  # type: ignore[index]
    assert len(octets_of(record.folder / "x.mcap")) + lost == len(bus.fed)


# -- stopping is prompt ----------------------------------------------------------------------------------------


def test_stopping_does_not_wait_for_what_nobody_looked_at(record, bus) -> None:
    """The main process is minutes behind; it leaves that and says how much."""
    command = record()
    wait_until(lambda: capture_processes(record.folder), "no capture process")
    command.send(signal.SIGSTOP)
    bus.feed(POLL * 200_000)
    bus.until_read()
    command.send(signal.SIGCONT)
    command.send(signal.SIGINT)
    assert command.end() == 0, command.said
    assert any("octets not looked at" in line for line in command.said)
    assert octets_of(record.folder / "x.mcap") == bytes(bus.fed)
    assert read(record.folder / "x.mcap").completeness().whole


def test_a_flood_ends_on_time(record) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:

        def flood() -> None:
            client, _ = server.accept()
            block = b"\x01\x03\x00\x00" * 16384
            try:
                while True:
                    client.sendall(block)
            except OSError:
                return

        thread = threading.Thread(target=flood, daemon=True)
        thread.start()
        command = record("--duration", "1", port=f"socket://127.0.0.1:{server.getsockname()[1]}")
        code = command.end()
        thread.join(20)
    assert any("octets not looked at" in line for line in command.said)
    assert (code == 3) == any("NOT RECORDED" in line for line in command.said)
    assert octets_of(record.folder / "x.mcap")


# -- a file that vanishes --------------------------------------------------------------------------------------


@pytest.mark.parametrize("what", ["file", "folder"])
def test_a_recording_that_vanishes(record, bus, what) -> None:
    command = record()
    bus.poll(POLL)
    wait_until(lambda: octets_of(record.folder / "x.mcap"), "nothing is recorded")
    if what == "file":
        (record.folder / "x.mcap").unlink()
    else:
        shutil.rmtree(record.folder)
    said = command.until_it_says("was removed while it was recorded")
    assert said.endswith("goes on in x-0002.mcap")
    wait_until(lambda: octets_of(record.folder / "x-0002.mcap"), "nothing is recorded any more")
    bus.quiet()
    bus.until_read()
    command.send(signal.SIGTERM)
    assert command.end() == 3
    there = octets_of(record.folder / "x-0002.mcap")
    lost = int(re.search(r"(\d+) octets NOT RECORDED", "\n".join(command.said))[1])  # type: ignore[index]
    assert len(there) + lost == len(bus.fed)
    ends = [line for line in command.said if "recorded to" in line]
    assert what == "folder" or ends == ["sniff485: recorded to x-0002.mcap"]
    events = [item for item in read(record.folder / "x-0002.mcap").items() if isinstance(item, LineEvent)]
    assert {event.kind for event in events} == {LineEventKind.NOTE}
    assert any("was removed while it was recorded" in event.text for event in events)
