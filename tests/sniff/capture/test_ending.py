"""A capture process that is gone although its connection stays open, and one that says nothing any more."""

from __future__ import annotations

import os
import selectors
import socket
import subprocess
import sys
import tempfile
from collections.abc import Iterator

import pytest

pytest.importorskip("termios")

from sniff.capture import link as link_module
from sniff.capture.ending import awaited_exit_code, exit_code, in_words
from sniff.capture.ipc import Ended, Status, encode_status
from sniff.capture.link import SILENT, CaptureLink
from sniff.capture.spawn import Spawned
from tests.e2e.recording_bus import wait_until

HELD = "import ctypes, threading\nthreading.Thread(target=input).start()\nctypes.CDLL(None).pthread_exit(None)\n"
"""Its main thread ends, another waits for its standard input: so a process looks that a disk holds on to."""

ALIVE = "input()"


@pytest.fixture
def link_to(monkeypatch: pytest.MonkeyPatch) -> Iterator:
    """A link to a process, in whose name the test speaks on its end of the connection."""
    monkeypatch.setattr(link_module, "NOTHING_HEARD", 0.0)
    monkeypatch.setattr(link_module, "NOTHING_SAID", 0.0)
    ours, theirs = socket.socketpair()
    ours.setblocking(False)
    begun: list[subprocess.Popen[bytes]] = []

    def link_to(program: str) -> tuple[CaptureLink, subprocess.Popen[bytes]]:
        process = subprocess.Popen(
            [sys.executable, "-S", "-E", "-c", program], stdin=subprocess.PIPE, stderr=subprocess.DEVNULL
        )
        begun.append(process)
        return CaptureLink(Spawned(process, ours, errors)), process

    with theirs, tempfile.TemporaryFile() as errors:
        link_to.theirs = theirs  # type: ignore[attr-defined]
        yield link_to
        for process in begun:
            process.kill()
            process.communicate()
        ours.close()


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="needs /proc")
def test_one_that_a_disk_holds_is_gone_all_the_same(link_to) -> None:
    link, process = link_to(HELD)
    wait_until(lambda: exit_code(process) is not None, "it does not end")
    assert process.poll() is None, "the system does not give it"
    (ended,) = link.receive()
    assert isinstance(ended, Ended)


def test_silence_is_said_once_and_taken_back(link_to) -> None:
    link, process = link_to(ALIVE)
    link_to.theirs.sendall(encode_status(Status(0, "x.mcap", unwritten=7)))
    assert link.receive(1) == [Status(0, "x.mcap", unwritten=7)]
    assert link.receive() == [Status(0, "x.mcap", unwritten=7, error=SILENT)]
    assert link.receive() == []
    link_to.theirs.sendall(encode_status(Status(0, "x.mcap")))
    assert link.receive(1) == [Status(0, "x.mcap")]
    assert exit_code(process) is None
    assert awaited_exit_code(process, 0.0) is None


def test_what_came_while_this_side_was_stopped_is_no_silence(link_to, monkeypatch: pytest.MonkeyPatch) -> None:
    """A `select` that a stop has interrupted gives nothing once its time is over."""
    link, _ = link_to(ALIVE)
    waits = []

    class Interrupted(selectors.DefaultSelector):
        def select(self, timeout: float | None = None) -> list:
            waits.append(timeout)
            return super().select(timeout) if len(waits) > 1 else []

    link_to.theirs.sendall(encode_status(Status(0, "x.mcap")))
    monkeypatch.setattr(link_module.selectors, "DefaultSelector", Interrupted)
    link._reported[0] = Status(0, "older")
    monkeypatch.setattr(link_module, "NOTHING_SAID", 5.0)
    link._heard_at -= 60.0
    assert link.receive(0.1) == [Status(0, "x.mcap")]


def test_how_it_ended_in_words() -> None:
    assert in_words(-9, b"") == "capture process was ended by SIGKILL"
    assert in_words(1, b"Traceback\nValueError: no\n") == "capture process ended with code 1: ValueError: no"
    assert in_words(None, b"") == "capture process does not answer"


def test_any_signal_has_a_name() -> None:
    assert in_words(-9, b"") == "capture process was ended by SIGKILL"
    assert in_words(-40, b"") == "capture process was ended by signal 40"
