"""Part of the disk stays free: the oldest parts of the recording's own name go, never the one being written."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.engine.session import Session
from sniff.recording import rotation
from sniff.recording.rotation import FreeSpace, Rotation, octets_of, part_name
from sniff.recording.writer import SharedFile
from tests.sniff.recording.test_recorder import BASE, S, eventually


class Disk:
    """A disk of so many octets on which only the parts of a recording lie."""

    def __init__(self, folder: Path, size: int) -> None:
        self.folder, self.size = folder, size

    def disk_usage(self, folder: Path) -> SimpleNamespace:
        return SimpleNamespace(free=self.size - sum(path.stat().st_size for path in self.folder.iterdir()))


@pytest.fixture
def disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Disk:
    made = Disk(tmp_path, 1000)
    monkeypatch.setattr(rotation, "shutil", made)
    return made


def made_part(path: Path, number: int, size: int = 100) -> Path:
    part = part_name(path, number)
    part.write_bytes(bytes(size))
    return part


def test_the_oldest_go_until_there_is_room(tmp_path: Path, disk: Disk) -> None:
    path = tmp_path / "night.mcap"
    parts = [made_part(path, number) for number in range(1, 9)]
    other = tmp_path / "other-0001.mcap"
    other.write_bytes(bytes(100))
    gone = FreeSpace(path, 300).make(parts[-1])
    assert gone == parts[:2]
    assert other.exists()
    assert all(part.exists() for part in parts[2:])
    assert FreeSpace(path, 300).make(parts[-1]) == []


def test_the_part_being_written_stays_whatever_is_asked_for(tmp_path: Path, disk: Disk) -> None:
    path = tmp_path / "night.mcap"
    parts = [made_part(path, number) for number in range(1, 4)]
    assert FreeSpace(path, 10**12).make(parts[1]) == parts[:1]
    assert parts[1].exists()
    assert parts[2].exists()


def test_a_recording_tells_what_it_removed(tmp_path: Path, disk: Disk) -> None:
    disk.size = 60_000
    session = Session("p", LineSettings(), "modbus-rtu", BASE)
    file = SharedFile(tmp_path / "night.mcap", [session], Rotation(count=50), keep_free=30_000)
    (recorder,) = file.recorders()
    for number in range(2000):
        recorder.chunk(Chunk(BASE + number * S // 10, number.to_bytes(4, "big") * 40))
        recorder.tick(BASE + number * S // 10)
        if number % 50 == 0:
            eventually(lambda: file.keeper.orders.qsize() < 5, "the keeper does not come round")
    recorder.close()
    assert disk.disk_usage(tmp_path).free >= 30_000 - 15_000  # one part, and what a second brings
    assert recorder.notices
    assert all("was removed: the disk is nearly full" in note for note in recorder.notices)
    assert len(list(tmp_path.iterdir())) < len(recorder.paths)


@pytest.mark.parametrize(
    ("text", "octets"),
    [("1GB", 10**9), ("500MB", 5 * 10**8), ("64MiB", 64 << 20), ("1.5kB", 1500), ("800", 800), ("9B", 9)],
)
def test_sizes(text: str, octets: int) -> None:
    assert octets_of(text) == octets


@pytest.mark.parametrize("text", ["", "GB", "1 XB", "-1GB", "1GBB"])
def test_what_is_no_size_says_what_was_expected(text: str) -> None:
    with pytest.raises(ValueError, match="expected octets as 1GB"):
        octets_of(text)
