"""Filters over tables: for the columns of a row that a table holds, which of its rows a comparison accepts. Pure.

A mask speaks of plain rows only; what is odd in a table is asked row by row (`Filter.mask` in filtering.py).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from dissectors.columns import DAMAGES, FOUNDS, NONE, ROLES, Masks
from sniff.engine.table import Table

Scalar = int | float | str
Accepts = Callable[[Scalar], bool]


@dataclass(frozen=True, slots=True)
class Numbers:
    """Numbers by row; `there`: where a row has one."""

    values: npt.NDArray[np.integer[Any]]
    there: Masks

    def where(self, accepts: Accepts) -> Masks:
        """Rows whose value is accepted; each distinct value is asked once."""
        distinct, which = np.unique(self.values, return_inverse=True)
        accepted = np.array([accepts(value) for value in distinct.tolist()], bool)
        chosen: Masks = accepted[which] & self.there
        return chosen


@dataclass(frozen=True, slots=True)
class Texts:
    """Texts by row, as places in `texts`; None is not there."""

    codes: npt.NDArray[np.integer[Any]]
    texts: Sequence[str | None]

    def where(self, accepts: Accepts) -> Masks:
        """Rows whose text is accepted."""
        accepted = np.array([text is not None and accepts(text) for text in self.texts], bool)
        chosen: Masks = accepted[self.codes]
        return chosen


Column = Numbers | Texts


def _optional(values: npt.NDArray[np.integer[Any]]) -> Numbers:
    return Numbers(values, values != NONE)


def _source(table: Table) -> Numbers:
    return _optional(np.where(table.placed.tx > 0, table.placed.source, table.frames.source))


def _destination(table: Table) -> Numbers:
    return _optional(np.where(table.placed.tx > 0, table.placed.destination, table.frames.destination))


def _always(table: Table, values: npt.NDArray[np.integer[Any]]) -> Numbers:
    return Numbers(values, np.ones(len(table), bool))


def _same(table: Table, text: str) -> Texts:
    return Texts(np.zeros(len(table), np.uint8), (text,))


MASKED: dict[str, Callable[[Table], tuple[Column, ...]]] = {
    "no": lambda table: (_always(table, table.first + np.arange(len(table))),),
    "src": lambda table: (_source(table),),
    "dst": lambda table: (_destination(table),),
    "addr": lambda table: (_source(table), _destination(table)),
    "proto": lambda table: (_same(table, table.protocol),),
    "role": lambda table: (
        Texts(np.where(table.placed.tx > 0, table.placed.role, table.frames.role), [role.value for role in ROLES]),
    ),
    "kind": lambda table: (Texts(table.frames.kind, table.frames.names),),
    "func": lambda table: (_optional(table.frames.function),),
    "register": lambda table: (_optional(table.frames.address),),
    "count": lambda table: (_optional(table.frames.count),),
    "ok": lambda table: (_always(table, table.good.astype(np.int8)),),
    "error": lambda table: (Texts(table.frames.error, [None, *table.frames.names[1:]]),),
    "noise": lambda table: (_always(table, np.zeros(len(table), np.int8)),),
    "found": lambda table: (Texts(table.frames.found, [found.value for found in FOUNDS]),),
    "damage": lambda table: (Texts(table.frames.damage, [None if one is None else one.value for one in DAMAGES]),),
    "len": lambda table: (_always(table, table.frames.length),),
    "marks": lambda table: (_always(table, np.zeros(len(table), np.int8)),),
    "tx": lambda table: (Numbers(table.placed.tx, table.placed.tx > 0),),
}
"""Columns of a filter that a table holds."""


def accepted(table: Table, name: str, accepts: Accepts) -> Masks:
    """Rows of which any value of that name is accepted; right for plain rows."""
    chosen: Masks = np.zeros(len(table), bool)
    for column in MASKED[name](table):
        chosen |= column.where(accepts)
    return chosen
