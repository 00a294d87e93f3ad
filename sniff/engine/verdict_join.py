"""Rows joined with the verdicts of their transactions, in the order of the wire."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from dissectors.quick_values import quickly_made
from dissectors.tracker import Transaction
from sniff.engine.engine import Output, Row

if TYPE_CHECKING:
    from dissectors.meaning import Meaning

HELD = 20_000
"""Rows held back at most while waiting for the verdict of the oldest."""
REMEMBERED = 1000
"""Rows for which a closed transaction is still known after its last one: a row may be placed in it afterwards."""

Wanted = Callable[[Row, Transaction | None], bool]


@quickly_made
@dataclass(frozen=True, slots=True)
class JudgedRow:
    """A row with the transaction it belongs to (None: noise, or never closed), and what it means to its device."""

    row: Row
    transaction: Transaction | None
    meaning: Meaning | None = None


class Meanings(Protocol):
    """Knows what rows mean to their devices."""

    def meaning(self, row: Row) -> Meaning | None:
        """What a row means, None when nothing is known."""
        ...


class VerdictJoin:
    """Holds rows until their transaction has closed, so that each can be shown with its verdict; keeps the order."""

    def __init__(self, points: Meanings | None = None, wanted: Wanted | None = None) -> None:
        """`points`, fed before this, says what rows mean to their devices. Only rows that are `wanted` are given."""
        self._points = points
        self._wanted = wanted
        self._rows: deque[Row] = deque()
        self._closed: dict[int, Transaction] = {}
        self._in_order: deque[Transaction] = deque()  # the same, as they closed

    def add(self, output: Output) -> Iterator[JudgedRow]:
        """Take what the engine gave; give the rows that are settled by it."""
        self._rows.extend(output.rows)
        for transaction in output.transactions:
            self._closed[transaction.id] = transaction
            self._in_order.append(transaction)
        while self._rows and (len(self._rows) > HELD or self._is_settled(self._rows[0])):
            yield from self._pop()

    def flush(self) -> Iterator[JudgedRow]:
        """Give all that is left."""
        while self._rows:
            yield from self._pop()

    def _is_settled(self, row: Row) -> bool:
        return row.placement is None or row.placement.tx in self._closed

    def _pop(self) -> Iterator[JudgedRow]:
        row = self._rows.popleft()
        transaction = None if row.placement is None else self._closed.get(row.placement.tx)
        self._forget(row.no - REMEMBERED)
        if self._wanted is None or self._wanted(row, transaction):
            yield JudgedRow(row, transaction, None if self._points is None else self._points.meaning(row))

    def _forget(self, before: int) -> None:
        """Let go of what closed and has no row left that could ask for it."""
        while self._in_order and max(self._in_order[0].request or 0, self._in_order[0].response or 0) < before:
            del self._closed[self._in_order.popleft().id]
