"""A log of which a line is longer than what is read at once loses nothing, however it is written."""

from __future__ import annotations

import random
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dissectors.frame import Chunk
from sniff.formats import read
from sniff.formats.log_lines import LONGEST_HELD, lines_in

MANY = 50_000
OCTETS = random.Random(485).randbytes(MANY)


@pytest.mark.parametrize(("between", "encoding"), [(" ", "utf-8"), ("", "utf-8"), (",", "utf-16")])
def test_no_octet_is_lost(between: str, encoding: str, tmp_path: Path) -> None:
    path = tmp_path / "one.log"
    path.write_text(between.join(f"{octet:02X}" for octet in OCTETS) + "\n", encoding=encoding)
    capture = read(path)
    assert b"".join(block.reads.octets.tobytes() for block in capture.blocks()) == OCTETS  # type: ignore[union-attr]
    assert capture.completeness().whole


def test_long_cells_of_a_table_are_read_whole(tmp_path: Path) -> None:
    path, sizes = tmp_path / "long.csv", (20, 5000, 20, 60_000, 20)  # the fourth is longer than a cell may be
    cells = [OCTETS[:size].hex(" ") if size < 60_000 else (OCTETS * 2)[:size].hex(" ") for size in sizes]
    path.write_text("Time,Data\n" + "".join(f"2026-03-01 10:00:0{at}.000,{cell}\n" for at, cell in enumerate(cells)))
    capture = read(path)
    chunks = [len(item.octets) for item in capture.items() if isinstance(item, Chunk)]
    assert chunks == [20, 5000, 20, 20]
    assert "1 line was not understood" in capture.completeness().text


@given(st.text("a0 \r\n", max_size=60), st.lists(st.integers(0, 60)))
def test_lines_are_the_same_wherever_the_text_is_cut(text: str, cuts: list[int]) -> None:
    edges = [0, *sorted(cuts), len(text)]
    parts = [text[begin:end] for begin, end in pairwise(edges)]
    expected = [one for line in text.split("\n") for one in line.rstrip("\r").split("\r")]
    assert [one for one in lines_in(parts) if one] == [one for one in expected if one]


def test_what_is_held_is_bounded() -> None:
    given_out = 0
    for line in lines_in("01 03 " * 4000 for _ in range(40)):
        given_out += len(line)
    assert given_out > 40 * 24_000
    longest = max(map(len, lines_in("0" * 1000 for _ in range(2 * LONGEST_HELD // 1000))))
    assert longest < LONGEST_HELD
