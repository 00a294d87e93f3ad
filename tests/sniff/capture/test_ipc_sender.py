from __future__ import annotations

import socket

import pytest

from dissectors.frame import Chunk
from sniff.capture.ipc import MessageSplitter, ReceivedMessage, decode_message, encode_tick, one_by_one
from sniff.capture.ipc_sender import AT_ONCE, IpcSender
from sniff.engine.session import LineEvent, LineEventKind


@pytest.fixture
def pair():
    here, there = socket.socketpair()
    with here, there:
        yield here, there


def receive(there: socket.socket) -> list[object]:
    there.setblocking(False)
    splitter = MessageSplitter()
    messages: list[object] = []
    try:
        while data := there.recv(65536):
            messages += one_by_one(filter(None, (decode_message(*message) for message in splitter.feed(data))))
    except BlockingIOError:
        pass
    return messages


def test_a_reader_that_does_not_read_never_blocks_nor_grows_memory(pair) -> None:
    here, there = pair
    outlet = IpcSender(here, 2, backlog=50_000)
    sent = 0
    for number in range(20_000):
        outlet.item(number % 2, Chunk(number, bytes(100)))
        outlet.droppable(encode_tick(0, number))
        if number % 10 == 0:
            outlet.flush()
        sent += 100
        assert outlet.size < 60_000
    got = 0
    for _ in range(100):
        outlet.flush()
        got += sum(len(message.item.octets) for message in receive(there) if isinstance(message, ReceivedMessage))
    assert got + sum(outlet.dropped) == sent
    assert min(outlet.dropped) > 0


def test_a_gap_is_told_where_it_was(pair) -> None:
    here, there = pair
    outlet = IpcSender(here, 1, backlog=1000)
    for number in range(100):
        outlet.item(0, Chunk(number, bytes(50)))
    outlet.flush()
    outlet.item(0, Chunk(1000, b"after"))
    outlet.flush()
    messages = [message.item for message in receive(there)]
    *before, gap, after = messages
    assert all(isinstance(item, Chunk) for item in before)
    assert isinstance(gap, LineEvent)
    assert (gap.kind, gap.count) == (LineEventKind.DROPPED, 50 * (100 - len(before)))
    assert after == Chunk(1000, b"after")


def test_a_reader_that_is_gone_costs_nothing(pair) -> None:
    here, there = pair
    outlet = IpcSender(here, 1)
    there.close()
    for _ in range(10):
        outlet.item(0, Chunk(1, bytes(100)))
        outlet.flush()
    assert not outlet.open
    assert outlet.size == 0
    assert outlet.dropped == [0]
    outlet.finish(b"", 1)


def test_of_a_long_backlog_only_what_is_sent_at_once_is_joined(pair, monkeypatch: pytest.MonkeyPatch) -> None:
    here, _ = pair
    outlet = IpcSender(here, 1, backlog=10**9)
    joined: list[int] = []
    whole = IpcSender._next_parts
    monkeypatch.setattr(IpcSender, "_next_parts", lambda self: joined.append(len(parts := whole(self))) or parts)
    for number in range(6000):
        outlet.item(0, Chunk(number, bytes(1000)))
        if number % 100 == 0:
            outlet.flush()
            assert outlet.gathered == 0
    assert outlet.size > 10 * max(joined)
    assert max(joined) <= 2 * AT_ONCE


def test_events_that_were_dropped_are_no_octets(pair) -> None:
    here, there = pair
    outlet = IpcSender(here, 1, backlog=1000)
    outlet.item(0, Chunk(1, bytes(2000)))
    for number in range(3):
        outlet.item(0, LineEvent(2 + number, LineEventKind.NOTE, "something"))
    outlet.flush()
    outlet.item(0, Chunk(9, b"after"))
    outlet.flush()
    _, gap, after = (message.item for message in receive(there))
    assert (gap.kind, gap.count, after) == (LineEventKind.DROPPED, 0, Chunk(9, b"after"))
    assert outlet.dropped == [0]
