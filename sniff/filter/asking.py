"""Single questions of a filter, asked of rows and of columns. Pure."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from dissectors.tracker import Transaction
from sniff.engine.engine import Row
from sniff.filter import fields
from sniff.filter.expressions import Expression
from sniff.filter.plan import Begins, Leaf

if TYPE_CHECKING:
    from dissectors.columns import Masks
    from sniff.engine.table import Table
    from sniff.filter.columns import Closed, ColumnsOf, Remembered


def leaf(of: Expression, accepts: Any, every: bool, words: str) -> Leaf:
    """Rows of which any value, or every one, is accepted."""
    get, held = of.get, of.columns
    remembered: Remembered = {}

    def ask(row: Row, tx: Transaction | None) -> bool:
        found = get(row, tx)
        if every:
            return bool(found) and all(accepts(value) for value in found)
        return any(accepts(value) for value in found)

    def columns(table: Table, closed: Closed | None) -> tuple[Masks, Masks] | None:
        assert held is not None
        parts = held(table, closed)
        if parts is None:
            return None
        chosen: Masks = parts[0].where(accepts, remembered)
        if len(parts) > 1:
            chosen = _of_several(parts, chosen, accepts, remembered, every)
        unsure = None
        for part in parts:
            if part.unsure is not None:
                unsure = part.unsure if unsure is None else unsure | part.unsure
        return (chosen, chosen) if unsure is None else (chosen & ~unsure, chosen | unsure)

    fixed = False if of.nowhere else None
    return Leaf(ask, columns if held is not None else None, words, of.of_closing, fixed)


def _of_several(parts: Sequence[Any], first: Masks, accepts: Any, remembered: Remembered, every: bool) -> Masks:
    """Rows of which any column, or every one that there is, is accepted."""
    if not every:
        for part in parts[1:]:
            first = first | part.where(accepts, remembered)
        return first
    there, refused = parts[0].has(), parts[0].has() & ~first
    for part in parts[1:]:
        has = part.has()
        there, refused = there | has, refused | (has & ~part.where(accepts, remembered))
    every_one: Masks = there & ~refused
    return every_one


def pair_of_columns(
    left: ColumnsOf, right: ColumnsOf, compare: Callable[[Any, Any], Any]
) -> Callable[[Table, Closed | None], tuple[Masks, Masks] | None]:
    def columns(table: Table, closed: Closed | None) -> tuple[Masks, Masks] | None:
        from sniff.filter.columns import Numbers, as_numbers

        ours, theirs = left(table, closed), right(table, closed)
        if ours is None or theirs is None or len(ours) != 1 or len(theirs) != 1:
            return None
        a, b = as_numbers(ours[0]), as_numbers(theirs[0])
        if not isinstance(a, Numbers) or not isinstance(b, Numbers):
            return None
        chosen: Masks = compare(a.values, b.values) & a.has() & b.has()
        if a.unsure is None and b.unsure is None:
            return chosen, chosen
        unsure = a.unsure if b.unsure is None else b.unsure if a.unsure is None else a.unsure | b.unsure
        assert unsure is not None
        return chosen & ~unsure, chosen | unsure

    return columns


def nowhere(table: Table, closed: Closed | None) -> Any:
    """A field of another protocol: no row has it."""
    import numpy as np

    from sniff.filter.columns import Numbers

    return (Numbers(np.zeros(len(table), np.int64), np.zeros(len(table), bool)),)


def delta(begins: Begins) -> tuple[fields.Getter, ColumnsOf]:
    """The time since the row before began."""

    def get(row: Row, _: Transaction | None) -> fields.Values:
        before = begins.of(row.no - 1)
        return ((0,) if row.no == 1 else ()) if before is None else (row.event.start - before,)

    def columns(table: Table, closed: Closed | None) -> Any:
        import numpy as np

        from sniff.filter.columns import Numbers

        starts = table.frames.start
        before = begins.take(table.first, starts)
        if not len(starts):
            return (Numbers(starts),)
        delta = np.diff(starts, prepend=starts[0] if before is None else np.int64(before))
        unsure = np.zeros(len(starts), bool)
        unsure[0] = before is None and table.first != 1
        odd = [place + 1 for place in table.odd if place + 1 < len(starts)]  # times beyond what columns hold
        unsure[odd] = True
        return (Numbers(delta, None, unsure),)

    return get, columns
