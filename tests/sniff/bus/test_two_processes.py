"""A capture that two processes read: what comes of it is the same, and no process is left."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from sniff import formats
from sniff.bus import two_processes
from sniff.bus.model import BusModel
from sniff.bus.offline import survey
from sniff.engine.blocks import Block, in_pieces
from sniff.engine.bulk import BulkEngine
from sniff.engine.capture import Capture
from sniff.engine.capture_error import CaptureError
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import Completeness, Item, LineEvent

CAPTURES = Path(__file__).parents[3] / "captures"
FOUND = CAPTURES / "findings"

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")


class Cut:
    """A capture in small blocks; `fails`: with how many blocks it ends in an error."""

    def __init__(self, capture: Capture, fails: int | None = None, error: Exception | None = None) -> None:
        self._capture, self._fails, self._error = capture, fails, error
        self._complete = Completeness(True)

    def items(self) -> Iterator[Item]:
        return self._capture.items()

    def blocks(self) -> Iterator[Block | LineEvent]:
        for number, item in enumerate(in_pieces(self._capture.blocks(), 30, 30)):
            if number == self._fails:
                raise self._error or CaptureError("it is damaged here")
            yield item
        self._complete = Completeness(False, "cut, as it happens")

    def completeness(self) -> Completeness:
        return self._complete


class Counting(BusModel):
    """A bus that knows which process feeds it what, and can be interrupted."""

    tables = 0
    interrupted = False

    def add_table(self, table: Any) -> None:
        super().add_table(table)
        self.tables += 1
        if self.interrupted:
            raise KeyboardInterrupt


@pytest.fixture
def forks(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Two processes from the first octet on; the processes made."""
    made: list[int] = []
    fork = os.fork

    def counted() -> int:
        process = fork()
        if process:
            made.append(process)
        return process

    monkeypatch.setattr(two_processes, "ENOUGH", 1)
    monkeypatch.setattr(two_processes, "divides", lambda *_: True)
    monkeypatch.setattr(os, "fork", counted)
    return made


def read(path: Path, model: type[BusModel] = BusModel, **cut: Any) -> tuple[BusModel, Cut]:
    capture = formats.read(path)
    source, session = Cut(capture, **cut), capture.session
    made = model(session, dissector_for(session))
    survey(source, session, made)
    return made, source


def said(model: BusModel, source: Cut) -> object:
    return (
        model.findings(),
        model.health(),
        [
            getattr(model.summary, name)
            for name in ("frames", "noise", "octets", "kinds", "found", "verdicts", "events")
        ],
        [(node.address, node.sent, node.received, node.verdicts) for node in model.summary.nodes],
        source.completeness(),
    )


@pytest.mark.parametrize(
    "path",
    [
        CAPTURES / "mstp-usual-faults.cap.txt",
        CAPTURES / "rtu-usual-faults.cap.txt",
        CAPTURES / "n2-noisy-ftdi.cap.txt",
        CAPTURES / "profibus-clean.cap.txt",
        FOUND / "adapter-unplugged.cap.txt",
        FOUND / "octets-lost-by-the-computer.cap.txt",
    ],
    ids=lambda path: path.name,
)
def test_two_find_what_one_finds(path: Path, monkeypatch: pytest.MonkeyPatch, forks: list[int]) -> None:
    by_two = said(*read(path))
    monkeypatch.setattr(two_processes, "divides", lambda *_: False)
    assert len(forks) == 1
    assert by_two == said(*read(path))
    assert are_gone(forks)


def test_an_error_comes_after_all_that_was_before_it(monkeypatch: pytest.MonkeyPatch, forks: list[int]) -> None:
    path, found = CAPTURES / "rtu-usual-faults.cap.txt", []
    for _ in range(2):
        capture = formats.read(path)
        model = Counting(capture.session, dissector_for(capture.session))
        with pytest.raises(CaptureError, match="it is damaged here"):
            survey(Cut(capture, fails=3), capture.session, model)
        found.append(model.tables)
        monkeypatch.setattr(two_processes, "divides", lambda *_: False)
    assert len(forks) == 1
    assert found[0] == found[1] > 2
    assert are_gone(forks)


def test_an_error_of_the_program_keeps_its_place(forks: list[int]) -> None:
    with pytest.raises(ValueError, match="unheard of") as caught:
        read(CAPTURES / "mstp-clean.cap.txt", fails=3, error=ValueError("unheard of"))
    assert caught.value.places_elsewhere[-1][0] == __file__  # type: ignore[attr-defined]
    assert "in blocks" in caught.value.__notes__[0]
    assert are_gone(forks)


def test_a_process_that_is_ended_is_an_error(monkeypatch: pytest.MonkeyPatch, forks: list[int]) -> None:
    take, here = BulkEngine.take, os.getpid()

    def ended(engine: BulkEngine, item: Block | LineEvent) -> Any:
        if os.getpid() != here:
            os.kill(os.getpid(), signal.SIGKILL)
        return take(engine, item)

    monkeypatch.setattr(BulkEngine, "take", ended)
    with pytest.raises(CaptureError, match="was ended before it was through"):
        read(CAPTURES / "mstp-clean.cap.txt")
    assert are_gone(forks)


def test_an_interruption_leaves_no_process(monkeypatch: pytest.MonkeyPatch, forks: list[int]) -> None:
    monkeypatch.setattr(Counting, "interrupted", True)
    with pytest.raises(KeyboardInterrupt):
        read(CAPTURES / "mstp-clean.cap.txt", Counting)
    assert len(forks) == 1
    assert are_gone(forks)


def are_gone(processes: list[int]) -> bool:
    """Whether none is left, not even as one that nobody waited for."""
    for process in processes:
        try:
            os.kill(process, 0)
        except ProcessLookupError:
            continue
        return False
    return True
