"""Octets looked for in whole tables. Pure."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from dissectors.columns import Masks
from sniff.filter.syntax import Span

if TYPE_CHECKING:
    from sniff.engine.table import Table
    from sniff.filter.columns import Closed


def holding(wanted: bytes) -> Callable[[Table, Closed | None], tuple[Masks, Masks] | None]:
    """Rows that hold some octets."""

    def columns(table: Table, closed: Closed | None) -> tuple[Masks, Masks] | None:
        octets: Any = getattr(table, "octets", None)
        if octets is None:
            return None
        begins = table.frames.offset
        ends = begins + table.frames.length
        places = _places(octets, wanted)
        chosen: Masks = np.searchsorted(places, ends - len(wanted), "right") > np.searchsorted(places, begins, "left")
        chosen &= table.frames.length >= len(wanted)
        return chosen, chosen

    return columns


def slice_is(span: Span, wanted: bytes, other: bool) -> Callable[[Table, Closed | None], tuple[Masks, Masks] | None]:
    """Rows that have these octets at a place; `other`: that have different ones there."""

    def columns(table: Table, closed: Closed | None) -> tuple[Masks, Masks] | None:
        octets: Any = getattr(table, "octets", None)
        if octets is None:
            return None
        lengths = table.frames.length.astype(np.int64)
        first = lengths + span.first if span.first < 0 else np.full(len(lengths), span.first)
        last = lengths if span.last is None else lengths + span.last if span.last < 0 else span.last
        there = (first >= 0) & (first < lengths) & (last <= lengths) & (last > first)
        same = there & (last - first == len(wanted))
        begins = table.frames.offset + first
        for at, octet in enumerate(wanted):
            places = np.flatnonzero(same)
            same[places] = octets[begins[places] + at] == octet
        chosen: Masks = there & ~same if other else same
        return chosen, chosen

    return columns


def _places(octets: Any, wanted: bytes) -> Any:
    """Where they stand, ascending."""
    count = len(octets) - len(wanted) + 1
    if count <= 0:
        return np.zeros(0, np.int64)
    places = np.flatnonzero(octets[:count] == wanted[0])
    for at in range(1, len(wanted)):
        if not len(places):
            break
        places = places[octets[places + at] == wanted[at]]
    return places
