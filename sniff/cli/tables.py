"""Tables as text, CSV or JSON Lines. A cell is text or a number; units stand in the heading.

People read headings, programs names: `p50 ms` is `p50_ms` in CSV and JSON (`name_of`).
"""

from __future__ import annotations

import csv
import re
import shutil
import sys
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from itertools import zip_longest
from typing import cast

from sniff.analysis.sanitizing import sanitized
from sniff.bus.row_files import safe_text
from sniff.cli import json_output

Cell = str | int | float | None
APART, LEAST = 2, 16
"""Cells between columns, and that a column of text has at least where a table is wider than its terminal."""


def write(
    headings: Sequence[str], rows: Iterable[Sequence[Cell]], style: str = "text", bold: Sequence[bool] = ()
) -> None:
    """Print a table. `style`: "text" (aligned), "csv", "json" (one object a row); both with names for headings. `bold`:
    rows that stand out, for a terminal that can show it."""
    if style == "text":
        _write_text(headings, [[_shown(cell) for cell in row] for row in rows], bold)
    else:
        Growing(headings, style).add(rows)


class Growing:
    """A table that is printed as its rows come, as "csv" or "json"."""

    def __init__(self, headings: Sequence[str], style: str) -> None:
        self._names = [name_of(heading) for heading in headings]
        self._writer = csv.writer(sys.stdout, lineterminator="\n") if style == "csv" else None
        if self._writer is not None:
            self._writer.writerow(self._names)

    def add(self, rows: Iterable[Sequence[Cell]]) -> None:
        """Print more of it."""
        if self._writer is not None:
            self._writer.writerows([[safe_cell(cell) for cell in row] for row in rows])
            return
        for row in rows:
            print(json_output.dumps(dict(zip(self._names, row, strict=True))))


_COLUMNS = {
    "MAC": "address",
    "master": "address",
    "slave": "address",
    "no answer": "unanswered",
    "least ms": "min_ms",
    "a second": "per_second",
}
_SIGNS = {"±": "plus_minus", "%": "percent", "/": " per "}


def name_of(heading: str) -> str:
    """What CSV and JSON call a column: small letters, digits and _, and the same for the same in every table."""
    for sign, word in _SIGNS.items():
        heading = heading.replace(sign, word)
    return _COLUMNS.get(heading) or re.sub(r"\W+", "_", heading.lower()).strip("_")


def safe_cell(cell: Cell) -> Cell:
    """A cell that no spreadsheet takes for a formula (it would run what begins with = + - @)."""
    return safe_text(cell) if isinstance(cell, str) else cell


def plain_cell(value: object) -> Cell:
    """A value as CSV has it: nothing for None, 1 and 0 for truth, text that no spreadsheet takes for a formula."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(int(value))
    return safe_cell(value) if isinstance(value, str) else cast(Cell, value)


def _shown(cell: Cell) -> str:
    if cell is None:
        return "–"
    if isinstance(cell, float):
        return f"{cell:.2f}" if abs(cell) < 100 else f"{cell:.0f}"
    return sanitized(cell)


def _write_text(headings: Sequence[str], rows: list[list[str]], bold: Sequence[bool]) -> None:
    if not rows:
        print("nothing")
        return
    widths = [max(len(line[column]) for line in [list(headings), *rows]) for column in range(len(headings))]
    numeric = [all(_is_number(row[column]) for row in rows) for column in range(len(headings))]
    if sys.stdout.isatty():
        widths = fitting(widths, numeric, shutil.get_terminal_size().columns)
    for at, line in enumerate([list(headings), *rows], -1):
        for text in _lines(line, widths, numeric):
            print(f"\x1b[1m{text}\x1b[0m" if 0 <= at < len(bold) and bold[at] else text)


def fitting(widths: Sequence[int], numeric: Sequence[bool], room: int) -> list[int]:
    """Widths with which a table has `room` cells: its widest columns of text give way; as they are where that is not
    enough."""
    room -= APART * (len(widths) - 1)
    for most in range(max(widths), LEAST - 1, -1):
        made = [width if right else min(width, most) for width, right in zip(widths, numeric, strict=True)]
        if sum(made) <= room:
            return made
    return list(widths)


def _lines(line: Sequence[str], widths: Sequence[int], numeric: Sequence[bool]) -> Iterator[str]:
    """A row, with what has no room below."""
    parts = [
        textwrap.wrap(cell, width) if len(cell) > width else [cell] for cell, width in zip(line, widths, strict=True)
    ]
    for cells in zip_longest(*parts, fillvalue=""):
        placed = zip(cells, widths, numeric, strict=True)
        yield (
            (" " * APART)
            .join(cell.rjust(width) if right else cell.ljust(width) for cell, width, right in placed)
            .rstrip()
        )


def _is_number(text: str) -> bool:
    return text == "–" or text.replace(".", "", 1).replace("%", "", 1).lstrip("-−").isdigit()
