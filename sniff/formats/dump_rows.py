"""Rows of dumps that are no pairs: numbers of one width behind an offset, as `od`, `hexdump` and `xxd -e` write them
when they are asked for octal, decimal, characters or words. Pure.

What the cells are is told by all rows of a log together; a new form is a line of CELLS. Words are those of a
little-endian machine, and the last may be filled up: the offset at the end says how much.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

_LEAST = 2
_FITTING = 0.7
_MOST = 32
"""Cells of a row."""
SAME_ROWS = "*"
"""A line that stands for rows that are all as the one above it."""


@dataclass(frozen=True, slots=True)
class Cell:
    """Cells of one form. `width`: characters of each; `pattern`: one of them; `octets`: what it says, ValueError when
    it says none after all."""

    name: str
    width: int
    pattern: re.Pattern[str]
    octets: Callable[[str], bytes]


_SIGNS = {"\\0": 0, "\\a": 7, "\\b": 8, "\\t": 9, "\\n": 10, "\\v": 11, "\\f": 12, "\\r": 13, "": 0x20}


def _character(cell: str) -> bytes:
    """A character, its name, or its number in octal."""
    cell = cell.strip()
    octet = _SIGNS.get(cell)
    if octet is None:
        octet = int(cell, 8) if len(cell) == 3 else ord(cell)
    return bytes((octet,))


def _number(base: int, octets: int, signed: bool = False) -> Callable[[str], bytes]:
    def read(cell: str) -> bytes:
        try:
            return int(cell, base).to_bytes(octets, "little", signed=signed)
        except OverflowError:
            raise ValueError(cell) from None

    return read


def _cell(name: str, width: int, pattern: str, octets: Callable[[str], bytes]) -> Cell:
    return Cell(name, width, re.compile(pattern), octets)


CELLS = (
    _cell("octal", 4, r" [0-3][0-7]{2}", _number(8, 1)),
    _cell("decimal", 4, r" (?:  \d| \d\d|[12]\d\d)", _number(10, 1)),
    _cell("signed", 5, r" (?:   \d|  [ -]?\d\d?| -?\d\d\d?|-1\d\d| 1\d\d)", _number(10, 1, signed=True)),
    _cell("characters", 4, r" (?:[0-3][0-7]{2}| \\[0abtnvfr]|  [ -~])", _character),
    _cell("octal words", 7, r" [01][0-7]{5}", _number(8, 2)),
    _cell("decimal words", 6, r" (?=[ \d]{5}) {0,4}\d{1,5}", _number(10, 2)),
    _cell("decimal words", 8, r"   \d{5}", _number(10, 2)),
    _cell("long words", 9, r" {1,7}(?:[0-9a-f]{2}){1,4}", lambda cell: bytes.fromhex(cell)[::-1]),
)

FILLED_UP = ("characters", "octal", "long words")
"""Forms whose last row may be filled up by more than an octet."""

_ROW = re.compile(r"(?P<offset>[0-9a-f]{6,8})(?P<mark>:?)(?P<cells> .*)")
_LAST = re.compile(r"[0-9a-f]{6,8}\s*")
_CHARACTERS = re.compile(r"^(?P<cells>.*?)  (?P<shown>\S.{0,15})$")


def cells_of(texts: Sequence[str]) -> str:
    """The form of the cells of all rows of a log; "" where most lines are no rows, or rows of pairs."""
    lines = [text for text in texts if text.strip()]
    written = [text for text in lines if text.strip() != SAME_ROWS]
    rows = [match for text in written if (match := _ROW.fullmatch(text)) is not None]
    behind = [before.strip() == SAME_ROWS for before, text in pairwise(["", *lines]) if _ROW.fullmatch(text)]
    ends = sum(_LAST.fullmatch(text) is not None for text in written)
    if not rows or len(rows) + ends < _LEAST or 2 * (len(rows) + ends) < len(written):
        return ""
    for cell in CELLS:
        told = [octets for row in rows if (octets := _octets(row, cell)) is not None]
        if len(told) == len(rows) and any(_go_on(rows, told, behind, base) for base in (16, 8, 10)):
            return cell.name
    return ""


def _go_on(rows: Sequence[re.Match[str]], told: Sequence[bytes], behind: Sequence[bool], base: int) -> bool:
    """Whether offsets in a base follow from what the rows before hold, or begin anew. `behind`: whether rows that are
    as the one before are left out above each."""
    expected = fitting = 0
    for row, octets, is_behind in zip(rows, told, behind, strict=True):
        offset = int(row["offset"], base) if not set(row["offset"]) - set("0123456789abcdef"[:base]) else -1
        fitting += offset in (0, expected) or (is_behind and offset > expected)
        expected = offset + len(octets)
    return fitting >= _FITTING * len(rows)


def pairs_of_row(text: str, name: str) -> str:
    """A row with its octets in pairs; other lines as they are."""
    row = _ROW.fullmatch(text)
    if row is None:
        return text
    found = (_octets(row, cell) for cell in CELLS if cell.name == name)
    octets = next((one for one in found if one is not None), None)
    return text if octets is None else f"{row['offset']}  {octets.hex(' ')}"


def _octets(row: re.Match[str], cell: Cell) -> bytes | None:
    """The octets of a row, where all its cells are of a form."""
    written, shown = row["cells"], ""
    if row["mark"]:  # xxd, whose characters tell the order of octets in a word
        beside = _CHARACTERS.fullmatch(written)
        if beside is None or cell.name != "long words":
            return None
        written, shown = beside["cells"].rstrip(), beside["shown"]
    if cell.name != "characters":
        written = written.rstrip()
    many, rest = divmod(len(written), cell.width)
    cells = [written[at * cell.width : (at + 1) * cell.width] for at in range(many)]
    if rest or not 0 < many <= _MOST or not all(map(cell.pattern.fullmatch, cells)):
        return None
    try:
        octets = b"".join(map(cell.octets, cells))
    except ValueError:
        return None
    if shown and not all(sign == "." or sign == chr(octet) for sign, octet in zip(shown, octets, strict=False)):
        return None
    return octets
