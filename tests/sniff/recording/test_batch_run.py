"""All batches of a chunk at once say what one after the other does, and nothing is taken that is not plain."""

from __future__ import annotations

import struct

import pytest

from sniff.recording import scan
from sniff.recording.batch import Batch
from sniff.recording.batch_run import run_of
from sniff.recording.clean_batches import CleanBatches
from sniff.recording.messages import Channel
from sniff.recording.topics import LINE, RAW

CHANNELS = {1: Channel(RAW), 2: Channel(LINE), 3: Channel("/bus/b")}
BATCHES = [(10_000, [(0, b"\x01\x02"), (7, b"\x03")]), (20_000, [(1, b"\x04\x05\x06")])]


def data(start: int, entries: list[tuple[int, bytes]]) -> bytes:
    steps = struct.pack(f"<{len(entries)}I", *(step for step, _ in entries))
    sizes = struct.pack(f"<{len(entries)}H", *(len(octets) for _, octets in entries))
    return struct.pack("<Iq", len(entries), start) + steps + sizes + b"".join(octets for _, octets in entries)


def message(channel: int, sequence: int, body: bytes, time: int = 5) -> bytes:
    content = scan.MESSAGE_HEAD.pack(channel, sequence, time, time) + body
    return scan.RECORD_HEAD.pack(scan.MESSAGE, len(content)) + content


FIRST, SECOND = message(1, 41, data(*BATCHES[0])), message(1, 43, data(*BATCHES[1]), 9)
DERIVED = message(3, 7, b"{}" * 20)


def test_a_run_is_its_batches() -> None:
    run = run_of(FIRST + DERIVED + SECOND, CHANNELS, RAW, frozenset((LINE,)))
    assert run is not None
    assert (run.sequence, run.entries, run.last) == (41, 3, 9)
    together, one_by_one = CleanBatches(), CleanBatches()
    assert not list(together.add(run))
    for start, entries in BATCHES:
        batch = Batch.decode(data(start, entries))
        assert batch is not None
        assert not list(one_by_one.add(type(run).alone(batch)))
    (a,), (b,) = together.rest(), one_by_one.rest()
    assert a.octets.tobytes() == b.octets.tobytes() == bytes(range(1, 7))
    assert a.times.tolist() == b.times.tolist() == [10_000, 10_007, 20_001]
    assert a.lengths.tolist() == b.lengths.tolist() == [2, 1, 3]


@pytest.mark.parametrize(
    "chunk",
    [
        FIRST + message(1, 44, data(*BATCHES[1])),  # a gap
        FIRST + message(1, 42, data(*BATCHES[1])),  # backwards
        FIRST + message(2, 0, b"{}" * 20) + SECOND,  # something on /line
        FIRST + message(1, 43, data(*BATCHES[1]) + b"x"),  # more octets than it claims
        FIRST + message(1, 43, data(*BATCHES[1])[:-1]),  # fewer
        FIRST + message(1, 43, data(9, [])) + b"",  # nothing in it
        FIRST + SECOND[:-1],  # cut off
        FIRST + SECOND + b"\x05",
        scan.RECORD_HEAD.pack(scan.CHANNEL, 60) + bytes(60) + FIRST,  # a definition
        DERIVED,
        b"",
    ],
)
def test_what_is_not_plain_is_left_to_one_after_the_other(chunk: bytes) -> None:
    assert run_of(chunk, CHANNELS, RAW, frozenset((LINE,))) is None
