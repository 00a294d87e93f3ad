"""Blocks of reads as /raw messages: the same messages as read by read."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from dissectors.frame import Chunk, LineError, Mark
from sniff.engine.blocks import Block, blocks_of
from sniff.engine.session import Item, LineEvent, LineEventKind
from sniff.recording.batch import LONGEST
from sniff.recording.batcher import MOST_TIME, Batcher
from sniff.recording.block_batches import add_block
from sniff.recording.topic_message import Message

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
