"""Recordings that are cut, damaged or made to do harm: never a traceback, all that can be read, and what cannot be."""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

import pytest
import zstandard
from mcap.writer import Writer

from dissectors.frame import Chunk, LineError, Mark
from dissectors.line import LineSettings
from sniff.engine.capture import CaptureError
from sniff.engine.session import Item, LineEvent, LineEventKind, Session
from sniff.formats import read
from sniff.recording import scan
from sniff.recording.batcher import Batcher
from sniff.recording.beginning import MOST_BUSES
from sniff.recording.part import PartFile
from sniff.recording.reader import McapCapture
from sniff.recording.topic_message import Message
from tests.seeds import IS_SEARCH

A_CHUNK = 6  # items a chunk of the small file
BASE = 1_772_359_200_000_000_000
SESSION = Session("/dev/ttyUSB0", LineSettings(19200, 8, "E", 1), "modbus-rtu", BASE, notes={"a": "b"})


def some_items(count: int) -> list[Item]:
    """Requests and answers with a mark here and an event there, 20 ms apart."""
    items: list[Item] = []
    for number in range(count):
        octets = bytes((1 + number % 5, 3, number >> 8 & 255, number & 255)) * (2 + number % 3)
        marks = (Mark(2, LineError.PARITY),) if number % 7 == 3 else ()
        items.append(Chunk(BASE + number * 20_000_000, octets, marks))
        if number % 11 == 5:
            items.append(LineEvent(BASE + number * 20_000_000 + 5, LineEventKind.DROPPED, "busy", 4))
    return items


def write_in_chunks(path: Path, items: list[Item], a_chunk: int) -> list[int]:
    """A recording flushed after every so many items; the file's size after each flush."""
    sizes = []
    with path.open("wb") as stream:
        part, batcher = PartFile(stream, [SESSION]), Batcher()
        for number, item in enumerate(items, 1):
            messages: list[Message] = []
            if isinstance(item, LineEvent):
                batcher.add_event(item)
            else:
                messages = batcher.add(item)
            if number % a_chunk == 0 or number == len(items):
                messages += batcher.close()
            for message in messages:
                part.add(message)
            if number % a_chunk == 0:
                part.flush()
                sizes.append(part.size)
        part.finish()
        sizes.append(part.size)
    return sizes


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, list[Item], list[int]]:
    path = tmp_path_factory.mktemp("small") / "small.mcap"
    items = some_items(27)
    sizes = write_in_chunks(path, items, A_CHUNK)
    return path.read_bytes(), items, sizes


def opened(path: Path) -> McapCapture | None:
    """The capture, or None when it says in one line that it is none."""
    try:
        capture = read(path)
    except CaptureError as error:
        words = str(error)
    else:
        assert isinstance(capture, McapCapture)
        return capture
    assert words.startswith(f"{path}:")
    assert "\n" not in words
    return None


def written(path: Path, octets: bytes) -> McapCapture:
    path.write_bytes(octets)
    capture = opened(path)
    assert capture is not None
    return capture


def test_whole_file_is_whole(tmp_path: Path, small: tuple[bytes, list[Item], list[int]]) -> None:
    octets, items, _ = small
    capture = written(tmp_path / "a.mcap", octets)
    assert list(capture.items()) == items
    assert capture.completeness().text == "complete"


def test_cut_at_every_octet(tmp_path: Path, small: tuple[bytes, list[Item], list[int]]) -> None:
    octets, items, sizes = small
    path = tmp_path / "a.mcap"
    path.write_bytes(octets)
    for length in reversed(places(octets)):
        os.truncate(path, length)
        capture = opened(path)
        flushed = sum(size <= length for size in sizes) * A_CHUNK
        if capture is None:
            assert flushed == 0
            continue
        found = list(capture.items())
        assert found == items[: len(found)]
        assert len(found) >= flushed, f"flushed items are gone in a file of {length} octets"
        told = capture.completeness()
        assert not told.whole
        assert f"of {length}" in told.text
        if length % 10 == 0:
            assert read(path).completeness() == told, "the quick look says something else"


def places(octets: bytes) -> list[int]:
    """Every octet at the begin and the end of each record up to the summary, every third within (every octet where one
    searches), and every fifth of the summary: there it is the same over and over."""
    data_end = octets.index(struct.pack("<BQ", scan.DATA_END, 4)) + 13
    edges, at = {0}, 8
    while at < data_end:
        edges |= {at - 2, at - 1, *range(at, at + 12)}
        at += 9 + int.from_bytes(octets[at + 1 : at + 9], "little")
    assert at == data_end
    data = [at for at in range(data_end) if at in edges or IS_SEARCH or at % 3 == 0]
    rest = [*range(data_end, data_end + 9), *range(data_end + 9, len(octets) - 40, 5)]
    return [*data, *rest, *range(len(octets) - 40, len(octets))]


def test_any_octet_changed(tmp_path: Path, small: tuple[bytes, list[Item], list[int]]) -> None:
    octets, items, _ = small
    path = tmp_path / "a.mcap"
    path.write_bytes(octets)
    with path.open("r+b", buffering=0) as file:
        for offset in places(octets)[::2]:
            file.seek(offset)
            file.write(bytes([octets[offset] ^ (0xFF if offset % 2 else 0x01)]))
            capture = opened(path)
            if capture is not None:
                check_damaged(capture, items, offset)
            file.seek(offset)
            file.write(octets[offset : offset + 1])


def check_damaged(capture: McapCapture, items: list[Item], offset: int) -> None:
    found = list(capture.items())
    assert not capture.completeness().whole, f"octet {offset} changed and nobody noticed"
    real = [item for item in found if not is_hole(item)]
    assert is_subsequence(real, items), f"octet {offset}: items that never were"
    if real == found:
        assert real == items[: len(real)], f"octet {offset}: a hole that nobody was told of"
    assert len(real) >= len(items) - A_CHUNK, f"octet {offset}: one chunk damaged, more than that lost"


def is_hole(item: Item) -> bool:
    return isinstance(item, LineEvent) and item.count == -1


def is_subsequence(found: list[Item], items: list[Item]) -> bool:
    rest: Iterator[Item] = iter(items)
    return all(item in rest for item in found)


def test_damage_in_the_middle_of_a_large_file(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    items = some_items(3000)
    sizes = write_in_chunks(path, items, 100)
    octets = path.read_bytes()
    for offset in range(500, len(octets), 2477):
        damaged = octets[:offset] + bytes(40) + octets[offset + 40 :]
        capture = written(path, damaged)
        found = [item for item in capture.items() if not is_hole(item)]
        assert is_subsequence(found, items)
        assert len(found) >= len(items) - 200
        assert not capture.completeness().whole
    assert len(sizes) > 30


def test_a_lost_chunk_is_an_event_and_is_said(tmp_path: Path, small: tuple[bytes, list[Item], list[int]]) -> None:
    octets, items, sizes = small
    hurt = bytearray(octets)
    hurt[sizes[1] + 60] ^= 0x10
    capture = written(tmp_path / "a.mcap", bytes(hurt))
    found = list(capture.items())
    holes = [item for item in found if is_hole(item)]
    assert len(holes) == 1
    assert holes[0].text == "6 reads missing from the recording"  # type: ignore[union-attr]
    assert [item for item in found if not is_hole(item)] == items[:12] + items[18:]
    assert "6 reads missing" in capture.completeness().text
    assert "its check fails" in capture.completeness().text or "unpacked" in capture.completeness().text


# -- made to do harm -------------------------------------------------------------------------------------------


def record(opcode: int, body: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(body)) + body


def chunk_record(name: bytes, packed: bytes, size: int, check: int = 0) -> bytes:
    head = struct.pack("<QQQI", 0, 0, size, check) + struct.pack("<I", len(name)) + name
    return record(scan.CHUNK, head + struct.pack("<Q", len(packed)) + packed)


def message_record(channel: int, sequence: int, data: bytes) -> bytes:
    return record(scan.MESSAGE, scan.MESSAGE_HEAD.pack(channel, sequence, 5, 5) + data)


@pytest.fixture
def start(small: tuple[bytes, list[Item], list[int]]) -> bytes:
    """Magic, header and session of a good file."""
    octets = small[0]
    at = len(scan.MAGIC)
    while octets[at] != scan.CHUNK:
        at += 9 + struct.unpack_from("<Q", octets, at + 1)[0]
    return octets[:at]


BOMB = zstandard.ZstdCompressor().compress(bytes(200 << 20))
UNSIZED = zstandard.ZstdCompressor(write_content_size=False).compress(bytes(3 << 20))


@pytest.mark.parametrize(
    ("attack", "said"),
    [
        (chunk_record(b"zstd", BOMB, 200 << 20), "are not unpacked"),
        (chunk_record(b"zstd", BOMB, 1000), "sizes contradict"),
        (chunk_record(b"zstd", UNSIZED, 1000), "cannot be unpacked"),
        (chunk_record(b"zstd", b"nonsense", 1000), "cannot be unpacked"),
        (chunk_record(b"lz4", b"nonsense", 1000), "cannot be unpacked"),
        (chunk_record(b"rar", b"nonsense", 8), "not known"),
        (chunk_record(b"", b"nonsense", 9), "not as long"),
        (chunk_record(b"", b"nonsense", 8, 1), "check fails"),
        (record(scan.CHUNK, b"short"), "too short"),
        (record(scan.CHUNK, bytes(28) + b"\xff\xff\xff\x7f" + bytes(8)), "too short"),
        (record(scan.MESSAGE, b"short"), None),
        (message_record(1, 0, b""), "contradict"),
        (message_record(1, 0, struct.pack("<Iq", 0xFFFFFFFF, 0)), "contradict"),
        (message_record(1, 0, struct.pack("<IqIH", 1, 0, 0, 9) + b"12345678"), "contradict"),
        (message_record(1, 8, struct.pack("<IqIH", 1, 0, 0, 1) + b"x"), "7 reads missing"),
        (message_record(2, 0, b"{" * 50_000), "to nothing"),
        (message_record(2, 0, b"[" * 50_000), "to nothing"),
        (message_record(2, 0, b"\xff\xfe"), "to nothing"),
        (message_record(2, 0, b'{"kind": [], "chunk": {}}'), "to nothing"),
        (message_record(2, 0, b'{"kind": "parity", "chunk": -1}'), "to nothing"),
        (message_record(2, 0, b'{"kind": "parity", "chunk": 1e400, "offset": null}'), "to nothing"),
        (message_record(2, 0, b'{"kind": "parity", "chunk": ' + b"9" * 5000 + b"}"), "to nothing"),
        (record(scan.METADATA, b"\xff" * 30), None),
        (record(4, b"\xff" * 30), None),
        (record(0x09, bytes(1000)), None),
        (b"\x05" + b"\xff" * 8, "cut at octet"),
        (bytes(100), "damaged at octet"),
    ],
)
def test_hostile_records(tmp_path: Path, start: bytes, attack: bytes, said: str | None) -> None:
    good = message_record(1, 0, struct.pack("<IqIH", 1, BASE, 0, 2) + b"ok")
    capture = written(tmp_path / "a.mcap", start + good + attack)
    found = list(capture.items())
    assert found[0] == Chunk(BASE, b"ok")
    told = capture.completeness()
    assert not told.whole
    if said is not None:
        assert said in told.text, told.text


def test_a_batch_of_a_million_entries_is_read_piecemeal(tmp_path: Path, start: bytes) -> None:
    many = 1 << 20
    data = struct.pack("<Iq", many, 0) + bytes(6 * many)
    packed = zstandard.compress(message_record(1, 0, data))
    inner = 9 + 22 + len(data)
    capture = written(tmp_path / "a.mcap", start + chunk_record(b"zstd", packed, inner))
    assert list(capture.items()) == []


# -- what is no recording --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("octets", "said"),
    [
        (b"", "empty file"),
        (b"hello, world\n", "no byte log that this program reads"),
        (b"\x89MCAP0\r\n", "no /raw"),
        (b"\x89MCAP0\r\n" + bytes(1000), "no /raw"),
    ],
)
def test_other_files(tmp_path: Path, octets: bytes, said: str) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(octets)
    with pytest.raises(CaptureError, match=said.replace("*", r"\*")) as caught:
        read(path)
    assert str(caught.value).startswith(f"{path}:")


def test_a_recording_of_something_else(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    writer = Writer(str(path))
    writer.start("ros2")
    channel = writer.register_channel("/imu", "cdr", 0)
    writer.add_message(channel, 1, b"x", 1)
    writer.finish()
    with pytest.raises(CaptureError, match="not a recording of a serial line"):
        read(path)


def test_directory_missing_and_forbidden(tmp_path: Path) -> None:
    (tmp_path / "d.mcap").mkdir()
    with pytest.raises(CaptureError, match="a directory"):
        read(tmp_path / "d.mcap")
    with pytest.raises(CaptureError, match="no such file"):
        read(tmp_path / "none.mcap")


def test_a_newer_layout_is_refused(tmp_path: Path, start: bytes) -> None:
    at = start.index(b"version") + len(b"version") + 4
    newer = start[:at] + b"9" + start[at + 1 :]
    path = tmp_path / "a.mcap"
    path.write_bytes(newer)
    with pytest.raises(CaptureError, match="newer sniff485"):
        read(path)


def test_the_check_of_a_chunk_is_what_mcap_says(start: bytes) -> None:
    good = message_record(1, 0, b"")
    assert scan.unpack_chunk(chunk_record(b"", good, len(good), zlib.crc32(good))[9:]) == good


def test_marks_for_entries_that_never_come(tmp_path: Path, start: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    """They are bounded in memory."""
    monkeypatch.setattr("sniff.recording.joiner._MOST_PENDING", 1000)
    line = b"".join(
        message_record(2, 0, b'{"kind":"parity","offset":0,"chunk":%d}' % (10**12 + n)) for n in range(1200)
    )
    raw = b"".join(message_record(1, n, struct.pack("<IqIH", 1, BASE, 0, 1) + b"x") for n in range(500))
    capture = written(tmp_path / "a.mcap", start + line + raw)
    assert list(capture.items()) == [Chunk(BASE, b"x")] * 500
    assert "200 messages on /line" in capture.completeness().text


def test_many_damaged_places(tmp_path: Path, small: tuple[bytes, list[Item], list[int]]) -> None:
    octets, _, _ = small
    at = octets.index(b"\x04\0\0\0zstd") - 37
    one = octets[at : at + 9 + struct.unpack_from("<Q", octets, at + 1)[0]]
    capture = written(tmp_path / "a.mcap", octets[:at] + (one + b"\xff" * 20) * 300)
    assert len(list(capture.items())) > 300 * A_CHUNK - 10
    told = capture.completeness()
    assert "295 more such places" in told.text
    assert "batches numbered backwards" in told.text


def test_from_a_time_on_in_a_damaged_file(tmp_path: Path) -> None:
    """The same as a whole pass finds, and it ends."""
    path = tmp_path / "a.mcap"
    items = some_items(300)
    sizes = write_in_chunks(path, items, 20)
    octets = path.read_bytes()
    since = items[150].time
    for flush in (2, 5, 8, 12):
        for offset in (1, 5, 12, 40, 90):
            damaged = bytearray(octets)
            damaged[sizes[flush] + offset] ^= 0x81
            capture = written(path, bytes(damaged))
            due = [item for item in capture.items() if item.time >= since]
            assert [item for item in read_from(path, since) if not is_hole(item)] == [
                item for item in due if not is_hole(item)
            ]
            assert [item for item in capture.items(since) if not is_hole(item)] == [
                item for item in due if not is_hole(item)
            ]


def read_from(path: Path, since: int) -> list[Item]:
    capture = opened(path)
    assert capture is not None
    return list(capture.items(since))


def test_a_chunk_that_is_too_long_to_be_read_is_a_hole_and_told(
    small: tuple[bytes, list[Item], list[int]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    octets, items, _ = small
    path = tmp_path / "long.mcap"
    path.write_bytes(octets)
    lengths = [len(record.body or b"") for record in records_of(path) if record.opcode == scan.CHUNK]
    monkeypatch.setattr(scan, "MOST_RECORD", sorted(lengths)[-2])
    longest = max(lengths)
    capture = McapCapture(path)
    read_again = [item for item in capture.items() if isinstance(item, Chunk)]
    assert 0 < len(read_again) < sum(isinstance(item, Chunk) for item in items)
    told = capture.completeness()
    assert not told.whole
    assert f"{longest} octets; more than" in told.text
    assert any(isinstance(item, LineEvent) and item.count == -1 for item in capture.items()) or lengths[-1] == longest


def records_of(path: Path) -> list[scan.Record]:
    with path.open("rb") as stream:
        return list(scan.records(stream, scan.Report(path.stat().st_size)))


def test_more_buses_than_there_can_be_are_refused_at_once(tmp_path: Path) -> None:
    path = tmp_path / "many.mcap"
    with path.open("wb") as stream:
        PartFile(stream, [SESSION] * (MOST_BUSES + 1)).finish()
    with pytest.raises(CaptureError, match=f"over {MOST_BUSES} buses"):
        read(path)
