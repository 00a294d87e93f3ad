"""The rows of settled stretches that a filter accepts. Pure."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dissectors.columns import Times
from sniff.engine.table import AT_ONCE, rows_at
from sniff.filter.columns import closed_rows
from sniff.filter.plan import Filter

if TYPE_CHECKING:
    from sniff.engine.column_join import SettledRows


def chosen(some: SettledRows, wanted: Filter) -> Times:
    """Places in their table of the rows that a filter accepts, ascending; only doubtful ones become rows."""
    if wanted.root is None:
        return np.arange(some.begin, some.end)
    closed = closed_rows(len(some.table), some.begin, some.which, some.closed)
    said = wanted.masks(some.table, closed)
    if said is None:
        return np.array(_asked(some, range(some.begin, some.end), wanted), np.int64)
    sure, may = said[0][some.begin : some.end], said[1][some.begin : some.end]
    certain: Times = np.flatnonzero(sure) + some.begin
    doubtful: list[int] = (np.flatnonzero(may & ~sure) + some.begin).tolist()
    if not doubtful:
        return certain
    return np.sort(np.concatenate((certain, np.array(_asked(some, doubtful, wanted), np.int64))))


def _asked(some: SettledRows, places: list[int] | range, wanted: Filter) -> list[int]:
    found: list[int] = []
    for begin in range(0, len(places), AT_ONCE):
        part = places[begin : begin + AT_ONCE]
        rows_of = zip(part, rows_at(some.table, part), strict=True)
        found += [place for place, row in rows_of if wanted(row, some.transaction(place))]
    return found
