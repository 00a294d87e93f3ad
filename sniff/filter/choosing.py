"""The rows of settled stretches that a filter accepts. Pure."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sniff.engine.table import AT_ONCE, rows_at
from sniff.filter.columns import closed_rows
from sniff.filter.plan import Filter

if TYPE_CHECKING:
    from sniff.engine.column_join import SettledRows


def chosen(some: SettledRows, wanted: Filter) -> list[int]:
    """Places in their table of the rows that a filter accepts, ascending; only doubtful ones become rows."""
    if wanted.root is None:
        return list(range(some.begin, some.end))
    closed = closed_rows(len(some.table), some.begin, some.which, some.closed)
    said = wanted.masks(some.table, closed)
    if said is None:
        return _asked(some, range(some.begin, some.end), wanted)
    sure, may = said[0][some.begin : some.end], said[1][some.begin : some.end]
    certain: list[int] = (np.flatnonzero(sure) + some.begin).tolist()
    doubtful: list[int] = (np.flatnonzero(may & ~sure) + some.begin).tolist()
    return sorted(certain + _asked(some, doubtful, wanted)) if doubtful else certain


def _asked(some: SettledRows, places: list[int] | range, wanted: Filter) -> list[int]:
    found: list[int] = []
    for begin in range(0, len(places), AT_ONCE):
        part = places[begin : begin + AT_ONCE]
        rows_of = zip(part, rows_at(some.table, part), strict=True)
        found += [place for place, row in rows_of if wanted(row, some.transaction(place))]
    return found
