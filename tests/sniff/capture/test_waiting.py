"""Waiting for descriptors, the way of this system and the way of any other."""

from __future__ import annotations

import selectors
import socket

import pytest

from sniff.capture.waiting import Waiting


@pytest.fixture(params=["here", "anywhere"])
def waiting(request, monkeypatch) -> Waiting:
    if request.param == "anywhere":
        monkeypatch.delattr("select.epoll", raising=False)
        monkeypatch.setattr(selectors, "DefaultSelector", selectors.SelectSelector)
    return Waiting()


def test_what_is_there_is_called_until_it_is_forgotten(waiting: Waiting) -> None:
    here, there = socket.socketpair()
    with here, there:
        waiting.register(here.fileno(), lambda: here.recv(64))
        assert waiting.wait(0) == []
        there.send(b"octets")
        ((fd, call),) = waiting.wait(10)
        assert (fd, call()) == (here.fileno(), b"octets")
        there.send(b"more")
        waiting.unregister(here.fileno())
        assert waiting.wait(0) == []


def test_a_descriptor_that_was_closed_is_forgotten_without_complaint(waiting: Waiting) -> None:
    here, there = socket.socketpair()
    fd = here.fileno()
    waiting.register(fd, lambda: None)
    here.close()
    there.close()
    waiting.unregister(fd)
    waiting.unregister(fd)
    assert waiting.wait(0) == []
