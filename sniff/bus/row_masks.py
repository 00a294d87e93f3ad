"""A filter over all rows that are kept: what the columns say of many at once, and which rows have to be looked at."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import numpy.typing as npt

from sniff.bus.kept_tables import KeptTables, Part
from sniff.engine.closings import Closings
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
WIDEST = 1 << 22

States = npt.NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class _Verdicts:
    """Verdicts of rows alone; nobody asks for the rest."""

    verdict: npt.NDArray[Any]

    @property
    def latency(self) -> npt.NDArray[Any]:
        """Not asked for."""
        raise NotImplementedError

    @property
    def attempt(self) -> npt.NDArray[Any]:
        """Not asked for."""
        raise NotImplementedError


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
        """What became of its rows; None where that is not known at once. Verdicts are remembered by the part."""
        known = part.verdicts
        if known is not None and not self._filter.names & {"latency_ms", "attempt"}:
            closing = self._kept.closing_parts(*part.placed_ids)
            if len(known[0]) == len(closing) and all(a is b.whole for a, b in zip(known[0], closing, strict=True)):
                return _Verdicts(known[1])
        tx = part.column("placed.tx")
        placed = tx[tx > 0]
        least, most = (int(placed.min()), int(placed.max())) if len(placed) else (1, 1)
        if most - least > WIDEST:
            return None
        part.placed_ids = least, most
        closing = self._kept.closing_parts(least, most)
        made = Closings(tx, least, most, [one.closed_column for one in closing])
        if self._filter.names & {"latency_ms", "attempt"}:
            return made
        part.verdicts = [one.whole for one in closing], made.verdict.astype(np.int8)
        return _Verdicts(part.verdicts[1])
