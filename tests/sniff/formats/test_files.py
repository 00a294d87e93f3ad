"""New files take their name when they are whole, and leave nothing behind when they are given up."""

from __future__ import annotations

from pathlib import Path

import pytest

from dissectors.line import LineSettings
from sniff.bus.capture_writer import create
from sniff.engine.capture import CaptureError
from sniff.engine.session import Session
from sniff.formats.files import NewFile

SESSION = Session("port", LineSettings(), "modbus-rtu")


def test_it_takes_its_name_when_it_is_closed(tmp_path: Path) -> None:
    path = tmp_path / "a.bin"
    path.write_bytes(b"before")
    file = NewFile(path)
    file.write(b"after")
    assert path.read_bytes() == b"before"
    file.close()
    assert path.read_bytes() == b"after"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("name", ["x.cap.txt", "x.pcap", "x.pcapng"])
def test_a_file_that_cannot_be_begun_leaves_nothing(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    full = Path("/dev/full")
    if not full.is_char_device():
        pytest.skip("no device here that is always full")
    monkeypatch.setattr("sniff.formats.files.open", _unbuffered_on(full), raising=False)
    path = tmp_path / name
    with pytest.raises(CaptureError, match="no space left"):
        create(path, SESSION).close()
    assert list(tmp_path.iterdir()) == []


def _unbuffered_on(device: Path):
    """`open` whose new files are there, and take nothing."""
    real = open

    def opening(path, mode="r", *more, **options):
        if "w" not in mode:
            return real(path, mode, *more, **options)
        real(path, mode).close()
        return real(device, mode, buffering=0)

    return opening
