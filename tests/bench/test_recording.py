"""Recording and opening, against one MCAP message a chunk with the stock writer and reader in the same run.

Run with `make bench`; pytest-benchmark shows the ratio within each group, and `octets_a_chunk` beside it.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from mcap.writer import Writer

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.bus.capture_writer import create
from sniff.engine.session import Session
from sniff.formats import read
from sniff.recording.reader import McapCapture
from sniff.recording.writer import Recorder

COUNT = 100_000
BASE = 1_772_359_200_000_000_000
SESSION = Session("/dev/ttyUSB0", LineSettings(19200, 8, "E", 1), "modbus-rtu", BASE)


def traffic() -> Iterator[Chunk]:
    """A master that polls five drives, 100 reads a second, each frame a read of its own; check octets at random."""
    state = 1
    for number in range(COUNT):
        state = state * 6364136223846793005 + 1442695040888963407 & (1 << 64) - 1
        unit, check = 1 + number // 2 % 5, (state >> 40 & 0xFFFF).to_bytes(2, "little")
        value = (0xD0 + (state >> 33 & 7)).to_bytes(2, "big")
        request = bytes((unit, 3, 0, 0x10, 0, 2)) + check
        answer = bytes((unit, 3, 4)) + value + b"\x00\x1a" + check
        jitter = state >> 45
        yield Chunk(BASE + number * 10_000_000 + jitter, answer if number % 2 else request)


@pytest.fixture(scope="module")
def chunks() -> list[Chunk]:
    return list(traffic())


def write_a_message_a_chunk(path: Path, chunks: list[Chunk]) -> None:
    """The plain way: JSON-free, one message of binary data for each read."""
    writer = Writer(str(path))
    writer.start()
    channel = writer.register_channel("/raw", "", 0)
    for number, chunk in enumerate(chunks):
        writer.add_message(channel, chunk.time, chunk.octets, chunk.time, number)
    writer.finish()


def write_batches(path: Path, chunks: list[Chunk]) -> None:
    with create(path, SESSION) as writer:
        for chunk in chunks:
            writer.write(chunk)


def record_live(path: Path, chunks: list[Chunk]) -> None:
    """As a capture does: flushed each 0.9 s of the bus's time. 1000 s of it."""
    path.unlink(missing_ok=True)
    recorder = Recorder(path, SESSION)
    for chunk in chunks:
        recorder.chunk(chunk)
    recorder.close()


WAYS = {"a message a chunk": write_a_message_a_chunk, "batches": write_batches, "live recorder": record_live}


@pytest.mark.benchmark(group="recording")
@pytest.mark.parametrize("way", WAYS)
def test_write(benchmark: Any, tmp_path: Path, chunks: list[Chunk], way: str) -> None:
    path = tmp_path / "a.mcap"
    benchmark.pedantic(WAYS[way], (path, chunks), rounds=3, warmup_rounds=1)
    benchmark.extra_info["octets_a_chunk"] = round(path.stat().st_size / COUNT, 2)
    benchmark.extra_info["us_a_chunk"] = round(benchmark.stats["min"] / COUNT * 1e6, 3)


def stock(path: Path) -> int:
    """Time and octets of each message."""
    with path.open("rb") as stream:
        return sum(len(message.data) for _, _, message in make_reader(stream).iter_messages())


def items(path: Path) -> int:
    return sum(len(item.octets) for item in read(path).items() if isinstance(item, Chunk))


def batches(path: Path) -> int:
    capture = read(path)
    assert isinstance(capture, McapCapture)
    return sum(len(batch.octets) + int(batch.times()[-1] < 0) for batch in capture.batches())


def completeness(path: Path) -> int:
    assert read(path).completeness().whole
    return 0


READINGS = {
    "stock reader, a message a chunk": (write_a_message_a_chunk, stock),
    "stock reader, batches": (write_batches, stock),
    "items": (write_batches, items),
    "batches": (write_batches, batches),
    "completeness": (write_batches, completeness),
    "items of a live recording": (record_live, items),
}


@pytest.mark.benchmark(group="opening")
@pytest.mark.parametrize("reading", READINGS)
def test_read(benchmark: Any, tmp_path: Path, chunks: list[Chunk], reading: str) -> None:
    write, way = READINGS[reading]
    path = tmp_path / "a.mcap"
    write(path, chunks)
    found = benchmark.pedantic(way, (path,), rounds=3, warmup_rounds=1)
    assert found in (0, sum(len(chunk.octets) for chunk in chunks)) or way is stock
    benchmark.extra_info["us_a_chunk"] = round(benchmark.stats["min"] / COUNT * 1e6, 3)


@pytest.mark.benchmark(group="opening: the last second")
@pytest.mark.parametrize("reading", ["stock reader, a message a chunk", "items", "items, read before"])
def test_jump_to_the_end(benchmark: Any, tmp_path: Path, chunks: list[Chunk], reading: str) -> None:
    path = tmp_path / "a.mcap"
    since = chunks[-1].time - 1_000_000_000
    if reading.startswith("items"):
        record_live(path, chunks)
        capture = read(path)
        assert isinstance(capture, McapCapture)
        if reading == "items, read before":
            capture.completeness()
        found = benchmark(lambda: sum(1 for _ in capture.items(since)))
    else:
        write_a_message_a_chunk(path, chunks)

        def stock_jump() -> int:
            with path.open("rb") as stream:
                return sum(1 for _ in make_reader(stream).iter_messages(starting_at=since))

        found = benchmark(stock_jump)
    assert 95 <= found <= 105
