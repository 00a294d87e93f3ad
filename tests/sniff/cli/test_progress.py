"""Progress of reading: on a terminal, after half a second, gone at the end; nowhere else."""

from __future__ import annotations

import io
from itertools import count
from types import SimpleNamespace
from typing import Any

import pytest

from dissectors.frame import Chunk
from sniff.cli.progress import Watched

CHUNKS = [Chunk(at, b"12345") for at in range(8)]


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def watched(stream: io.StringIO, step: float, prints: bool = False) -> list[Any]:
    seconds = (step * turn for turn in count())
    capture: Any = SimpleNamespace(items=lambda: iter(CHUNKS))
    got = []
    for item in Watched(capture, stream, lambda: next(seconds), prints).items():
        got.append(item)
        if prints:
            stream.write("a row\n")
    return got


def test_what_takes_long_is_told_and_wiped_at_the_end() -> None:
    terminal = Terminal()
    assert watched(terminal, 0.2) == CHUNKS
    said = terminal.getvalue()
    assert "reading: 15 octets, 1 s" in said
    assert "reading: 40 octets, 2 s" in said
    assert said.endswith("\r\x1b[K")


@pytest.mark.parametrize(("stream", "step"), [(Terminal(), 0.01), (io.StringIO(), 5.0)])
def test_nothing_is_said_of_what_is_quick_or_where_nobody_looks(stream: io.StringIO, step: float) -> None:
    assert watched(stream, step) == CHUNKS
    assert stream.getvalue() == ""


def test_no_row_lands_behind_what_is_told() -> None:
    terminal = Terminal()
    watched(terminal, 0.3, prints=True)
    assert "reading: 40 octets" in terminal.getvalue()
    *rows, _ = terminal.getvalue().split("\n")
    assert len(rows) == len(CHUNKS)
    assert all(row == "a row" or row.endswith("\r\x1b[Ka row") for row in rows)
