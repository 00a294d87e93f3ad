from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import pytest

from dissectors.frame import Chunk
from sniff.capture.ipc import Message, ReceivedMessage
from sniff.capture.link import CaptureLink

pytest.importorskip("termios")


@dataclass
class Pty:
    """The other side of a port."""

    master: int
    path: str

    def feed(self, octets: bytes) -> None:
        while octets:
            octets = octets[os.write(self.master, octets) :]

    def unplug(self) -> None:
        if self.master >= 0:
            os.close(self.master)
            self.master = -1


@pytest.fixture
def make_pty() -> Iterator[Callable[[], Pty]]:
    import tty

    made: list[Pty] = []

    def make() -> Pty:
        master, slave = os.openpty()
        tty.setraw(slave)
        made.append(Pty(master, os.ttyname(slave)))
        os.close(slave)
        return made[-1]

    yield make
    for pty in made:
        pty.unplug()


@pytest.fixture
def pty(make_pty: Callable[[], Pty]) -> Pty:
    return make_pty()


def collect(link: CaptureLink, enough: Callable[[list[Message]], object], seconds: float = 20.0) -> list[Message]:
    """Receive until `enough(messages)`; fails the test when that never comes."""
    messages: list[Message] = []
    until = time.monotonic() + seconds
    while not enough(messages):
        assert time.monotonic() < until, f"only {messages[-20:]}"
        assert link.ended is None, f"ended: {link.ended}"
        messages += link.receive(0.05)
    return messages


@pytest.fixture(name="collect")
def collect_fixture():
    return collect


@pytest.fixture
def octets() -> Callable[..., bytes]:
    def octets(messages: list[Message], bus: int = 0) -> bytes:
        return b"".join(
            message.item.octets
            for message in messages
            if isinstance(message, ReceivedMessage) and message.bus == bus and isinstance(message.item, Chunk)
        )

    return octets
