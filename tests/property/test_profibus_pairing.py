"""PROFIBUS telegrams paired by columns held against the tracker, whatever happens, at any cut of blocks."""

from __future__ import annotations

import random

import pytest

from dissectors.tracker import Transaction
from sniff.engine.blocks import blocks_of
from sniff.engine.bulk import tables
from sniff.engine.engine import Row
from sniff.engine.table import Table
from tests.property.profibus_buses import TROUBLES, bus
from tests.property.test_n2_pairing import by_rows
from tests.seeds import seeds


def assert_alike(seed: int, troubles: tuple[str, ...], share: float, turns: int = 250) -> None:
    session, chunks = bus(seed, turns, troubles, share)
    cuts = sorted(random.Random(seed).sample(range(1, len(chunks)), 2))
    parts = [chunks[first:beyond] for first, beyond in zip([0, *cuts], [*cuts, None], strict=True)]
    rows: list[Row] = []
    closed: list[Transaction] = []
    for table in tables((block for part in parts for block in blocks_of(part)), session):
        assert isinstance(table, Table)
        rows += table.rows()
        closed += [table.transaction(place) for place in range(len(table.transactions))]
    expected, settled = by_rows(chunks, session)
    for row, other in zip(rows, expected, strict=True):
        assert row == other
    assert closed == settled


@pytest.mark.parametrize("share", [0.03, 0.4])
@pytest.mark.parametrize("seed", seeds(4))
def test_exchanges_are_paired_as_the_tracker_pairs_them(seed: int, share: float) -> None:
    assert_alike(seed, TROUBLES, share)


@pytest.mark.parametrize("trouble", TROUBLES)
def test_each_trouble_alone_is_paired_alike(trouble: str) -> None:
    assert_alike(7, (trouble,), 0.1, 100)
