"""Standard output whose reader takes nothing: waited for until all is over, and no longer."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator

import pytest

from sniff.cli import standard_streams
from sniff.cli.standard_streams import NotTaken, _Output, abandoned_once

pytest.importorskip("termios")


@pytest.fixture
def full(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[int, _Output]]:
    """A pipe that takes nothing more: where it is read, and the stream that is written."""
    monkeypatch.setattr(standard_streams, "LOOK_EVERY", 0.0)
    monkeypatch.setattr(standard_streams, "TAKES_NOTHING_FOR", 0.0)
    read, write = os.pipe()
    os.set_blocking(write, False)
    with contextlib.suppress(BlockingIOError):
        while os.write(write, bytes(4096)):
            pass
    os.set_blocking(write, True)
    yield read, _Output(write, "wb", closefd=False)
    os.close(read)
    os.close(write)


def test_it_is_given_up_once_all_is_over(full: tuple[int, _Output]) -> None:
    _, stream = full
    with abandoned_once(lambda: True), pytest.raises(NotTaken):
        stream.write(b"line")


def test_one_that_takes_something_again_gets_it(full: tuple[int, _Output], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(standard_streams, "TAKES_NOTHING_FOR", 1.0)
    read, stream = full
    with abandoned_once(lambda: not os.read(read, 65_536)):
        assert 0 < stream.write(bytes(100_000)) < 65_536, "as much as is taken without waiting"
