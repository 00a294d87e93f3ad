"""What became of the rows of one part of the tables that are kept: put together once, by whoever has time for it.

The thread that reads a file does so for each table when the next one is there, so that the first filter that asks for
verdicts or response times finds them. Where more closes later than that, they are put together again when asked for.
"""

from __future__ import annotations

import operator
from collections.abc import Sequence
from typing import Any

import numpy as np

from sniff.bus.kept_tables import Part, Values
from sniff.engine.closings import Closings
from sniff.engine.packed_table import PackedTable

WIDEST = 1 << 22
"""Transactions between the least and the greatest of a part from which on nothing is put together."""

_FORMS: dict[str, type[np.integer[Any]]] = {"verdict": np.int8, "latency": np.int32, "attempt": np.int16}
_AHEAD = ("verdict", "latency")


def became(part: Part, closing: Sequence[Part], name: str) -> Values:
    """A column of `Closings` of the rows of a part, as narrow as it is; the part remembers it. `closing`: the parts in
    which their transactions closed."""
    told = [one.whole for one in closing]
    known = part.remembered.get(name)
    if known is not None and len(known[0]) == len(told) and all(map(operator.is_, known[0], told)):
        return known[1]
    closings = Closings(*part.ranks(), *part.placed_ids, [one.closed_column for one in closing], _FORMS[name])
    values: Values = getattr(closings, name)
    part.remembered[name] = told, values
    return values


def look_ahead(table: PackedTable, following: PackedTable | None) -> None:
    """Remember what became of the rows of a table, of which it and the table that follows tell."""
    least, most = table.placed_ids
    if most - least > WIDEST:
        return
    both = [Part(one, one.first, 0) for one in (table, following) if one is not None]
    closing = [one for one in both if one.ids[0] <= most and one.ids[1] >= least]  # as `KeptTables.closing_parts`
    for name in _AHEAD:
        became(both[0], closing, name)
