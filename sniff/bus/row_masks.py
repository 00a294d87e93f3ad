"""A filter over all rows that are kept: what the columns say of many at once, and which rows have to be looked at."""

from __future__ import annotations

from collections import OrderedDict
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import numpy.typing as npt

from sniff.bus.closings_ahead import WIDEST, became
from sniff.bus.kept_tables import KeptTables, Part
from sniff.engine.packed_table import PackedTable
from sniff.filter import Filter

if TYPE_CHECKING:
    from sniff.engine.table import Table
    from sniff.filter.columns import Closed

REFUSED, ACCEPTED, DOUBTFUL = 0, 1, 2
"""What is known of a number; who is doubtful has to be looked at."""

HELD = 4
"""Parts of which the answer is remembered."""
FARTHEST = 8
"""Parts that the closings of one part are looked for in; what lies farther off is doubtful."""

States = npt.NDArray[np.uint8]
Values = npt.NDArray[Any]


class _Remembering:
    """What became of the rows of a part; the part remembers it for other filters."""

    def __init__(self, part: Part, closing: list[Part]) -> None:
        self._part, self._closing = part, closing

    @property
    def verdict(self) -> Values:
        """As of closings."""
        return became(self._part, self._closing, "verdict")

    @property
    def latency(self) -> Values:
        """As of closings."""
        return became(self._part, self._closing, "latency")

    @property
    def attempt(self) -> Values:
        """As of closings."""
        return became(self._part, self._closing, "attempt")


class RowMasks:
    """What a filter says of rows and closings. Columns say something of the filter."""

    def __init__(self, kept: KeptTables, filter: Filter) -> None:
        self._kept = kept
        self._filter = filter
        self._held: OrderedDict[int, tuple[object, States]] = OrderedDict()  # by the identity of what is packed

    def rows(self, no: int) -> tuple[int, States]:
        """Of all rows that are kept together with one, uint8[n], and the number of the first of them."""
        part = self._kept.part_of(no)
        if part is None:
            return no, np.full(1, DOUBTFUL, np.uint8)
        return part.first, self._of(part)

    def closings(self, no: int) -> tuple[int, States]:
        """The same for closings: who is accepted has an accepted row."""
        part = self._kept.part_of_closing(no)
        if part is None:
            return no, np.full(1, DOUBTFUL, np.uint8)
        states: States = np.zeros(part.closed, np.uint8)
        for name in ("request", "response"):
            numbers = part.column(f"closed.{name}")
            there = numbers >= self._kept.first_no
            said: States = np.where(there, DOUBTFUL, REFUSED).astype(np.uint8)
            if there.any():
                for around in self._kept.parts_with(int(numbers[there].min()), int(numbers[there].max()), FARTHEST):
                    inside = (numbers >= max(around.first, self._kept.first_no)) & (numbers <= around.last)
                    said[inside] = self._of(around)[numbers[inside] - around.first]
            states = np.where(states == ACCEPTED, ACCEPTED, np.where(said == REFUSED, states, said)).astype(np.uint8)
        return part.closed_first, states

    def _of(self, part: Part) -> States:
        whole = part.whole
        if not isinstance(whole, PackedTable):
            return self._states(part)
        known = self._kept.last_closed if self._filter.of_closing else None
        held = self._held.get(id(whole))
        if held is None or held[0] != (known, whole):
            held = self._held[id(whole)] = (known, whole), self._states(part)
            if len(self._held) > HELD:
                self._held.popitem(last=False)
        return held[1]

    def _states(self, part: Part) -> States:
        view = cast("Table", part.view())
        closings: Closed | None = None
        if self._filter.of_closing:
            closings = self._closings(part)
        said = self._filter.masks(view, closings)
        if said is None:
            return np.full(part.rows, DOUBTFUL, np.uint8)
        sure, may = said
        states: States = sure.astype(np.uint8)
        if sure is not may:
            states[may & ~sure] = DOUBTFUL
        return states

    def _closings(self, part: Part) -> Closed | None:
        """What became of its rows; None where that is not known at once."""
        least, most = part.placed_ids
        return None if most - least > WIDEST else _Remembering(part, self._kept.closing_parts(least, most))
