"""The recorder: loss bounded in time, a disk that is full or slow, parts without a seam."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import textwrap
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from dissectors.frame import Chunk, LineError, Mark
from dissectors.line import LineSettings
from sniff.engine.capture import CaptureError
from sniff.engine.session import Item, LineEvent, LineEventKind, Session
from sniff.formats import read
from sniff.recording import writer_thread
from sniff.recording.derived_message import DerivedMessage
from sniff.recording.reader import McapCapture
from sniff.recording.rotation import Rotation, part_name
from sniff.recording.topics import VALUE_SCHEMA
from sniff.recording.writer import Recorder

BASE = 1_772_359_200_000_000_000
SESSION = Session("/dev/ttyUSB0", LineSettings(19200, 8, "E", 1), "modbus-rtu", BASE)
S = 1_000_000_000


def some_items(count: int, apart: int = 20_000_000) -> list[Item]:
    items: list[Item] = []
    for number in range(count):
        marks = (Mark(3, LineError.FRAMING),) if number % 50 == 7 else ()
        items.append(Chunk(BASE + number * apart, number.to_bytes(4, "big") * 2, marks))
        if number % 97 == 11:
            items.append(LineEvent(BASE + number * apart + 1, LineEventKind.NOTE, f"after {number}"))
    return items


def give(recorder: Recorder, items: list[Item]) -> None:
    for item in items:
        if isinstance(item, Chunk):
            recorder.chunk(item)
        else:
            recorder.line(item)


def eventually(true: Callable[[], bool], what: str) -> None:
    """Wait for the writing thread."""
    deadline = time.monotonic() + 20
    while not true():
        assert time.monotonic() < deadline, what
        time.sleep(0.002)


def capture(path: Path) -> McapCapture:
    found = read(path)
    assert isinstance(found, McapCapture)
    return found


def test_everything_given_is_in_the_file(tmp_path: Path) -> None:
    items = some_items(1000)
    recorder = Recorder(tmp_path / "a.mcap", SESSION)
    give(recorder, items)
    recorder.chunk(Chunk(BASE + 999 * S, b""))
    recorder.close()
    recorder.close()
    recorder.chunk(Chunk(BASE + 999 * S, b"too late"))
    found = capture(recorder.path)
    assert list(found.items()) == items
    assert found.completeness().whole
    assert replace(found.session, adapter=found.session.said or found.session.adapter, said=None) == SESSION
    assert recorder.chunks == 1000
    assert recorder.octets == 8000
    assert recorder.lost_octets == 0
    assert recorder.trouble is None
    assert recorder.size == recorder.path.stat().st_size


def test_within_a_second_in_the_file(tmp_path: Path) -> None:
    """Bursts and silences on a clock of our own: at each tick, what is a second old can be read."""
    recorder = Recorder(tmp_path / "a.mcap", SESSION)
    given: list[Chunk] = []
    now = BASE
    for step in range(40):
        now += S // 4
        for number in range((0, 1, 300, 2)[step // 3 % 4]):
            chunk = Chunk(now - S // 4 + 1 + number * 700_000, bytes([step, number % 256, 3]))
            given.append(chunk)
            recorder.chunk(chunk)
        recorder.tick(now)
        due = sum(chunk.time <= now - S for chunk in given)
        eventually(
            lambda due=due: len(list(capture(recorder.path).items())) >= due,  # type: ignore[misc]
            f"step {step}: a chunk of a second ago is not in the file",
        )
        found = list(capture(recorder.path).items())
        assert found == given[: len(found)]
    recorder.close()
    assert list(capture(recorder.path).items()) == given


def test_a_lone_event_is_in_the_file_within_a_second(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "a.mcap", SESSION)
    event = LineEvent(BASE, LineEventKind.UNPLUGGED, "ttyUSB0 is gone")
    recorder.line(event)
    for step in range(5):
        recorder.tick(BASE + step * S // 4)
    eventually(lambda: list(capture(recorder.path).items()) == [event], "the event is not there")
    recorder.close()


def test_synced_within_ten_seconds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    recorder = Recorder(tmp_path / "a.mcap", SESSION)
    synced: list[int] = []
    monkeypatch.setattr("sniff.recording.sync_thread.os.fsync", lambda number: synced.append(number))
    now = BASE
    for step in range(100 * 4):
        now += S // 4
        if step % 3 == 0:
            recorder.chunk(Chunk(now, b"123"))
        recorder.tick(now)
    eventually(lambda: recorder._keeper.orders.empty(), "the thread is stuck")
    eventually(lambda: len(synced) >= 10, "100 s of traffic")
    syncer = recorder._keeper._syncer
    eventually(lambda: syncer._orders.empty() and not syncer.busy, "the syncs of the traffic do not end")
    quiet = len(synced)
    for _ in range(100 * 4):
        now += S // 4
        recorder.tick(now)
    recorder.close()
    assert len(synced) <= quiet + 2, "nothing to sync on a silent line"


def test_a_clock_that_jumps_back_does_not_stop_it(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "a.mcap", SESSION)
    chunks = [Chunk(BASE + 5 * S, b"1"), Chunk(BASE - 3600 * S, b"2"), Chunk(-5, b"3"), Chunk(BASE, b"4")]
    give(recorder, list(chunks))
    recorder.tick(BASE - 3600 * S)
    eventually(lambda: len(list(capture(recorder.path).items())) >= 3, "nothing is written")
    recorder.close()
    assert list(capture(recorder.path).items()) == chunks


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs kill -9")
def test_killed_it_keeps_what_is_a_second_old(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    script = f"""
        import sys, time
        from dissectors.frame import Chunk
        from dissectors.line import LineSettings
        from sniff.recording.writer import Recorder
        from sniff.engine.session import Session
        recorder = Recorder({str(path)!r}, Session("p", LineSettings(), "modbus-rtu"))
        for number in range(10**9):
            now = time.time_ns()
            recorder.chunk(Chunk(now, number.to_bytes(4, "big")))
            recorder.tick(now)
            print(number, now, flush=True)
            time.sleep(0.005)
    """
    with subprocess.Popen([sys.executable, "-c", textwrap.dedent(script)], stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        lines = [process.stdout.readline().split() for _ in range(250)]
        process.kill()
        killed = time.time_ns()
    given = [(int(number), int(at)) for number, at in lines]
    found = [item for item in capture(path).items() if isinstance(item, Chunk)]
    assert [int.from_bytes(chunk.octets, "big") for chunk in found] == list(range(len(found)))
    assert [(number, chunk.time) for number, chunk in enumerate(found)][: len(given)] == given[: len(found)]
    due = sum(at <= killed - S for _, at in given)
    assert due > 0
    assert len(found) >= due
    told = capture(path).completeness()
    assert not told.whole
    assert "cut at octet" in told.text


# -- a disk that does not take it ------------------------------------------------------------------------------


class FullDisk:
    """A file on a disk with `room` octets."""

    def __init__(self, stream: object, room: int) -> None:
        self.stream = stream
        self.room = room

    def write(self, octets: bytes) -> int:
        if self.room <= 0:
            raise OSError(28, "No space left on device")
        count: int = self.stream.write(octets[: self.room])  # type: ignore[attr-defined]
        self.room -= count
        return count

    def __getattr__(self, name: str) -> object:
        return getattr(self.stream, name)


def fill(recorder: Recorder, room: int) -> FullDisk:
    disk = FullDisk(recorder._keeper._part.stream, room)
    recorder._keeper._part.stream = disk  # type: ignore[assignment]
    return disk


def test_disk_full_then_room_again(tmp_path: Path) -> None:
    items = some_items(3000)
    recorder = Recorder(tmp_path / "a.mcap", SESSION)
    disk = fill(recorder, 5000)
    give(recorder, items[:2000])
    eventually(lambda: recorder.trouble is not None, "nobody noticed")
    assert recorder.trouble == f"{recorder.path}: no space left on the disk; make room, or write elsewhere"
    partly = list(capture(recorder.path).items())
    assert partly == items[: len(partly)]
    disk.room = 10**9
    give(recorder, items[2000:])
    eventually(lambda: recorder.trouble is None, "there is room again")
    recorder.close()
    assert recorder.lost_octets == 0
    assert list(capture(recorder.path).items()) == items
    assert capture(recorder.path).completeness().whole


def test_disk_full_for_too_long(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Memory stays bounded, what is lost is counted, the file shows the hole and goes on after it."""
    monkeypatch.setattr(writer_thread, "MOST_WAITING", 4000)
    recorder = Recorder(tmp_path / "a.mcap", SESSION)
    disk = fill(recorder, 3000)
    items = [Chunk(BASE + number * 20_000_000, os.urandom(64)) for number in range(3000)]
    for at in range(0, 2000, 20):
        give(recorder, list(items[at : at + 20]))
        eventually(lambda: recorder._keeper.orders.empty(), "the thread is stuck")
    assert recorder.trouble is not None
    assert recorder._keeper._part.waiting < 4000 + 64 * 300
    disk.room = 10**9
    for at in range(2000, 3000, 20):
        give(recorder, list(items[at : at + 20]))
        eventually(lambda: recorder._keeper.orders.empty(), "the thread is stuck")
    recorder.close()
    found = [item for item in capture(recorder.path).items() if isinstance(item, Chunk)]
    holes = [item for item in capture(recorder.path).items() if isinstance(item, LineEvent)]
    assert recorder.lost_octets == (len(items) - len(found)) * 64 > 0
    assert set(found) <= set(items)
    assert found[-1] == items[-1]
    assert [hole.kind for hole in holes] == [LineEventKind.DROPPED]
    told = capture(recorder.path).completeness()
    assert f"{len(items) - len(found)} reads missing" in told.text


def test_disk_full_at_the_end(tmp_path: Path) -> None:
    items = some_items(500)
    recorder = Recorder(tmp_path / "a.mcap", SESSION)
    fill(recorder, 2000)
    give(recorder, items)
    recorder.close()
    assert recorder.trouble is not None
    found = list(capture(recorder.path).items())
    assert found == items[: len(found)]
    assert not capture(recorder.path).completeness().whole
    missing = sum(len(item.octets) for item in items[len(found) :] if isinstance(item, Chunk))
    assert missing <= recorder.lost_octets <= recorder.octets, "at most so many, and no less"


@pytest.mark.skipif(sys.platform != "linux", reason="RLIMIT_FSIZE as Linux does it")
def test_a_real_limit_of_the_system(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    script = f"""
        import resource, signal, time
        from dissectors.frame import Chunk
        from dissectors.line import LineSettings
        from sniff.recording.writer import Recorder
        from sniff.engine.session import Session
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        recorder = Recorder({str(path)!r}, Session("p", LineSettings(), "modbus-rtu"))
        resource.setrlimit(resource.RLIMIT_FSIZE, (9000, resource.RLIM_INFINITY))
        for number in range(4000):
            recorder.chunk(Chunk(number * 20_000_000, number.to_bytes(4, "big") * 2))
        while recorder.trouble is None:
            time.sleep(0.01)
        print(recorder.trouble)
        resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
        recorder.close()
        print(recorder.lost_octets)
    """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(script)], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.stdout == f"{path}: File too large\n0\n", done.stderr
    found = list(capture(path).items())
    assert found == [Chunk(number * 20_000_000, number.to_bytes(4, "big") * 2) for number in range(4000)]
    assert capture(path).completeness().whole


# -- files and parts -------------------------------------------------------------------------------------------


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(b"last night")
    with pytest.raises(CaptureError, match="exists already; choose another name"):
        Recorder(path, SESSION)
    assert path.read_bytes() == b"last night"
    with pytest.raises(CaptureError, match="no such directory"):
        Recorder(tmp_path / "none" / "a.mcap", SESSION)


@pytest.mark.parametrize("rule", ["size:64kB", "time:20s", "count:700", "size:10MB,time:1m,count:1k"])
def test_parts_without_a_seam(tmp_path: Path, rule: str) -> None:
    items: list[Item] = []
    for number in range(6000):
        items.append(Chunk(BASE + number * 20_000_000, os.urandom(40)))
        if number % 100 == 50:
            items.append(LineEvent(BASE + number * 20_000_000, LineEventKind.NOTE, str(number)))
    recorder = Recorder(tmp_path / "night.mcap", SESSION, Rotation.parse(rule))
    give(recorder, items)
    recorder.close()
    assert recorder.trouble is None
    assert len(recorder.paths) > 2
    assert [path.name for path in recorder.paths] == [f"night-{n:04}.mcap" for n in range(1, len(recorder.paths) + 1)]
    assert sorted(tmp_path.iterdir()) == list(recorder.paths)
    found: list[Item] = []
    octets = chunks = 0
    for number, path in enumerate(recorder.paths, 1):
        part = capture(path)
        here = list(part.items())
        assert part.completeness().whole, part.completeness().text
        assert replace(part.session, adapter=part.session.said or part.session.adapter) == SESSION
        assert (part.part, part.first_chunk, part.octets_before) == (number, chunks, octets)
        chunks += sum(isinstance(item, Chunk) for item in here)
        octets += sum(len(item.octets) for item in here if isinstance(item, Chunk))
        found += here
    assert found == items
    assert recorder.size == sum(path.stat().st_size for path in recorder.paths)


def test_keep_the_newest(tmp_path: Path) -> None:
    other = [tmp_path / name for name in ("night-2.mcap", "night-0001.txt", "nights-0001.mcap", "night-0000x.mcap")]
    for path in other:
        path.touch()
    old = part_name(tmp_path / "night.mcap", 6)
    old.write_bytes(b"an earlier night")
    recorder = Recorder(tmp_path / "night.mcap", SESSION, Rotation(count=300), keep=2)
    assert recorder.path.name == "night-0007.mcap"
    give(recorder, some_items(2000))
    recorder.close()
    assert len(recorder.paths) > 4
    assert sorted(tmp_path.iterdir()) == sorted([*other, old, *recorder.paths[-2:]])
    assert old.read_bytes() == b"an earlier night"
    assert capture(recorder.path).completeness().whole


def test_only_its_own_files_are_removed(tmp_path: Path) -> None:
    """A part that was moved away is no longer its own, and neither is what somebody put in its place."""
    recorder = Recorder(tmp_path / "night.mcap", SESSION, Rotation(count=300), keep=1)
    first = recorder.path
    moved = first.rename(tmp_path / "evidence.mcap")
    first.write_bytes(b"somebody else's")
    give(recorder, some_items(1500))
    recorder.close()
    assert recorder.trouble is None
    assert len(recorder.paths) > 3
    assert sorted(tmp_path.iterdir()) == sorted([moved, first, recorder.path])
    assert first.read_bytes() == b"somebody else's"
    assert capture(moved).completeness().whole


def test_a_part_that_cannot_be_opened(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The old part goes on, and rotation is tried again."""
    recorder = Recorder(tmp_path / "night.mcap", SESSION, Rotation(count=500))
    items = some_items(3000)
    monkeypatch.setattr(writer_thread, "part_name", lambda path, number: path.parent / "gone" / path.name)
    give(recorder, items[:1500])
    eventually(lambda: recorder._keeper.orders.empty(), "the thread is stuck")
    assert recorder.trouble is not None
    assert "gone" in recorder.trouble
    monkeypatch.undo()
    give(recorder, items[1500:])
    recorder.close()
    assert recorder.lost_octets == 0
    assert len(recorder.paths) > 1
    assert [item for path in recorder.paths for item in capture(path).items()] == items


def test_results_of_the_engine_go_into_every_part(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "night.mcap", SESSION, Rotation(count=500))
    for number in range(1500):
        recorder.chunk(Chunk(BASE + number * S, b"123"))
        data = b'{"value": %d}' % number
        recorder.derived(
            DerivedMessage("/values/b/3/speed", VALUE_SCHEMA.name, BASE + number, BASE + number, data, {"unit": "Hz"})
        )
        recorder.derived(DerivedMessage("/odd", "no such schema", -5, 1 << 70, b"{}"))
    recorder.close()
    assert recorder.trouble is None
    found = [one for path in recorder.paths for one in capture(path).messages("/values")]
    assert len(recorder.paths) == 3
    assert found == [("/values/b/3/speed", BASE + n, b'{"value": %d}' % n) for n in range(1500)]


@pytest.mark.parametrize(
    ("text", "rotation"),
    [
        ("size:64MB", Rotation(size=64_000_000)),
        ("size:1MiB", Rotation(size=1 << 20)),
        ("SIZE: 64kB".replace(" ", ""), Rotation(size=64_000)),
        ("size:0.5GB", Rotation(size=500_000_000)),
        ("time:1h", Rotation(time=3600 * S)),
        ("time:90 s, size:100000", Rotation(size=100_000, time=90 * S)),
        ("time:1.5d", Rotation(time=129600 * S)),
        ("count:10k", Rotation(count=10_000)),
    ],
)
def test_rotation_is_read(text: str, rotation: Rotation) -> None:
    assert Rotation.parse(text) == rotation


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "expected size:64MB"),
        ("64MB", "expected size:64MB"),
        ("size:big", "expected size:64MB"),
        ("time:1", "unknown unit ''; one of s"),
        ("time:1y", "unknown unit 'y'"),
        ("size:1h", "unknown unit 'h'; one of kb"),
        ("size:1kB", "too small"),
        ("time:0.1s", "too small"),
        ("count:0", "too small"),
        ("size:1e9", "expected size:64MB"),
        ("size:٣MB", "expected size:64MB"),
    ],
)
def test_rotation_that_is_none(text: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        Rotation.parse(text)
