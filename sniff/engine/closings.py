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
    """One entry a row; each column is put together when somebody asks for it.

    `ranks`: which of the transactions `least` … `most` a row belongs to, from `shift` on: `ranks + shift` is 1 for the
    least id, 0 for a row without one. `held`: transactions that closed, theirs among them.
    `form`: of columns whose values fit, narrower than their own.
    """

    def __init__(
        self,
        ranks: Values,
        shift: int,
        least: int,
        most: int,
        held: Sequence[ColumnOf],
        form: type[np.integer[Any]] | None = None,
    ) -> None:
        self._count = most - least + 2
        self._ranks, self._shift, self._form = ranks, shift, form
        self._held: list[tuple[ColumnOf, Values, Masks | None]] = []
        for column in held:
            places = column("id") - (least - 1)
            inside = (places > 0) & (places < self._count)
            whole = bool(inside.all())
            self._held.append((column, places if whole else places[inside], None if whole else inside))

    def _column(self, name: str, none: int, form: type[np.integer[Any]]) -> Values:
        told = [column(name) for column, _, _ in self._held]
        if self._form is not None and all(values.max(initial=0) <= np.iinfo(self._form).max for values in told):
            form = self._form
        closed = np.full(self._count, none, form)
        for (_, places, inside), values in zip(self._held, told, strict=True):
            closed[places] = values if inside is None else values[inside]
        found: Values = np.take(closed[self._shift :] if self._shift else closed, self._ranks)
        return found

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
