"""A log of which a line is longer than what is read at once loses nothing, however it is written."""

from __future__ import annotations

import random
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dissectors.frame import Chunk
from sniff.formats import read
from sniff.formats.log_pieces import LONGEST_HELD, lines_in
from tests.seeds import in_turn

MANY = 50_000
OCTETS = random.Random(485).randbytes(MANY)


@pytest.mark.parametrize(("between", "encoding"), [(" ", "utf-8"), ("", "utf-8"), (",", "utf-16")])
def test_no_octet_is_lost(between: str, encoding: str, tmp_path: Path) -> None:
    path = tmp_path / "one.log"
    path.write_text(between.join(f"{octet:02X}" for octet in OCTETS) + "\n", encoding=encoding)
    capture = read(path)
    assert b"".join(block.reads.octets.tobytes() for block in capture.blocks()) == OCTETS  # type: ignore[union-attr]
    assert capture.completeness().whole


SPELLINGS: dict[str, Callable[[bytes], str]] = {
    "brackets": lambda octets: "".join(f"[{one:02X}]" for one in octets),
    "brackets apart": lambda octets: " ".join(f"[{one:02X}]" for one in octets),
    "angles": lambda octets: "".join(f"<{one:02X}>" for one in octets),
    "escapes": lambda octets: "".join(f"\\x{one:02x}" for one in octets),
    "escapes in quotes": lambda octets: '"' + "".join(f"\\x{one:02x}" for one in octets) + '"',
    "a Python string": lambda octets: repr(octets),
    "0x": lambda octets: " ".join(f"0x{one:02X}" for one in octets),
    "0x joined": lambda octets: "".join(f"0x{one:02X}" for one in octets),
    "0x in a list": lambda octets: ",".join(f"0x{one:02X}" for one in octets),
    "digits and h": lambda octets: " ".join(f"{one:02X}h" for one in octets),
    "digits behind $": lambda octets: "".join(f"${one:02X}" for one in octets),
    "digits behind %": lambda octets: "".join(f"%{one:02X}" for one in octets),
    "character codes": lambda octets: "".join(f"#{one}" for one in octets),
    "decimals": lambda octets: " ".join(str(one) for one in octets),
    "a list of decimals": lambda octets: "[" + ", ".join(str(one) for one in octets) + "]",
    "hyphens": lambda octets: octets.hex("-"),
    "colons": lambda octets: octets.hex(":"),
    "each with its number": lambda octets: ", ".join(f"0x{one:02X} ({one})" for one in octets),
    "each with its number behind a space": lambda octets: " ".join(f"{one:02X} ({one})" for one in octets),
    "bits": lambda octets: " ".join(f"{one:08b}" for one in octets),
    "words": lambda octets: " ".join(octets[at : at + 2].hex() for at in range(0, len(octets), 2)),
}


@pytest.mark.parametrize("spelling", SPELLINGS)
def test_no_octet_is_lost_however_it_is_written(spelling: str, tmp_path: Path) -> None:
    octets, path = OCTETS[:5_432], tmp_path / "one.log"
    for ahead in in_turn(("", "2026-03-01 10:00:00.125 RX: "), [*SPELLINGS].index(spelling), 2):
        path.write_text(ahead + SPELLINGS[spelling](octets) + "\n")
        capture = read(path)
        assert b"".join(item.octets for item in capture.items() if isinstance(item, Chunk)) == octets
        assert capture.completeness().whole


@pytest.mark.parametrize("size", [16, 250])
@pytest.mark.parametrize("written", [repr, lambda octets: "".join(f"#{one}" for one in octets)])
def test_lines_of_strings_and_codes_are_whole(written: Callable[[bytes], str], size: int, tmp_path: Path) -> None:
    path = tmp_path / "many.log"
    parts = [OCTETS[at : at + size] for at in range(0, 8_000, size)]
    path.write_text("".join(f"{written(part)}\n" for part in parts))
    capture = read(path)
    assert b"".join(item.octets for item in capture.items() if isinstance(item, Chunk)) == b"".join(parts)
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
