"""Columns of a list and how they share the width. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from rich.cells import cell_len, set_cell_size


@dataclass(frozen=True, slots=True)
class Column:
    """One column: `width` in cells, 0 takes what is left; `needs`: the list's width from which it is shown; `spills`: a
    text that is too long goes on over empty cells behind it."""

    name: str
    title: str
    width: int = 0
    right: bool = False
    needs: int = 0
    spills: bool = False


class Cell(NamedTuple):
    """What stands in a column; `style` names a component style of the list ("" for the normal one)."""

    text: str
    style: str = ""


def lay_out(columns: Iterable[Column], width: int, **widths: int) -> list[Column]:
    """The columns that fit into `width`, the flexible one widened; `widths` replaces fixed widths by name."""
    shown = [
        replace(column, width=widths.get(column.name, column.width)) for column in columns if column.needs <= width
    ]
    shown = [column for column in shown if column.width > 0 or column.name not in widths]
    fixed = sum(column.width for column in shown) + len(shown) - 1
    rest = max(1, width - fixed)
    return [column if column.width else replace(column, width=rest) for column in shown]


LONGEST_NUMBER = 12
"""Characters of a word that may be one; longer ones are octets in hex, of which any part says something."""


def chosen(columns: Sequence[Column], names: Sequence[str]) -> list[Column]:
    """The columns of these names in their order, at any width; all of them, as usual, for no names."""
    by_name = {column.name: column for column in columns}
    return [replace(by_name[name], needs=0) for name in names if name in by_name] or list(columns)


def fit(text: str, width: int, right: bool = False) -> str:
    """Text in exactly `width` cells; what is cut off ends in "…", and no number is cut in the middle: what is left
    of it would read as another number."""
    length = cell_len(text)
    if length > width:
        return _cut(text, width) if width > 0 else ""
    return " " * (width - length) + text if right else text + " " * (width - length)


def _cut(text: str, width: int) -> str:
    kept = set_cell_size(text, width - 1)
    begin = max(kept.rfind(" "), kept.rfind("(")) + 1
    behind = text[len(kept) : len(kept) + 1]
    if 0 < begin < len(kept) <= begin + LONGEST_NUMBER and behind.strip() and any(map(str.isdigit, kept[begin:])):
        kept = kept[:begin]
    return set_cell_size(kept.rstrip() + "…", width) if kept.strip() else set_cell_size("…", width)


def pieces(columns: Sequence[Column], cells: dict[str, Cell]) -> list[Cell]:
    """Cells in the order of the columns, each exactly as wide as its column, one space between."""
    line: list[Cell] = []
    position = 0
    while position < len(columns):
        column = columns[position]
        if position:
            line.append(Cell(" "))
        cell, width = cells.get(column.name, Cell("")), column.width
        while column.spills and position + 1 < len(columns) and cell_len(cell.text) > width:
            behind = columns[position + 1]
            if cells.get(behind.name, Cell("")).text:
                break
            width += 1 + behind.width
            position += 1
        line.append(Cell(fit(cell.text, width, column.right), cell.style))
        position += 1
    return line
