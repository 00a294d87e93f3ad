from __future__ import annotations

import pytest

from dissectors.line import LineSettings
from sniff.engine.session import LineEventKind
from sniff.sources import PortError, open_source
from sniff.sources.capture_file import AT_ONCE, CaptureFileSource
from sniff.sources.clock import Clock

TEXT = """#!sniff-capture 1
# line: 19200,8E1
# protocol: modbus-rtu
# start: 2026-03-01T10:00:00Z
+0      01 03
+100    01 03 04
+400    FF
"""


class FakeClock(Clock):
    """A clock that is set by hand."""

    time = 0

    def now(self) -> int:
        return type(self).time


@pytest.fixture
def clock():
    FakeClock.time = 5_000_000_000
    return FakeClock(0, 0)


@pytest.fixture
def path(tmp_path):
    file = tmp_path / "poll.cap.txt"
    file.write_text(TEXT)
    return str(file)


def test_pace_of_the_original(path, clock) -> None:
    source = CaptureFileSource(path, clock)
    (first,) = source.read()
    assert first.octets == b"\x01\x03"
    assert source.read() == []
    assert source.deadline() == 5_100_000_000
    FakeClock.time += 99_000_000
    assert source.read() == []
    assert source.now() == first.time + 99_000_000
    FakeClock.time += 1_000_000
    (second,) = source.read()
    assert second.time == first.time + 100_000_000
    FakeClock.time += 10_000_000_000
    (third,) = source.read()
    assert source.ended
    assert source.deadline() is None
    assert source.now() == third.time == first.time + 500_000_000


def test_a_speed_divides_the_waiting(path, clock) -> None:
    source = CaptureFileSource(path, clock, speed=10)
    source.read()
    assert source.deadline() == 5_010_000_000


def test_as_fast_as_possible(path, clock) -> None:
    source = CaptureFileSource(path, clock, speed=None)
    assert [item.octets for item in source.read()] == [b"\x01\x03", b"\x01\x03\x04", b"\xff"]
    assert source.ended


def test_a_read_is_bounded(tmp_path, clock) -> None:
    file = tmp_path / "long.cap.txt"
    file.write_text(TEXT + "+1 00\n" * (AT_ONCE * 2))
    source = CaptureFileSource(str(file), clock, speed=None)
    sizes = []
    while not source.ended:
        sizes.append(len(source.read()))
    assert sum(sizes) == 3 + 2 * AT_ONCE
    assert max(sizes) == AT_ONCE


def test_opened_by_its_suffix_and_never_reconfigured(path) -> None:
    source = open_source(path, LineSettings())
    assert isinstance(source, CaptureFileSource)
    with pytest.raises(PortError, match="cannot be changed"):
        source.reconfigure(LineSettings())


def test_unreadable_files_are_named(tmp_path, clock) -> None:
    with pytest.raises(PortError, match=r"missing\.cap\.txt"):
        CaptureFileSource(str(tmp_path / "missing.cap.txt"), clock)
    with pytest.raises(PortError, match="speed 0"):
        CaptureFileSource(str(tmp_path / "missing.cap.txt"), clock, speed=0)


def test_a_damaged_file_ends_where_it_is_damaged(path, clock):
    """Nothing raises once it is open: the capture process would die of it."""
    with open(path, "a") as file:
        file.write("+10 no octets\n+10 01\n")
    source = CaptureFileSource(path, clock, speed=None)
    *chunks, last = source.read()
    assert [chunk.octets for chunk in chunks] == [b"\x01\x03", b"\x01\x03\x04", b"\xff"]
    assert last.kind is LineEventKind.NOTE
    assert "poll.cap.txt:8:5: expected" in last.text
    assert source.ended


def test_its_time_is_never_beyond_what_is_still_to_be_given(tmp_path, clock) -> None:
    """A tick of a time promises that all before it was given."""
    path = tmp_path / "busy.cap.txt"
    path.write_text(TEXT + "+0.1 01\n" * 2 * AT_ONCE)
    source = CaptureFileSource(str(path), clock)
    FakeClock.time += 10_000_000_000
    given = []
    while items := source.read():
        assert items[0].time > (given[-1].time if given else 0)
        given += items
        following = source._next
        assert given[-1].time <= source.now() < (following.time if following else source.now() + 1)
    assert len(given) == 3 + 2 * AT_ONCE
