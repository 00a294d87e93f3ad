"""Blocks of reads as /raw messages: the same messages as read by read, and the /frames of tables those of rows."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dissectors.frame import Chunk, LineError, Mark
from sniff.bus.offline import outputs
from sniff.engine.blocks import Block, blocks_of
from sniff.engine.bulk import tables
from sniff.engine.engine import Output, Row
from sniff.engine.session import Item, LineEvent, LineEventKind
from sniff.formats import read
from sniff.recording.batch import LONGEST
from sniff.recording.batcher import MOST_TIME, Batcher
from sniff.recording.block_batches import add_block
from sniff.recording.frame_columns import messages
from sniff.recording.frames import EVENTS, TRANSACTIONS, FrameBatch
from sniff.recording.topic_message import Message

CAPTURES = sorted((Path(__file__).parents[3] / "captures").glob("*.cap.txt"))

STEPS = st.sampled_from([0, 1, 1_000_000, MOST_TIME // 3, MOST_TIME, MOST_TIME + 1, -1, -5_000_000_000])
LENGTHS = st.sampled_from([1, 2, 8, 300, LONGEST, LONGEST + 1])
KINDS = st.sampled_from(["read", "read", "read", "read", "marked", "event"])


@st.composite
def items(draw: st.DrawFn) -> list[Item]:
    made: list[Item] = []
    time = draw(st.sampled_from([1_772_359_200_000_000_000, -(1 << 63) + 10_000_000_000, (1 << 63) - 2_000_000_000]))
    for kind, step, length, often in draw(
        st.lists(st.tuples(KINDS, STEPS, LENGTHS, st.sampled_from([1, 1, 3, 300])), max_size=20)
    ):
        for _ in range(often if length < 10 and abs(step) < 2_000_000 else 1):
            time = min(max(time + step, -(1 << 63)), (1 << 63) - 1)
            if kind == "event":
                made.append(LineEvent(time, LineEventKind.DROPPED, "gone", 3))
            else:
                marks = (Mark(length - 1, LineError.PARITY),) if kind == "marked" else ()
                made.append(Chunk(time, bytes(at & 0xFF for at in range(length)), marks))
    return made


@given(items())
def test_blocks_make_the_messages_of_their_reads(given_items: list[Item]) -> None:
    one_by_one, in_blocks = Batcher(), Batcher()
    expected: list[Message] = []
    for item in given_items:
        if isinstance(item, LineEvent):
            one_by_one.add_event(item)
        else:
            expected += one_by_one.add(item)
    made: list[Message] = []
    for part in blocks_of(given_items):
        if isinstance(part, Block):
            made += [message for together in add_block(in_blocks, part) for message in together]
        else:
            in_blocks.add_event(part)
    assert made + in_blocks.close() == expected + one_by_one.close()


def _texts_used(batch: FrameBatch) -> set[int]:
    tables = ((EVENTS, batch.events), (TRANSACTIONS, batch.transactions))
    return {0}.union(*(values[one.name] for columns, values in tables for one in columns if one.kind == "text"))


@pytest.mark.parametrize("path", CAPTURES, ids=lambda path: path.name)
def test_frames_of_tables_are_the_rows(path: Path) -> None:
    capture = read(path)
    expected: list[Row] = []
    for output in outputs(capture.items(), capture.session):
        if isinstance(output, Output):
            expected += output.rows
    octets = b"".join(row.event.octets for row in expected)
    rows: list[Row] = []
    closed, offset = 0, 0
    for table in tables(capture.blocks(), capture.session):
        if isinstance(table, LineEvent):
            continue
        for _, _, data in messages(table, offset):
            batch = FrameBatch.decode(data)
            assert batch is not None
            rows += batch.rows(octets)
            assert _texts_used(batch) == {0, *range(1, len(batch.strings) + 1)}
            closed += len(list(batch.transaction_values()))
        assert closed >= len(table.transactions)
        offset += len(table.octets)
    assert len(rows) == len(expected)
    for made, row in zip(rows, expected, strict=True):
        assert (made.no, made.header, made.placement) == (row.no, row.header, row.placement)
        assert (made.event.octets, made.event.start, made.event.end, made.event.marks) == (
            row.event.octets,
            row.event.start,
            row.event.end,
            row.event.marks,
        )
