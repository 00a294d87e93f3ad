"""Judging by stretches: exchanges that follow one another regularly at once, all else row by row, in their order.

What is regular, and what a stretch of it says, each protocol's judge knows. Here is what they have in common: where
such exchanges stand directly behind one another with nothing else closing beside them, and the walk through the rows.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np

if TYPE_CHECKING:
    from dissectors.columns import Masks, Times
    from dissectors.findings import Judge
    from dissectors.row_columns import RowColumns

LEAST = 32
"""Rows; fewer are judged sooner one by one."""

FEW = 4
"""Exchanges of a stretch; likewise."""


@dataclass(frozen=True, slots=True)
class Stretches:
    """Regular exchanges among some rows, in their order.

    `transaction`: place among those that closed. `request`, `last`: rows, one or two. `pairs`: of each stretch the
    first exchange and the one behind its last, which is answered.
    """

    transaction: Times
    request: Times
    last: Times
    pairs: list[tuple[int, int]]

    @classmethod
    def of(cls, transaction: Times, request: Times, answered: Masks, at_once: Masks, rows: RowColumns) -> Self:
        """Of exchanges each of which closes with its answer in the next row, with its request (`at_once`), or with the
        request of the one behind it."""
        last = request + answered
        pairs = _pairs(transaction, request, last, answered, at_once, rows) if len(request) else []
        return cls(transaction, request, last, pairs)


def _pairs(
    transaction: Times, request: Times, last: Times, answered: Masks, at_once: Masks, rows: RowColumns
) -> list[tuple[int, int]]:
    size, closed_by = len(request), rows.closed_by
    closings = np.bincount(closed_by[closed_by >= 0], minlength=len(rows))
    follows = np.zeros(size, bool)
    follows[1:] = (request[1:] == last[:-1] + 1) & (transaction[1:] == transaction[:-1] + 1)
    due = np.append(0, ~answered[:-1] & ~at_once[:-1]) * follows + at_once  # what the request's row should close
    odd = (closings[request] != due) | (answered & (closings[last] != 1))
    follows &= ~odd
    follows[1:] &= ~odd[:-1]
    begins = np.flatnonzero(~follows)
    ends = np.append(begins[1:], size)
    newest = np.maximum.accumulate(np.where(answered & ~odd, np.arange(size), -1))[ends - 1] + 1
    bare = closings[request] == at_once
    pairs = ((_first(bare, begin, end), end) for begin, end in zip(begins.tolist(), newest.tolist(), strict=True))
    return [pair for pair in pairs if pair[0] < pair[1]]


def _first(bare: Masks, begin: int, end: int) -> int:
    """The first exchange from `begin` on whose request closes nothing that came before."""
    while begin < end and not bare[begin]:
        begin += 1
    return begin


def take(
    judge: Judge,
    rows: RowColumns,
    stretches: Stretches | None,
    is_at_rest: Callable[[int, int], bool],
    pass_by: Callable[[int, int], None],
) -> None:
    """Take all rows.

    `is_at_rest`: whether the judge, as it stands, can be put behind exchanges [begin, end) by `pass_by`; that it holds
    nothing open. None for `stretches`: row by row.
    """
    walk = _Walk(judge, rows)
    if stretches is not None:
        request, last = stretches.request.tolist(), stretches.last.tolist()
        for begin, end in stretches.pairs:
            walk.see_until(request[begin])
            while end - begin >= FEW and not is_at_rest(begin, end):
                walk.see_until(last[begin] + 1)
                begin += 1
            if end - begin >= FEW:
                pass_by(begin, end)
                walk.pass_by(last[end - 1] + 1, int(stretches.transaction[end - 1]) + 1)
    walk.to_the_end()


class _Walk:
    """Through some rows."""

    def __init__(self, judge: Judge, rows: RowColumns) -> None:
        self._judge, self._rows = judge, rows
        self._place = self._at = 0  # row and transaction to come
        self._closed_by = rows.closed_by.tolist()

    def see_until(self, end: int) -> None:
        """Take rows one by one."""
        judge, rows, closed_by = self._judge, self._rows, self._closed_by
        for place in range(self._place, end):
            row = rows.row(place)
            judge.see(row.no, row.event, row.header, row.placement)
            while self._at < len(closed_by) and 0 <= closed_by[self._at] <= place:
                judge.settle(rows.transaction(self._at))
                self._at += 1
        self._place = max(self._place, end)

    def pass_by(self, place: int, at: int) -> None:
        """Go on with that row and that transaction."""
        self._place, self._at = place, at

    def to_the_end(self) -> None:
        """Take what is left."""
        self.see_until(len(self._rows))
        for at in range(self._at, len(self._closed_by)):
            self._judge.settle(self._rows.transaction(at))
