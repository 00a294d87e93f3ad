"""Placing the rows of a block: runs by columns, single rows by the tracker, in any order of both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from dissectors.columns import NONE, PlacementColumns, Run, TransactionColumns
from dissectors.tracker import Transaction
from sniff.engine.engine import Row
from sniff.engine.row_packing import placement_columns, transaction_columns
from sniff.engine.table import Table, joined_columns, rows_at


class Placing:
    """Fills in where the rows of a table belong, and what they closed."""

    def __init__(self, table: Table) -> None:
        count = len(table)
        self._table = table
        self._tx, self._role = np.zeros(count, np.int64), np.zeros(count, np.uint8)
        self._source, self._destination = np.full(count, NONE, np.int16), np.full(count, NONE, np.int16)
        self._single: list[int] = []
        self._rows: list[Row] = []
        self._closed: list[Transaction] = []
        self._closed_by: list[int] = []
        self._runs: list[TransactionColumns] = []
        self._runs_closed_by: list[np.ndarray[tuple[int], np.dtype[np.int64]]] = []

    def add(self, place: int, row: Row, closed: Sequence[Transaction]) -> None:
        """A row that the tracker took, and what it closed."""
        self._single.append(place)
        self._rows.append(row)
        self._closed += closed
        self._closed_by += [place] * len(closed)

    def add_run(self, run: Run, before: int) -> None:
        """Rows that were paired by columns; `before`: what is added to numbers of transactions."""
        rows, placed, closed = slice(run.begin, run.end), run.placements, run.transactions
        self._tx[rows], self._role[rows] = placed.tx + before, placed.role
        self._source[rows], self._destination[rows] = placed.source, placed.destination
        if before:
            closed = replace(closed, id=closed.id + before, of=np.where(closed.of == NONE, NONE, closed.of + before))
        self._runs.append(closed)
        self._runs_closed_by.append(run.closed_by)

    def table(self) -> Table:
        """The table, whole."""
        closed, closed_by = transaction_columns(self._closed), np.array(self._closed_by, np.int64)
        parts = [*zip(self._runs, self._runs_closed_by, strict=True), (closed, closed_by)]
        parts = sorted((part for part in parts if len(part[1])), key=lambda part: int(part[1][0]))
        if len(parts) > 1:
            closed = joined_columns(TransactionColumns, [columns for columns, _ in parts])
            closed_by = np.concatenate([rows for _, rows in parts])
            if (closed_by[1:] < closed_by[:-1]).any():
                order = np.argsort(closed_by, kind="stable")  # a row is in a run or not: none closes some of both
                closed, closed_by = closed.take(order), closed_by[order]
        elif parts:
            closed, closed_by = parts[0]
        single, alone = self._single, placement_columns(self._rows)
        self._tx[single], self._role[single] = alone.tx, alone.role
        self._source[single], self._destination[single] = alone.source, alone.destination
        placed = PlacementColumns(self._tx, self._role, self._source, self._destination)
        odd = {place: row for place, row in zip(single, self._rows, strict=True) if self._is_odd(place, row)}
        return replace(self._table, placed=placed, transactions=closed, closed_by=closed_by, odd=odd)

    def _is_odd(self, place: int, row: Row) -> bool:
        return place in self._table.odd or getattr(row.event, "assembly", None) is not None


class RowsAhead:
    """The rows of a table, asked for in order, as objects: those that the tracker is likely to be asked about, damaged
    frames and what follows them, are made some at a time."""

    def __init__(self, table: Table) -> None:
        self._table = table
        damaged = np.flatnonzero(~table.frames.ok)
        likely = np.zeros(len(table) + 1, bool)
        likely[damaged] = likely[damaged + 1] = True
        self._likely = np.flatnonzero(likely[: len(table)])
        self._made: dict[int, Row] = {}
        self._beyond = 0  # all likely ones before this place are made

    def at(self, place: int) -> Row:
        """The row at a place."""
        if place >= self._beyond:
            begin = int(self._likely.searchsorted(place))
            places = self._likely[begin : begin + _AHEAD].tolist()
            self._made = dict(zip(places, rows_at(self._table, places), strict=True))
            self._beyond = places[-1] + 1 if len(places) == _AHEAD else len(self._table)
        return self._made.get(place) or self._table.row(place)


_AHEAD = 1024
