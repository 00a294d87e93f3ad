"""Rows that were read later than the adapter explains: what is torn there was not spoilt. Pure, bounded."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable
from typing import Final

_KEPT: Final = 256


class LateRows:
    """The newest of them, in their order."""

    def __init__(self) -> None:
        self._rows: list[int] = []

    def add(self, rows: Iterable[int]) -> None:
        """Take the next ones."""
        self._rows += rows
        if len(self._rows) > 2 * _KEPT:
            del self._rows[:-_KEPT]

    def among(self, first: int, last: int) -> bool:
        """Whether any of the rows `first` … `last` came late."""
        place = bisect_left(self._rows, first)
        return place < len(self._rows) and self._rows[place] <= last
