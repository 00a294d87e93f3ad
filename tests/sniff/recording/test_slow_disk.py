"""A disk that hangs: what waits is told and counted, what the system has taken is safe, closing waits not for ever."""

from __future__ import annotations

import os
import shutil
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.engine.session import LineEvent, LineEventKind, Session
from sniff.formats import read
from sniff.recording import writer_thread
from sniff.recording.derived_message import DerivedMessage
from sniff.recording.rotation import Rotation
from sniff.recording.writer import Recorder

BASE = 1_772_359_200_000_000_000
SESSION = Session("/dev/ttyUSB0", LineSettings(19200, 8, "E", 1), "modbus-rtu", BASE)
S = 1_000_000_000
MS = 1_000_000


def eventually(true: Callable[[], object], what: str) -> None:
    deadline = time.monotonic() + 20
    while not true():
        assert time.monotonic() < deadline, what
        time.sleep(0.002)


class Gate:
    """What stands between a recorder and its disk. `open`: set while it lets everything pass."""

    def __init__(self) -> None:
        self.open = threading.Event()
        self.open.set()
        self.waited = threading.Event()

    def pass_through(self) -> None:
        if not self.open.is_set():
            self.waited.set()
        self.open.wait()


class SlowFile:
    """A file whose writes wait at a gate."""

    def __init__(self, stream: object, gate: Gate) -> None:
        self.stream, self.gate = stream, gate

    def write(self, octets: bytes) -> int:
        self.gate.pass_through()
        return self.stream.write(octets)  # type: ignore[attr-defined,no-any-return]

    def __getattr__(self, name: str) -> object:
        return getattr(self.stream, name)


@pytest.fixture
def gate() -> Iterator[Gate]:
    made = Gate()
    yield made
    made.open.set()


class Running:
    """A recorder on a clock of our own, fed 11 octets each 10 ms."""

    def __init__(self, recorder: Recorder) -> None:
        self.recorder = recorder
        self.now = BASE
        self.given: list[Chunk] = []

    def run(self, seconds: float) -> None:
        for _ in range(int(seconds * 100)):
            self.now += 10 * MS
            chunk = Chunk(self.now, len(self.given).to_bytes(4, "big") + bytes(7))
            self.given.append(chunk)
            self.recorder.chunk(chunk)
            self.recorder.tick(self.now)


def chunks_of(*paths: Path) -> list[Chunk]:
    return [item for path in paths for item in read(path).items() if isinstance(item, Chunk)]


@pytest.fixture
def running(tmp_path: Path) -> Running:
    return Running(Recorder(tmp_path / "a.mcap", SESSION))


def slow_writes(recorder: Recorder, gate: Gate) -> None:
    recorder._keeper._part.stream = SlowFile(recorder._keeper._part.stream, gate)  # type: ignore[assignment]


def test_a_write_that_hangs_is_told_by_how_far_it_is_behind_and_costs_nothing(running: Running, gate: Gate) -> None:
    recorder = running.recorder
    slow_writes(recorder, gate)
    running.run(2)
    eventually(lambda: recorder.behind(running.now) < S, "a disk that is not slow")
    gate.open.clear()
    running.run(20)
    assert 19 * S < recorder.behind(running.now) <= 22 * S
    assert recorder.unwritten >= 19 * 1100
    assert recorder.lost_octets == 0
    gate.open.set()
    eventually(lambda: recorder.behind(running.now) < S, "it never catches up")
    recorder.close()
    assert recorder.behind(running.now) == 0
    assert (recorder.lost_octets, recorder.unwritten) == (0, 0)
    assert chunks_of(recorder.path) == running.given


def test_a_sync_that_hangs_does_not_keep_octets_from_the_system(
    running: Running, gate: Gate, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sniff.recording.sync_thread.os.fsync", lambda _: gate.pass_through())
    recorder = running.recorder
    gate.open.clear()
    running.run(12)
    assert gate.waited.wait(20), "no sync within ten seconds"
    running.run(10)
    old = [chunk for chunk in running.given if chunk.time <= running.now - S]
    eventually(lambda: len(chunks_of(recorder.path)) >= len(old), "what is a second old is not in the file")
    assert recorder.behind(running.now) <= S
    assert recorder.syncing > 0
    gate.open.set()
    eventually(lambda: recorder.syncing == 0, "the sync never ends")
    recorder.close()
    assert chunks_of(recorder.path) == running.given


def test_memory_lasts_for_five_minutes_of_a_full_bus(running: Running, gate: Gate) -> None:
    """115200 Bd 8N1 in reads of 10 ms, beside results."""
    recorder = running.recorder
    slow_writes(recorder, gate)
    gate.open.clear()
    given = []
    for number in range(300 * 100):
        running.now += 10 * MS
        given.append(Chunk(running.now, number.to_bytes(4, "big") + os.urandom(112)))
        recorder.chunk(given[-1])
        if number % 20 == 0:
            recorder.tick(running.now)
            recorder.derived(DerivedMessage("/bus/b", "sniff485.Bus", running.now, running.now, b"{}" * 100))
    assert recorder.lost_octets == 0
    gate.open.set()
    recorder.close()
    assert chunks_of(recorder.path) == given
    assert recorder.lost_octets == 0


def test_what_memory_cannot_hold_is_counted_in_the_file_and_at_the_end(
    running: Running, gate: Gate, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(writer_thread, "MOST_WAITING", 20_000)
    recorder = running.recorder
    slow_writes(recorder, gate)
    running.run(2)
    gate.open.clear()
    running.run(60)
    lost = recorder.lost_octets
    assert lost > 0
    gate.open.set()
    eventually(lambda: recorder.behind(running.now) < S, "it never catches up")
    running.run(5)
    recorder.close()
    found = chunks_of(recorder.path)
    assert sum(len(chunk.octets) for chunk in found) + recorder.lost_octets == 11 * len(running.given)
    assert set(found) <= set(running.given)
    assert found[-1] == running.given[-1]
    holes = [item for item in read(recorder.path).items() if isinstance(item, LineEvent)]
    assert {hole.kind for hole in holes} == {LineEventKind.DROPPED}
    assert sum(hole.count for hole in holes) == recorder.lost_octets >= lost
    assert all("the disk did not keep up" in hole.text for hole in holes)
    assert f"{recorder.lost_octets // 11} reads missing" in read(recorder.path).completeness().text


def test_what_is_missing_at_the_end_is_in_the_file_too(
    running: Running, gate: Gate, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(writer_thread, "MOST_WAITING", 20_000)
    recorder = running.recorder
    slow_writes(recorder, gate)
    gate.open.clear()
    running.run(60)
    recorder.finish()
    gate.open.set()
    recorder.close()
    items = list(read(recorder.path).items())
    assert isinstance(items[-1], LineEvent)
    assert sum(item.count for item in items if isinstance(item, LineEvent)) == recorder.lost_octets > 0


def test_a_disk_that_never_answers_again(running: Running, gate: Gate) -> None:
    recorder = running.recorder
    slow_writes(recorder, gate)
    running.run(2)
    eventually(lambda: recorder.behind(running.now) < S, "a disk that is not slow")
    there = recorder.octets - recorder.unwritten
    gate.open.clear()
    running.run(10)
    recorder.close(0.05)
    assert not recorder.finished
    assert recorder.lost_octets == recorder.octets - there
    assert "the disk does not answer" in str(recorder.trouble)


def test_results_give_way_first(running: Running, gate: Gate, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(writer_thread, "MOST_DERIVED", 5_000)
    recorder = running.recorder
    slow_writes(recorder, gate)
    gate.open.clear()
    for _ in range(100):
        running.run(0.2)
        recorder.derived(DerivedMessage("/bus/b", "sniff485.Bus", running.now, running.now, b"{}" * 100))
    gate.open.set()
    recorder.close()
    assert recorder.lost_octets == 0
    assert chunks_of(recorder.path) == running.given
    with recorder.path.open("rb") as stream:
        from mcap.reader import make_reader

        assert 0 < sum(1 for _ in make_reader(stream).iter_messages(topics=["/bus/b"])) < 40


# -- a file that vanishes --------------------------------------------------------------------------------------


def until_noticed(running: Running) -> str:
    deadline = time.monotonic() + 20
    while not running.recorder.notices:
        assert time.monotonic() < deadline, "nobody noticed"
        running.run(0.5)
        time.sleep(0.005)
    return running.recorder.notices.popleft()


def test_a_file_that_is_removed(running: Running, tmp_path: Path) -> None:
    recorder = running.recorder
    running.run(3)
    recorder.path.unlink()
    said = until_noticed(running)
    assert said.startswith(f"{tmp_path / 'a.mcap'} was removed while it was recorded, with ")
    assert said.endswith(f"goes on in {tmp_path / 'a-0002.mcap'}")
    running.run(3)
    recorder.close()
    assert recorder.path == tmp_path / "a-0002.mcap"
    assert [path.name for path in tmp_path.iterdir()] == ["a-0002.mcap"]
    found = chunks_of(recorder.path)
    assert found == running.given[-len(found) :]
    assert len(found) >= 300
    assert 11 * len(found) + recorder.lost_octets == recorder.octets
    assert read(recorder.path).completeness().whole


def test_a_file_that_is_cut_under_way(running: Running, tmp_path: Path) -> None:
    """`> a.mcap`, or a rotation of logs: what follows would stand behind a hole that nobody can read."""
    recorder = running.recorder
    running.run(3)
    eventually(lambda: recorder._keeper.orders.empty(), "the thread is stuck")
    os.truncate(recorder.path, 0)
    said = until_noticed(running)
    assert said.startswith(f"{tmp_path / 'a.mcap'} was cut short while it was recorded, with ")
    running.run(3)
    recorder.close()
    found = chunks_of(tmp_path / "a-0002.mcap")
    assert found == running.given[-len(found) :]
    assert 11 * len(found) + recorder.lost_octets == recorder.octets
    assert recorder.taken_away == recorder.lost_octets > 0


def test_a_file_that_is_moved_is_finished_where_it_is(running: Running, tmp_path: Path) -> None:
    recorder = running.recorder
    running.run(3)
    moved = recorder.path.rename(tmp_path / "evidence.mcap")
    assert until_noticed(running) == (
        f"{tmp_path / 'a.mcap'} was moved away while it was recorded; goes on in {tmp_path / 'a-0002.mcap'}"
    )
    running.run(3)
    recorder.close()
    assert recorder.lost_octets == 0
    assert read(moved).completeness().whole
    assert chunks_of(moved, recorder.path) == running.given


@pytest.mark.parametrize("rotation", [None, Rotation(count=1000)])
def test_a_folder_that_is_removed(tmp_path: Path, rotation: Rotation | None) -> None:
    folder = tmp_path / "g" / "h"
    folder.mkdir(parents=True)
    running = Running(Recorder(folder / "a.mcap", SESSION, rotation))
    running.run(3)
    eventually(lambda: running.recorder._keeper.orders.empty(), "the thread is stuck")
    shutil.rmtree(tmp_path / "g")
    until_noticed(running)
    running.run(3)
    running.recorder.close()
    there = sorted(folder.iterdir())
    assert running.recorder.path in there
    found = chunks_of(*there)
    assert 11 * len(found) + running.recorder.lost_octets == running.recorder.octets
    assert "a-0001.mcap" not in [path.name for path in there]


def test_a_folder_that_cannot_be_made_again(tmp_path: Path) -> None:
    folder = tmp_path / "g"
    folder.mkdir()
    running = Running(Recorder(folder / "a.mcap", SESSION))
    running.run(3)
    eventually(lambda: running.recorder._keeper.orders.empty(), "the thread is stuck")
    shutil.rmtree(folder)
    folder.write_text("in the way")
    deadline = time.monotonic() + 20
    while running.recorder.trouble is None:
        assert time.monotonic() < deadline, "nobody noticed"
        running.run(0.5)
    assert "removed while it was recorded, and no other can be begun" in running.recorder.trouble
    running.recorder.close()
    assert running.recorder.gone
    assert running.recorder.lost_octets == running.recorder.octets
    assert os.listdir(tmp_path) == ["g"]


def test_removed_at_the_very_end(running: Running) -> None:
    recorder = running.recorder
    running.run(1)
    eventually(lambda: recorder._keeper.orders.empty(), "the thread is stuck")
    recorder.path.unlink()
    recorder.close()
    assert recorder.lost_octets > 0
    assert sum(len(chunk.octets) for chunk in chunks_of(recorder.path)) + recorder.lost_octets == recorder.octets
