"""What every format that is written keeps: the same test for all of them, those of plug-ins too."""

from __future__ import annotations

from pathlib import Path

import pytest

from dissectors.frame import Chunk, Frame
from dissectors.line import LineSettings
from sniff.bus.capture_writer import create
from sniff.bus.offline import settled
from sniff.engine.session import Adapter, Item, LineEvent, LineEventKind, Session
from sniff.formats import FRAMES, ITEMS, read
from sniff.formats.table import writers
from tests.sniff.formats.written_anew import write_anew

BEGAN = 1_772_359_200_000_000_000
SESSION = Session(
    "ttyUSB0", LineSettings.parse("19200,8E1"), "modbus-rtu", BEGAN, "boiler", Adapter("ft232r", latency=1_000_000)
)
REQUEST, ANSWER = bytes.fromhex("010300000002C40B"), bytes.fromhex("01030400D7001ACBC0")


def conversation() -> list[Item]:
    items: list[Item] = []
    for number in range(20):
        begin = BEGAN + number * 100_000_000
        items += [Chunk(begin + 5_000_000, REQUEST), Chunk(begin + 15_000_000, ANSWER)]
        if number == 10:
            items.append(LineEvent(begin + 50_000_000, LineEventKind.DROPPED, "host too busy", 3))
    return items


def written(path: Path) -> Path:
    with create(path, SESSION) as writer:
        for item in conversation():
            writer.write(item)
    return path


@pytest.mark.parametrize("suffix", writers(ITEMS))
def test_what_keeps_reads_keeps_all(suffix: str, tmp_path: Path) -> None:
    capture = read(written(tmp_path / f"x{suffix}"))
    assert list(capture.items()) == conversation()
    assert capture.session == SESSION
    assert capture.completeness().whole


@pytest.mark.parametrize("suffix", writers(FRAMES))
def test_what_keeps_frames_keeps_each_with_its_time(suffix: str, tmp_path: Path) -> None:
    capture = read(written(tmp_path / f"x{suffix}"))
    kept = [(item.time, item.octets) for item in capture.items() if isinstance(item, Chunk)]
    assert kept == [(item.time, item.octets) for item in conversation() if isinstance(item, Chunk)]
    assert capture.session.protocol == SESSION.protocol
    events = [item.row.event for item in settled(capture.items(), capture.session)]
    assert all(isinstance(event, Frame) and event.ok for event in events)


@pytest.mark.parametrize("suffix", [*writers(ITEMS), *writers(FRAMES)])
def test_written_again_it_is_the_same_file(suffix: str, tmp_path: Path) -> None:
    first = written(tmp_path / f"x{suffix}")
    capture = read(first)
    with create(tmp_path / f"y{suffix}", capture.session) as writer:
        for item in capture.items():
            writer.write(item)
    assert list(read(tmp_path / f"y{suffix}").items()) == list(capture.items())


@pytest.mark.parametrize("suffix", [*writers(ITEMS), *writers(FRAMES)])
def test_cut_at_every_octet_it_gives_the_begin(suffix: str, tmp_path: Path) -> None:
    from sniff.engine.capture import CaptureError

    whole = written(tmp_path / f"x{suffix}").read_bytes()
    path = tmp_path / f"cut{suffix}"
    expected = b"".join(item.octets for item in conversation() if isinstance(item, Chunk))
    for end in range(0, len(whole), max(1, len(whole) // 300)):
        write_anew(path, whole[:end])
        heard = b""
        try:
            for item in read(path).items():
                heard += item.octets if isinstance(item, Chunk) else b""
        except CaptureError as error:
            assert "\n" not in str(error)  # noqa: PT017
        assert expected.startswith(heard)
