"""Closings, as columns: of each row of a table the transaction that it belongs to, where that has closed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from dissectors.columns import NONE, Masks, Numbers, Small, Times

Values = npt.NDArray[Any]
ColumnOf = Callable[[str], Values]
"""A column of transactions by its name: "id", "verdict" …."""


class Closings:
    """One entry a row; each column is put together when somebody asks for it."""

    def __init__(self, tx: Times, least: int, most: int, held: Sequence[ColumnOf]) -> None:
        """`tx`: ids of the rows' transactions, 0 for none, else `least` … `most`. `held`: transactions that closed,
        theirs among them."""
        self._count = most - least + 1
        self._rows = np.where(tx > 0, tx - least, self._count)  # the last place is that of no transaction
        self._held: list[tuple[ColumnOf, Values, Masks | None]] = []
        for column in held:
            places = column("id") - least
            inside = (places >= 0) & (places < self._count)
            whole = bool(inside.all())
            self._held.append((column, places if whole else places[inside], None if whole else inside))

    def _column(self, name: str, none: int, form: type[np.integer[Any]]) -> Values:
        closed = np.full(self._count + 1, none, form)
        for column, places, inside in self._held:
            values = column(name)
            closed[places] = values if inside is None else values[inside]
        return closed[self._rows]

    @cached_property
    def verdict(self) -> Small:
        """Place in VERDICTS; -1 where the row has no transaction or it has not closed."""
        return self._column("verdict", NONE, np.int16)

    @cached_property
    def latency(self) -> Times:
        """ns; `NONE` where there is none."""
        return self._column("latency", NONE, np.int64)

    @cached_property
    def attempt(self) -> Numbers:
        """Which one it was, from 1; 0 where the row has no transaction or it has not closed."""
        return self._column("attempt", 0, np.int32)
