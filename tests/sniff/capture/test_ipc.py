from __future__ import annotations

import contextlib
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dissectors.frame import Chunk, LineError, Mark
from sniff.capture import ipc
from sniff.capture.ipc import (
    IpcError,
    IpcKind,
    MessageSplitter,
    ReceivedMessage,
    Status,
    Tick,
    decode_derived,
    decode_message,
    encode_derived,
    encode_item,
    encode_reads,
    encode_status,
    encode_tick,
    octets_in,
    one_by_one,
)
from sniff.engine.session import LineEvent, LineEventKind
from sniff.recording.derived_message import DerivedMessage

times = st.integers(-(2**63), 2**63 - 1)
errors = st.integers(1, 15).map(LineError)
marks = st.lists(st.builds(Mark, st.integers(0, 70000), errors), max_size=5).map(tuple)
items = st.one_of(
    st.builds(Chunk, times, st.binary(max_size=300), marks),
    st.builds(LineEvent, times, st.sampled_from(LineEventKind), st.text(max_size=40), times),
)
messages = st.lists(st.tuples(st.integers(0, 255), items), max_size=8)


@given(messages, st.lists(st.integers(0, 3000), max_size=8))
def test_items_cross_unchanged_in_any_cut(sent, cuts) -> None:
    stream = b"".join(encode_item(bus, item) for bus, item in sent)
    bounds = sorted({0, len(stream), *(cut for cut in cuts if cut <= len(stream))})
    splitter = MessageSplitter()
    received = [
        decode_message(*message) for begin, end in pairwise(bounds) for message in splitter.feed(stream[begin:end])
    ]
    assert received == [ReceivedMessage(bus, item) for bus, item in sent]


def test_text_that_is_no_unicode_crosses() -> None:
    (message,) = MessageSplitter().feed(encode_item(0, LineEvent(1, LineEventKind.NOTE, "\udcff")))
    assert decode_message(*message) == ReceivedMessage(0, LineEvent(1, LineEventKind.NOTE, "?"))


@pytest.mark.parametrize(("far", "near"), [(1 << 63, (1 << 63) - 1), (-(1 << 64), -(1 << 63))])
def test_numbers_beyond_64_bits_of_a_file_that_is_played_cross_as_near_as_may_be(far, near) -> None:
    sent = [
        LineEvent(far, LineEventKind.ERRORS, "parity", far),
        Chunk(far, b"a"),
        Chunk(far, b"a", (Mark(0, LineError.PARITY),)),
    ]
    stream = b"".join(encode_item(0, item) for item in sent) + encode_reads(0, [Chunk(far, b"a")]) + encode_tick(0, far)
    event, *chunks, tick = one_by_one(decode_message(*message) for message in MessageSplitter().feed(stream))
    assert event.item == LineEvent(near, LineEventKind.ERRORS, "parity", near)
    assert [chunk.item.time for chunk in chunks] == [near] * 3
    assert tick == Tick(0, near)


def test_the_other_messages() -> None:
    status = Status(3, "night.mcap", 10, 20, 30, 40, "normal", "disk full")
    stream = encode_tick(2, -5) + encode_status(status) + ipc.encode_ended("stopped", at_end=False)
    tick, told, ended = (decode_message(*message) for message in MessageSplitter().feed(stream))
    assert (tick, told) == (Tick(2, -5), status)
    assert ended == ipc.Ended("stopped")


@given(st.text(max_size=20), st.binary(max_size=50), st.sampled_from([{}, {"unit": "°C"}]))
def test_results_cross(topic, data, metadata) -> None:
    derived = DerivedMessage(topic, "sniff485.Value", 5, 4, data, metadata)
    ((kind, bus, body),) = MessageSplitter().feed(encode_derived(1, derived))
    assert (kind, bus, decode_derived(body)) == (IpcKind.DERIVED, 1, derived)


@given(st.lists(st.tuples(st.integers(-(1 << 63), (1 << 63) - 1), st.binary(min_size=1, max_size=300)), min_size=1))
def test_reads_cross_together(reads) -> None:
    chunks = [Chunk(time, octets) for time, octets in reads]
    (message,) = MessageSplitter().feed(encode_reads(3, chunks))
    kind, _, body = message
    assert octets_in(kind, body) == (chunks[0].time, sum(len(chunk.octets) for chunk in chunks))
    assert list(one_by_one([decode_message(*message)])) == [ReceivedMessage(3, chunk) for chunk in chunks]


@pytest.mark.parametrize("body", [b"", bytes(4), b"\1" + bytes(15), b"\1" + bytes(20), b"\xff" * 40])
def test_reads_that_do_not_add_up_are_refused(body) -> None:
    with pytest.raises(IpcError):
        decode_message(IpcKind.READS, 0, body)


@given(st.integers(0, 255), st.integers(0, 255), st.binary(max_size=60))
def test_malformed_messages_are_refused_not_crashed_on(kind, bus, body) -> None:
    for decode in (lambda: decode_message(kind, bus, body), lambda: decode_derived(body)):
        with contextlib.suppress(IpcError):
            decode()


@given(st.binary(max_size=200))
def test_any_stream_is_cut_or_refused(stream) -> None:
    try:
        cut = MessageSplitter().feed(stream)
    except IpcError:
        return
    assert sum(6 + len(body) for _, _, body in cut) <= len(stream)


def test_impossible_lengths_are_refused_before_memory_is_taken() -> None:
    for length in (0, 1, ipc.LIMIT + 1, 0xFFFFFFFF):
        with pytest.raises(IpcError):
            MessageSplitter().feed(length.to_bytes(4, "little") + b"\x03\x00")
