"""Rows joined with their transactions by columns: the same as one by one, however the capture is cut into tables."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from sniff.bus.offline import settled
from sniff.engine.blocks import blocks_of
from sniff.engine.bulk import tables
from sniff.engine.column_join import ColumnJoin
from sniff.engine.session import Item, LineEvent
from sniff.engine.table import Table, rows_at
from sniff.engine.verdict_join import JudgedRow
from sniff.formats import read
from tests.seeds import in_turn

CAPTURES = sorted((Path(__file__).parents[3] / "captures").glob("*.cap.txt"))


def in_parts(path: Path, size: int) -> Iterator[Table]:
    """Tables of a capture whose blocks hold so many items."""
    capture = read(path)
    items: list[Item] = list(capture.items())
    parts = (items[begin : begin + size] for begin in range(0, len(items), size))
    blocks = (block for part in parts for block in blocks_of(part))
    for table in tables(blocks, capture.session):
        if not isinstance(table, LineEvent):
            yield table


@pytest.mark.parametrize("path", CAPTURES, ids=lambda path: path.name)
def test_every_row_comes_once_with_its_transaction(path: Path) -> None:
    capture = read(path)
    expected = list(settled(capture.items(), capture.session))
    for size in in_turn((1, 7, 100_000), CAPTURES.index(path), 3):
        joining, joined = ColumnJoin(), list[JudgedRow]()
        for table in in_parts(path, size):
            joined += [some.item(place) for some in joining.add(table) for place in range(some.begin, some.end)]
        joined += [some.item(place) for some in joining.flush() for place in range(some.begin, some.end)]
        assert joined == expected, size


def test_a_row_waits_only_for_its_transaction() -> None:
    """What is settled is given at once: nothing is held but from the first open row on."""
    joining = ColumnJoin()
    held = 0
    for table in in_parts(CAPTURES[0], 3):
        held += len(table) - sum(map(len, joining.add(table)))
        assert held < 10


@pytest.mark.parametrize("path", CAPTURES, ids=lambda path: path.name)
def test_rows_made_together_are_rows_made_one_by_one(path: Path) -> None:
    for table in in_parts(path, 100_000):
        places = [*range(0, len(table), 2), *range(1, len(table), 2)]
        assert rows_at(table, places) == [table.row(place) for place in places]
