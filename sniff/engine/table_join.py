"""Rows of tables joined with the verdicts of their transactions; only those that are wanted become objects. Pure."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol, runtime_checkable

import numpy as np

from sniff.engine.engine import Output
from sniff.engine.table import AT_ONCE, Table, rows_at
from sniff.engine.verdict_join import JudgedRow, VerdictJoin, Wanted


@runtime_checkable
class Chooses(Protocol):
    """A test of rows that can also say of a table which of them need to be asked."""

    def candidates(self, table: Table) -> list[int] | None:
        """Places in the table; None: all."""
        ...


class TableJoin:
    """Fed tables in order; gives the rows that are wanted (all, where nothing is said), each with its transaction."""

    def __init__(self, wanted: Wanted | None = None) -> None:
        self._wanted = wanted
        self._settling = VerdictJoin(None, wanted)
        self._awaited: set[int] = set()  # transactions of rows that were given to the join and had not closed

    def add(self, table: Table) -> Iterator[JudgedRow]:
        """Take the table that follows; give the rows that are settled by it."""
        places = self._wanted.candidates(table) if isinstance(self._wanted, Chooses) else None
        if places is None:
            places = list(range(len(table)))
        yield from self._settling.add(Output((), self._closed(table, places)))
        for begin in range(0, len(places), AT_ONCE):
            rows = tuple(rows_at(table, places[begin : begin + AT_ONCE]))
            yield from self._settling.add(Output(rows, ()))

    def flush(self) -> Iterator[JudgedRow]:
        """Give all that is left."""
        yield from self._settling.flush()

    def _closed(self, table: Table, places: list[int]) -> tuple:  # type: ignore[type-arg]
        """Of the transactions that closed those that a wanted row may ask for."""
        ids = table.transactions.id
        asked = self._awaited.union(table.placed.tx[places].tolist())
        needed = np.flatnonzero(np.isin(ids, list(asked))).tolist()
        self._awaited = asked.difference(ids[needed].tolist(), {0})
        return tuple(map(table.transaction, needed))
