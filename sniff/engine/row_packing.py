"""Rows and transactions put into columns: what an engine gave object by object, as arrays."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dissectors.columns import (
    CHECKS,
    DAMAGES,
    FOUNDS,
    NONE,
    ROLES,
    VERDICTS,
    FrameColumns,
    PlacementColumns,
    TransactionColumns,
)
from dissectors.frame import Frame
from dissectors.tracker import Transaction
from sniff.engine.engine import Row

_CHECKS = {one: at for at, one in enumerate(CHECKS)}
_DAMAGES = {one: at for at, one in enumerate(DAMAGES)}
_FOUNDS = {one: at for at, one in enumerate(FOUNDS)}
_ROLES = {one: at for at, one in enumerate(ROLES)}
_VERDICTS = {one: at for at, one in enumerate(VERDICTS)}

ROW_FORMS = ("i8", "i4", "i8", "i8", "u1", "u1", "u1", "i4", "i2", "i2", "u1", "u2", "i2", "i4", "i4", "?", "u2")
PLACEMENT_FORMS = ("i8", "u1", "i2", "i2")
TRANSACTION_FORMS = ("i8", "i2", "u2", "i8", "i8", "u1", "i8", "i8", "i8", "i8", "i8", "i4", "i8", "u2")
"""dtypes of the columns, in the order of their classes in `dissectors.columns`."""

_FAR = 1 << 62  # ns
_MOST = (0x7FFF, 0x7FFF, 0x7FFF, 0x7FFF_FFFF, 0x7FFF_FFFF)  # source, destination, function, address, count


def is_plain(row: Row) -> bool:
    """Whether columns say all of it."""
    event = row.event
    if not isinstance(event, Frame) or row.header is None or row.searched is not None:
        return False
    if (_clip(event.start), _clip(event.end)) != (event.start, event.end):
        return False
    if event.marks or event.flags or event.repair or event.assembly or event.skipped:
        return False
    header = row.header  # a plug-in may give anything
    numbers = (header.source, header.destination, header.function, header.address, header.count)
    return header.error != "" and all(
        value is None or 0 <= value <= most for value, most in zip(numbers, _MOST, strict=True)
    )


def _clip(time: int) -> int:
    return min(max(time, -_FAR), _FAR)


def _none(value: int | None, most: int = 0x7FFF_FFFF_FFFF_FFFF) -> int:
    return NONE if value is None or not 0 <= value <= most else value


class Names:
    """Texts by number, from 1; 0 is none."""

    def __init__(self) -> None:
        self._numbers: dict[str, int] = {"": 0}

    def number(self, text: str | None) -> int:
        """Of a text; those beyond 65535 share one number, which no capture reaches that is not made to."""
        if text is None:
            return 0
        return self._numbers.setdefault(text, min(len(self._numbers), 0xFFFF))

    @property
    def texts(self) -> tuple[str, ...]:
        """By number."""
        return tuple(self._numbers)[: 1 << 16]


def frame_columns(rows: Sequence[Row]) -> FrameColumns:
    """Rows as columns; the offset counts from the first octet of the first."""
    names, at = Names(), 0
    values: list[tuple[int, ...]] = []
    for row in rows:
        event, header = row.event, row.header
        place = (at, len(event.octets), _clip(event.start), _clip(event.end))
        at += len(event.octets)
        if not isinstance(event, Frame) or header is None:
            values.append((*place, 0, 0, 0, NONE, NONE, NONE, 0, 0, NONE, NONE, NONE, 0, 0))
            continue
        found = (_CHECKS[event.check], _FOUNDS[event.found], _DAMAGES[event.damage], _none(event.expected, 0x7FFF_FFFF))
        ways = _none(header.source, 0x7FFF), _none(header.destination, 0x7FFF), _ROLES[header.role]
        what = _none(header.function, 0x7FFF), _none(header.address, 0x7FFF_FFFF), _none(header.count, 0x7FFF_FFFF)
        told = int(header.ok), names.number(header.error)
        values.append((*place, *found, *ways, names.number(header.kind), *what, *told))
    return FrameColumns(**_columns(FrameColumns, ROW_FORMS, values), names=names.texts)


def placement_columns(rows: Sequence[Row]) -> PlacementColumns:
    """Where rows belong."""
    values = [
        (0, 0, NONE, NONE)
        if (placed := row.placement) is None
        else (placed.tx, _ROLES[placed.role], _none(placed.source, 0x7FFF), _none(placed.destination, 0x7FFF))
        for row in rows
    ]
    return PlacementColumns(**_columns(PlacementColumns, PLACEMENT_FORMS, values))


def transaction_columns(closed: Sequence[Transaction]) -> TransactionColumns:
    """Transactions as columns."""
    names = Names()
    values: list[tuple[int, ...]] = []
    for one in closed:
        took = one.latency
        latency = (NONE, NONE, NONE) if took is None else (took.nominal, took.low, took.high)
        values.append(
            (
                one.id,
                _none(one.station, 0x7FFF),
                names.number(one.kind),
                _none(one.request),
                _none(one.response),
                _VERDICTS[one.verdict],
                _clip(one.start),
                _clip(one.end),
                *map(_clip, latency),
                one.attempt,
                _none(one.of),
                names.number(one.error),
            )
        )
    return TransactionColumns(**_columns(TransactionColumns, TRANSACTION_FORMS, values), names=names.texts)


def _columns(kind: type, forms: Sequence[str], values: Sequence[tuple[int, ...]]) -> dict[str, np.ndarray]:
    names = [name for name in kind.__dataclass_fields__ if name != "names"]  # type: ignore[attr-defined]
    parts = zip(*values, strict=True) if values else ([] for _ in forms)
    return {name: np.array(list(part), form) for name, part, form in zip(names, parts, forms, strict=True)}
