"""The /frames topic: what was encoded comes back, another version's is not used, damage never crashes."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dissectors.frame import Check, Chunk, Damage, FoundBy, Frame, Header, LineError, Mark, Noise, Place, Reason, Role
from dissectors.line import LineSettings
from dissectors.tracker import Interval, Placement, Transaction, Verdict
from sniff.engine.engine import Output, Row
from sniff.engine.session import Session
from sniff.recording import frames
from sniff.recording.frames import FrameBatch, FrameLog, encode
from sniff.recording.reader import McapCapture, read
from sniff.recording.topics import FRAMES
from sniff.recording.writer import Recorder
from tests.seeds import examples

I64 = st.integers(-(2**63) + 1, 2**63 - 1)
OCTETS = st.binary(max_size=20)
MARKS = st.lists(st.builds(Mark, st.integers(0, 2**32 - 1), st.integers(1, 15).map(LineError)), max_size=2).map(tuple)
WORD = st.text("abc-Ä ", min_size=1, max_size=5)
FLAG = st.text("abc-", min_size=1, max_size=5)
ADDRESS = st.none() | st.integers(0, 255)
MAYBE = st.none() | I64

FRAME = st.builds(
    Frame,
    WORD,
    OCTETS,
    I64,
    I64,
    st.sampled_from(Check),
    st.sampled_from(FoundBy),
    st.none() | st.sampled_from(Damage),
    st.none() | st.integers(0, 2**31 - 1),
    st.integers(0, 2**32 - 1),
    I64,
    MARKS,
    st.lists(FLAG, max_size=2).map(tuple),
)
NOISE = st.builds(Noise, OCTETS, I64, I64, st.sampled_from(Place), st.sampled_from(Reason), MARKS)


@st.composite
def rows(draw: st.DrawFn) -> Row:
    no = draw(st.integers(1, 2**63))
    event = draw(FRAME | NOISE)
    if isinstance(event, Noise):
        return Row(no, event)
    header = Header(
        event.protocol,
        draw(ADDRESS),
        draw(ADDRESS),
        draw(st.sampled_from(Role)),
        draw(WORD),
        draw(ADDRESS),
        draw(MAYBE),
        draw(MAYBE),
        draw(st.booleans()),
        draw(st.none() | WORD),
    )
    placement = None
    if draw(st.booleans()):
        tx = draw(st.integers(1, 2**63))
        placement = Placement(no, tx, draw(st.sampled_from(Role)), draw(ADDRESS), draw(ADDRESS))
    return Row(no, event, header, placement)


TRANSACTION = st.builds(
    Transaction,
    st.integers(1, 2**63),
    ADDRESS,
    WORD,
    MAYBE,
    MAYBE,
    st.sampled_from(Verdict),
    I64,
    I64,
    st.none() | st.builds(Interval, I64, I64, I64),
    st.integers(1, 2**31),
    MAYBE,
    st.none() | WORD,
)


@given(st.lists(rows(), max_size=8), st.lists(TRANSACTION, max_size=4), st.integers(0, 2**60))
@settings(deadline=None, max_examples=50)
def test_what_was_encoded_comes_back(some: list[Row], transactions: list[Transaction], offset: int) -> None:
    batch = FrameBatch.decode(encode(some, transactions, offset))
    assert batch is not None
    octets = b"".join(row.event.octets for row in some)
    assert list(batch.rows(octets, offset)) == some
    assert list(batch.transaction_values()) == transactions
    assert batch.events["no"].tolist() == [row.no for row in some]
    before = b"".join(row.event.octets for row in some[:2])
    assert list(batch.rows(before, offset))[:2] == some[:2]


@given(st.data())
@settings(deadline=None, max_examples=examples(150))
def test_damage_never_crashes(data: st.DataObject) -> None:
    some = [Row(1, Noise(b"ab", 1, 2, Place.AFTER, Reason.PAD, (Mark(1, LineError.BREAK),)))]
    some.append(
        Row(
            2,
            Frame("n2", b"cd", 3, 4, Check.GOOD, FoundBy.GAP, Damage.LONG, 7, flags=("odd",)),
            Header("n2", 1, 2, Role.POLL, "poll", error="what"),
            Placement(2, 1, Role.POLL),
        )
    )
    octets = bytearray(encode(some, [Transaction(1, 2, "poll", 2, None, Verdict.OPEN, 3, 4, Interval(1, 2, 3))], 0))
    for _ in range(data.draw(st.integers(1, 4))):
        octets[data.draw(st.integers(0, len(octets) - 1))] = data.draw(st.integers(0, 255))
    cut = data.draw(st.integers(0, len(octets)) | st.just(len(octets)))
    batch = FrameBatch.decode(bytes(octets[:cut]))
    if batch is not None:
        for row in batch.rows(b"abcd" * 100):
            assert isinstance(row.no, int)
        for transaction in batch.transaction_values():
            assert isinstance(transaction.verdict, Verdict)


def some_output(first: int) -> Output:
    given = [
        Row(first + n, Noise(bytes([n]) * 3, first * 10 + n, first * 10 + n + 5, Place.BEFORE, Reason.ZEROS))
        for n in range(5)
    ]
    return Output(tuple(given), (Transaction(first, None, "x", None, None, Verdict.OPEN, 1, 2),))


def record(path: Path, metadata: dict[str, str]) -> McapCapture:
    log = FrameLog()
    recorder = Recorder(path, Session("p", LineSettings(), "n2"))
    for first in (1, 6):
        output = some_output(first)
        for row in output.rows:
            recorder.chunk(Chunk(row.event.start, row.event.octets))
        log.add(output)
        taken = log.take()
        assert taken is not None
        recorder.derived(FRAMES, frames.SCHEMA.name, *taken, metadata)
    assert log.take() is None
    recorder.close()
    assert recorder.trouble is None
    capture = read(path)
    assert isinstance(capture, McapCapture)
    return capture


def test_frames_of_a_recording(tmp_path: Path) -> None:
    capture = record(tmp_path / "a.mcap", frames.METADATA)
    octets = b"".join(item.octets for item in capture.items() if isinstance(item, Chunk))
    batches = list(capture.frames())
    assert [row for batch in batches for row in batch.rows(octets)] == [*some_output(1).rows, *some_output(6).rows]
    assert [one.id for batch in batches for one in batch.transaction_values()] == [1, 6]


@pytest.mark.parametrize("metadata", [{}, {"program": "99.0"}])
def test_frames_of_another_version_are_not_used(tmp_path: Path, metadata: dict[str, str]) -> None:
    assert list(record(tmp_path / "a.mcap", metadata).frames()) == []


def test_frames_beside_a_hole_are_not_used(tmp_path: Path) -> None:
    capture = record(tmp_path / "a.mcap", frames.METADATA)
    capture.first_chunk = -1
    assert list(capture.frames()) == []
