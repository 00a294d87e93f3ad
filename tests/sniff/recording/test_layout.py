"""What others see: the stock MCAP reader, the layout as the file itself describes it, schemas that Foxglove takes."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import pytest
from mcap.reader import NonSeekingReader, make_reader

from dissectors.frame import Chunk, LineError, Mark
from dissectors.line import LineSettings
from sniff.bus.capture_writer import create
from sniff.engine.session import Item, LineEvent, LineEventKind, Session
from sniff.formats import read
from sniff.recording import frames
from sniff.recording.reader import McapCapture
from sniff.recording.recovery import recover
from sniff.recording.rotation import Rotation
from sniff.recording.topics import LOG_SCHEMA, RAW_LAYOUT, SCHEMAS
from sniff.recording.writer import Recorder

BASE = 1_772_359_200_000_000_000
SESSION = Session("/dev/ttyUSB0", LineSettings(19200, 8, "E", 1), "modbus-rtu", BASE, "boiler")
ITEMS: list[Item] = [
    *(Chunk(BASE + number * 7_000_000, bytes([number % 256]) * (1 + number % 9)) for number in range(1000)),
    LineEvent(BASE + 7_000_000_000, LineEventKind.UNPLUGGED, "gone"),
    *(Chunk(BASE + 7_000_000_000 + number * 100_000, b"burst") for number in range(600)),
    Chunk(BASE + 8_000_000_000, b"\x01\x02", (Mark(0, LineError.PARITY | LineError.FRAMING), Mark(1, LineError.BREAK))),
]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    with create(tmp_path / "a.mcap", SESSION) as writer:
        for item in ITEMS:
            writer.write(item)
    return tmp_path / "a.mcap"


def decode_as_documented(data: bytes) -> list[tuple[int, bytes]]:
    """The layout in the schema record, word for word, without a line of the program."""
    n, t0 = struct.unpack_from("<Iq", data)
    dt = struct.unpack_from(f"<{n}I", data, 12)
    length = struct.unpack_from(f"<{n}H", data, 12 + 4 * n)
    at = 12 + 6 * n
    entries = []
    for step, size in zip(dt, length, strict=True):
        entries.append((t0 + step, data[at : at + size]))
        at += size
    assert at == len(data)
    return entries


def test_the_stock_reader_reads_it(path: Path) -> None:
    entries: list[tuple[int, bytes]] = []
    lines: list[dict[str, object]] = []
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        assert reader.get_header().profile == "sniff485"
        session = {record.name: record.metadata for record in reader.iter_metadata()}
        assert session["session"] == SESSION.to_metadata()
        assert session["recording"] == {"version": "1", "part": "1", "first_chunk": "0", "octets_before": "0"}
        for schema, channel, message in reader.iter_messages():
            assert schema is not None
            if channel.topic == "/raw":
                assert schema.data.decode() == RAW_LAYOUT
                batch = decode_as_documented(message.data)
                assert message.sequence == len(entries)
                assert (message.publish_time, message.log_time) == (batch[0][0], batch[-1][0])
                assert len(batch) <= 256
                assert batch[-1][0] - batch[0][0] <= 900_000_000
                entries += batch
            else:
                lines.append(json.loads(message.data))
    assert entries == [(item.time, item.octets) for item in ITEMS if isinstance(item, Chunk)]
    assert lines == [
        {"kind": "unplugged", "chunk": 1000, "text": "gone"},
        {"kind": "parity+framing", "chunk": 1600, "offset": 0},
        {"kind": "break", "chunk": 1600, "offset": 1},
    ]


def test_the_stock_reader_checks_the_whole_file(path: Path) -> None:
    with path.open("rb") as stream:
        assert sum(1 for _ in NonSeekingReader(stream, validate_crcs=True).iter_messages()) > 10
    assert read(path).completeness().whole


@pytest.mark.parametrize("schema", [schema for schema in SCHEMAS.values() if schema is not LOG_SCHEMA])
def test_schemas_are_flat(schema: object) -> None:
    assert not isinstance(schema, str)
    if schema.encoding != "jsonschema":  # type: ignore[attr-defined]
        return
    record = json.loads(schema.text)  # type: ignore[attr-defined]
    assert record["type"] == "object"
    assert set(record["required"]) <= set(record["properties"])
    for words in record["properties"].values():
        assert words["type"] in ("string", "number", "integer", "boolean")
        assert set(words) == {"type", "description"}


def test_a_long_chunk_is_several_entries(tmp_path: Path) -> None:
    octets = bytes(range(256)) * 800
    marks = tuple(Mark(offset, LineError.PARITY) for offset in (0, 65534, 65535, 131070, len(octets) - 1))
    items: list[Item] = [
        Chunk(BASE, b"before"),
        Chunk(BASE + 5, octets, marks),
        Chunk(BASE + 5, bytes(65535)),
        Chunk(BASE + 5, bytes(65535)),
        LineEvent(BASE + 5, LineEventKind.NOTE, "here"),
        Chunk(BASE + 5, b"after"),
    ]
    with create(tmp_path / "a.mcap", SESSION) as writer:
        for item in items:
            writer.write(item)
    assert list(read(tmp_path / "a.mcap").items()) == items
    huge = [Chunk(BASE, bytes(17 << 20)), Chunk(BASE + 1, b"x")]
    with create(tmp_path / "b.mcap", SESSION) as writer:
        for item in huge:
            writer.write(item)
    capture = read(tmp_path / "b.mcap")
    assert b"".join(item.octets for item in capture.items() if isinstance(item, Chunk)) == bytes(17 << 20) + b"x"
    assert capture.completeness().whole


def test_times_beyond_what_mcap_holds(tmp_path: Path) -> None:
    items: list[Item] = [
        Chunk(-5, b"1"),
        LineEvent(-4, LineEventKind.NOTE),
        LineEvent(-(2**60), LineEventKind.NOTE, "x", 2**62),
        Chunk(2**63 - 1, b"2"),
        Chunk(-(2**63), b"3"),
    ]
    with create(tmp_path / "a.mcap", SESSION) as writer:
        for item in items:
            writer.write(item)
    assert list(read(tmp_path / "a.mcap").items()) == items
    with create(tmp_path / "b.mcap", SESSION) as writer:
        writer.write(Chunk(2**80, b"1"))
        writer.write(LineEvent(2**80, LineEventKind.NOTE))
    assert len(list(read(tmp_path / "b.mcap").items())) == 2


def test_more_than_two_to_the_32_chunks() -> None:
    from sniff.recording.batch import Batch
    from sniff.recording.batcher import Batcher
    from sniff.recording.joiner import Joiner

    batcher = Batcher(2**32 - 2)
    joiner = Joiner(2**32 - 2)
    found: list[Item] = []
    given = [Chunk(number, bytes([number]), (Mark(0, LineError.BREAK),)) for number in range(1, 6)]
    for chunk in given:
        batcher.add(chunk)
        for message in batcher.close():
            if message.topic == "/line":
                joiner.line(message.log_time, message.data)
            else:
                batch = Batch.decode(message.data)
                assert batch is not None
                found += joiner.raw(message.sequence, batch)
    assert found == given
    assert joiner.next == 2**32 + 3
    assert (joiner.missing, joiner.backward, joiner.strange) == (0, 0, 0)


def test_from_a_time_on(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "a.mcap", SESSION)
    items: list[Item] = []
    for number in range(2000):
        marks = (Mark(0, LineError.PARITY),) if number % 3 == 0 else ()
        items.append(Chunk(BASE + number * 10_000_000, b"ab", marks))
        if number % 10 == 0:
            items.append(LineEvent(BASE + number * 10_000_000 + 1, LineEventKind.NOTE, str(number)))
    for item in items:
        if isinstance(item, Chunk):
            recorder.chunk(item)
        else:
            recorder.line(item)
    recorder.close()
    capture = read(tmp_path / "a.mcap")
    assert isinstance(capture, McapCapture)
    moments = (0, BASE, BASE + 1, BASE + 9_999_999_999, BASE + 10_000_000_000, BASE + 19_990_000_000, BASE * 2)
    for since in (*moments, None, *moments):  # after a whole pass it knows where the chunks are
        if since is None:
            assert capture.completeness().whole
            continue
        assert list(capture.items(since)) == [item for item in items if item.time >= since]
        batches = list(capture.batches(since))
        entries = [entry for batch in batches for entry in batch.entries()]
        assert [time for batch in batches for time in batch.times().tolist()] == [time for time, _ in entries]
        assert [size for batch in batches for size in batch.lengths().tolist()] == [len(some) for _, some in entries]
        assert b"".join(batch.octets for batch in batches) == b"".join(some for _, some in entries)
        due = [(item.time, item.octets) for item in items if isinstance(item, Chunk) and item.time >= since]
        assert entries[len(entries) - len(due) :] == due
        assert len(entries) - len(due) < 256


def test_from_a_time_on_with_a_clock_that_ran_backwards(tmp_path: Path) -> None:
    """What was not read is not a hole."""
    recorder = Recorder(tmp_path / "a.mcap", SESSION)
    steps = [*range(10), *range(-20, -10), *range(10, 20)]
    chunks = [Chunk(BASE + step * 10**9, b"%d" % step) for step in steps]
    for chunk in chunks:
        recorder.chunk(chunk)
    recorder.close()
    capture = read(tmp_path / "a.mcap")
    assert isinstance(capture, McapCapture)
    for _ in range(2):
        assert list(capture.items(BASE)) == [chunk for chunk in chunks if chunk.time >= BASE]
        assert capture.completeness().whole


def test_recover(tmp_path: Path, path: Path) -> None:
    octets = path.read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(octets[: len(octets) * 2 // 3])
    found = recover(cut, tmp_path / "whole.mcap")
    assert not found.whole
    whole = read(tmp_path / "whole.mcap")
    assert whole.completeness().whole
    assert list(whole.items()) == list(read(cut).items())
    assert whole.session.notes == {"recovered": found.text}
    assert recover(path, tmp_path / "again.mcap").whole
    assert (tmp_path / "again.mcap").read_bytes() == octets


def test_parts_name_their_place(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "a.mcap", SESSION, Rotation(count=1))
    for number in range(4):
        recorder.chunk(Chunk(BASE + number * 10**9, b"123"))
    recorder.close()
    with recorder.paths[2].open("rb") as stream:
        record = {one.name: one.metadata for one in make_reader(stream).iter_metadata()}["recording"]
    assert record == {"version": "1", "part": "3", "first_chunk": "2", "octets_before": "6"}


def test_the_layout_of_frames_names_every_column() -> None:
    told = frames.SCHEMA.text.replace(",", " ").replace(".\n", "\n").split()
    assert set(frames.FORMS) <= set(told)
