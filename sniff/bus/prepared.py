"""A table with what a store wants to know of it: found out where there is time, by the thread that reads. Pure."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from dissectors.columns import Times
from dissectors.frame import LineError
from dissectors.histogram import Histogram
from sniff.engine.packed_table import PackedTable
from sniff.engine.table import Table


@dataclass(frozen=True, slots=True)
class Prepared:
    """A table with what the store wants to know of it, which another thread may have found out.

    `packed`: None where the table is too small for it. `bad`: places of rows that are trouble by themselves;
    `bad_begins`: ns. `gaps`: between its rows. `begin`: of the first row, `end`: of the last; None where it was only
    heard while settings were searched for.
    """

    table: Table
    packed: PackedTable | None
    marks: Counter[LineError]
    gaps: Histogram
    bad: Times
    bad_begins: Times
    begin: int | None
    end: int | None


def prepare(table: Table, pack: bool = False) -> Prepared:
    """Look at a table. `pack`: it follows right behind the table before it, and will not be joined with another."""
    heard, frames = table.heard, table.frames
    marks = Counter(mark.error for row in table.odd.values() if row.searched is None for mark in row.event.marks)
    gaps = Histogram()
    between = heard[1:] & heard[:-1]
    if len(between):
        gaps.add_many((frames.start[1:] - frames.end[:-1])[between])
    bad = np.flatnonzero(heard & ~table.good)
    begin = int(frames.start[0]) if len(table) and heard[0] else None
    end = int(frames.end[-1]) if len(table) and heard[-1] else None
    return Prepared(table, PackedTable(table) if pack else None, marks, gaps, bad, frames.start[bad], begin, end)
