"""A main process that is behind: it reads on, keeps so much, counts the rest, and sees the end when it comes."""

from __future__ import annotations

import socket
import tempfile
from collections.abc import Iterator
from types import SimpleNamespace

import pytest

from dissectors.frame import Chunk
from sniff.capture import backlog
from sniff.capture.ipc import LOSSY, Ended, ReceivedMessage, encode_ended, encode_item
from sniff.capture.link import CaptureLink
from sniff.capture.spawn import Spawned
from sniff.engine.session import LineEventKind


class Process:
    pid = 1
    code: int | None = 0

    def poll(self) -> int | None:
        return self.code

    def wait(self, timeout: float | None = None) -> int | None:
        return self.code


@pytest.fixture
def ends() -> Iterator[SimpleNamespace]:
    ours, theirs = socket.socketpair()
    ours.setblocking(False)
    process = Process()
    with tempfile.TemporaryFile() as errors, theirs:
        link = CaptureLink(Spawned(process, ours, errors))  # type: ignore[arg-type]
        yield SimpleNamespace(link=link, theirs=theirs, process=process)
        link._kill()


def chunks(number: int, count: int) -> bytes:
    return b"".join(encode_item(0, Chunk(number + step, bytes(92))) for step in range(count))


def test_it_keeps_so_much_and_says_what_is_missing(ends, monkeypatch) -> None:
    monkeypatch.setattr(backlog, "MOST_WAITING", 20_000)
    for number in range(10):
        ends.theirs.sendall(chunks(number * 50, 50))
        assert ends.link.look()
    messages = ends.link.receive()
    ends.theirs.sendall(chunks(1000, 1))
    messages += ends.link.receive(1)
    items = [message.item for message in messages if isinstance(message, ReceivedMessage)]
    kept = [item for item in items if isinstance(item, Chunk)]
    holes = [item for item in items if not isinstance(item, Chunk)]
    assert 50 < len(kept) < 150
    assert kept[-1].time == 1000
    assert [hole.kind for hole in holes] == [LineEventKind.DROPPED]
    assert ends.link.dropped == {0: holes[0].count}
    assert holes[0].count + 92 * len(kept) == 501 * 92


def test_the_end_is_seen_although_much_waits_before_it(ends) -> None:
    ends.theirs.sendall(chunks(0, 500))
    ends.link.look()
    assert not ends.link.closing
    ends.theirs.sendall(encode_ended("stopped", at_end=False))
    ends.link.look()
    assert ends.link.closing
    assert ends.link.ended is None
    messages = []
    while ends.link.ended is None:
        messages += ends.link.receive()
    assert messages[-1] == Ended("stopped")
    assert len(messages) == 501


@pytest.mark.parametrize(("code", "lossy"), [(0, False), (LOSSY, True)])
def test_last_words_that_did_not_arrive(ends, code, lossy) -> None:
    """It waits two seconds for a main process that does not read; how it ended its exit code says."""
    ends.process.code = code
    ends.theirs.close()
    (ended,) = ends.link.receive(1)
    assert isinstance(ended, Ended)
    assert (ended.clean, ended.lossy) == (True, lossy)
