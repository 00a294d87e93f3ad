"""Rows as the command line shows them, many at a time: the same texts as `row_words.py` makes, from columns.

What a row says, apart from its number, its times and its transaction, depends on its octets, what was made of them and
whom its exchange says it is between. Rows that are equal in that share one specimen, which `row_words.py` is asked of.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from dissectors.columns import FOUNDS, NONE, ROLES, VERDICTS, Times
from dissectors.line import MS
from dissectors.manifest import Dissector
from sniff.bus import row_words as rows
from sniff.engine.column_join import SettledRows
from sniff.engine.engine import Row
from sniff.engine.session import Session
from sniff.engine.table import Table, rows_at
from sniff.engine.verdict_join import JudgedRow

MOST_SPECIMENS = 1 << 15

AT_ONCE = 1 << 14
"""Rows put into words at a time."""

Cell = Any
Render = Callable[[Cell], Cell]
"""How a text, a truth or None is written; numbers are as they are."""

Key = tuple[bytes, int, int]

_OF_ROW = ("no", "t", "start_ns", "end_ns", "tx", "verdict", "latency_ms", "frame.number")
_OF_TRANSACTION = {
    "tx.latency_ms": lambda closed: closed.latency,
    "tx.latency_low_ms": lambda closed: closed.least,
    "tx.latency_high_ms": lambda closed: closed.most,
}


class RowColumns:
    """Makes cells of the rows of one capture."""

    def __init__(self, dissector: Dissector, session: Session) -> None:
        self._dissector = dissector
        self._session = session
        self._cells: dict[Key, tuple[Cell, ...]] = {}

    def cells(
        self, settled: SettledRows, places: Sequence[int], names: Sequence[str], render: Render, instants: bool = False
    ) -> Iterator[tuple[Cell, ...]]:
        """One entry a row, one cell a name: a key of `rows.to_json` or a field of `rows.fields_of`. `names` and
        `render` must stay the same. `instants`: "t" as ns since the epoch."""
        for begin in range(0, len(places), AT_ONCE):
            yield from self._some_cells(settled, places[begin : begin + AT_ONCE], names, render, instants)

    # cells

    def _some_cells(
        self, settled: SettledRows, places: Sequence[int], names: Sequence[str], render: Render, instants: bool
    ) -> Iterator[tuple[Cell, ...]]:
        table, known = settled.table, self._cells
        columns = {name: _held(table, places, name, render) for name in names if name in _HELD}
        fixed = [name for name in names if name not in (*_OF_ROW, *_HELD) and not name.startswith("tx.")]
        if fixed:
            keys = list(_keys(settled, places))
            for key, row in _unknown(settled, places, keys, known):
                known[key] = tuple(map(render, self._values(JudgedRow(row, None), fixed)))
            nothing = (None,) * len(fixed)  # of odd rows, see below
            held = [known.get(key, nothing) for key in keys]
            columns.update(zip(fixed, map(list, zip(*held, strict=True)), strict=True))
        for name in names:
            if name not in columns:
                columns[name] = self._of_row(settled, places, name, render, instants)
        if table.odd:
            for at, place in enumerate(places):
                if place in table.odd:
                    item = settled.item(place)
                    for name, value in zip(names, self._values(item, names, instants), strict=True):
                        columns[name][at] = render(value)
        return zip(*(columns[name] for name in names), strict=True)

    def _values(self, item: JudgedRow, names: Sequence[str], instants: bool = False) -> list[Cell]:
        values: dict[str, Cell] = {}
        if any(name in rows.JSON_KEYS for name in names):
            values = rows.to_json(item, self._dissector, self._session)
            if instants and self._session.has_times:
                values["t"] = item.row.event.start
        if any(name not in rows.JSON_KEYS for name in names):
            values = {**values, **rows.fields_of(item, self._dissector)}
        return [values.get(name) for name in names]

    def _of_row(
        self, settled: SettledRows, places: Sequence[int], name: str, render: Render, instants: bool
    ) -> list[Cell]:
        """A column of what differs from row to row."""
        table, at = settled.table, np.asarray(places, np.int64)
        if name in ("no", "frame.number"):
            cells: list[Cell] = (at + table.first).tolist()
            return cells
        if name in ("t", "start_ns", "end_ns") and not self._session.has_times:
            return [render(None)] * len(places)
        if name == "t":
            starts = table.frames.start[at]
            return starts.tolist() if instants else [render(f"{one}Z") for one in _isos(starts)]
        if name in ("start_ns", "end_ns"):
            return _since((table.frames.start if name == "start_ns" else table.frames.end)[at], self._session)
        none = render(None)
        if name == "tx":
            return [tx or none for tx in table.placed.tx[at].tolist()]
        return self._of_transaction(settled, settled.which[at - settled.begin], name, render, none)

    def _of_transaction(self, settled: SettledRows, which: Times, name: str, render: Render, none: Cell) -> list[Cell]:
        closed, has = settled.closed, which >= 0
        if not has.any():
            return [none] * len(which)
        if name in ("verdict", "tx.verdict"):
            words = [*(render(verdict.value) for verdict in VERDICTS), none]
            return [words[code] for code in np.where(has, closed.verdict[which], len(VERDICTS)).tolist()]
        if name in ("tx.id", "tx.attempt"):
            values = (closed.id if name == "tx.id" else closed.attempt)[which]
            return [value if there else none for value, there in zip(values.tolist(), has.tolist(), strict=True)]
        if name != "latency_ms" and name not in _OF_TRANSACTION:
            return [none] * len(which)
        has = has & (closed.latency[which] != NONE)
        times = _OF_TRANSACTION[name if name != "latency_ms" else "tx.latency_ms"](closed)[which].tolist()
        pairs = zip(times, has.tolist(), strict=True)
        if name == "latency_ms":
            return [round(time / MS, 6) if there else none for time, there in pairs]
        return [time / MS if there else none for time, there in pairs]


def _held(table: Table, places: Sequence[int], name: str, render: Render) -> list[Cell]:
    """A column that the table holds; right for plain rows."""
    at = np.asarray(places, np.int64)
    if name == "hex":
        octets = table.octets.tobytes()
        begins, lengths = table.frames.offset[at].tolist(), table.frames.length[at].tolist()
        return [render(octets[one : one + size].hex()) for one, size in zip(begins, lengths, strict=True)]
    values, texts = _HELD[name](table)
    numbers = values[at].tolist()
    if texts is not None:
        words = [render(text) for text in texts]
        return [words[number] for number in numbers]
    none = render(None)
    return [none if number == NONE else number for number in numbers]


Held = tuple[np.ndarray[Any, np.dtype[Any]], Sequence[str | bool | None] | None]
"""Numbers of rows (`NONE` for none), or their places in some texts."""


def _placed(table: Table, name: str) -> np.ndarray[Any, np.dtype[Any]]:
    """What its exchange says of a row, else its header."""
    placed: np.ndarray[Any, np.dtype[Any]] = np.where(
        table.placed.tx > 0, getattr(table.placed, name), getattr(table.frames, name)
    )
    return placed


_HELD: dict[str, Callable[[Table], Held]] = {
    "proto": lambda table: (np.zeros(len(table), np.uint8), [table.protocol]),
    "src": lambda table: (_placed(table, "source"), None),
    "dst": lambda table: (_placed(table, "destination"), None),
    "role": lambda table: (_placed(table, "role"), [role.value for role in ROLES]),
    "kind": lambda table: (table.frames.kind, table.frames.names),
    "ok": lambda table: (table.good.astype(np.uint8), [False, True]),
    "error": lambda table: (table.frames.error, [None, *table.frames.names[1:]]),
    "found": lambda table: (table.frames.found, [found.value for found in FOUNDS]),
    "noise_before": lambda table: (np.zeros(len(table), np.uint8), None),
    "frame.len": lambda table: (table.frames.length, None),
    "hex": lambda table: (table.frames.length, None),
}
"""Columns of rows that a table holds."""


def _unknown(
    settled: SettledRows, places: Sequence[int], keys: Sequence[Key], known: dict[Key, Any]
) -> Iterator[tuple[Key, Row]]:
    """A specimen for each key that is not known yet; of odd rows none. Makes room first."""
    if len(known) > MOST_SPECIMENS:
        known.clear()
    odd = settled.table.odd
    absent = {key: place for place, key in zip(places, keys, strict=True) if key not in known and place not in odd}
    return zip(absent, rows_at(settled.table, list(absent.values())), strict=True)


def _keys(settled: SettledRows, places: Sequence[int]) -> Iterator[Key]:
    """What rows share that are the same but for number, times and transaction."""
    table, at = settled.table, np.asarray(places, np.int64)
    frames, placed = table.frames, table.placed
    begins = frames.offset[at]
    ends = begins + frames.length[at]
    first = int(begins[0]) if len(at) else 0
    held = table.octets[first : int(ends[-1]) if len(at) else 0].tobytes()
    octets = [held[begin:end] for begin, end in zip((begins - first).tolist(), (ends - first).tolist(), strict=True)]
    inside = placed.tx[at] > 0
    made = (frames.check[at].astype(np.int64) << 16 | frames.found[at].astype(np.int64) << 8) | frames.damage[at]
    ways = (placed.source[at].astype(np.int64) + 1) << 16 | (placed.destination[at].astype(np.int64) + 1)
    between = np.where(inside, ways << 8 | placed.role[at], -1)
    whole = made << 33 | (frames.expected[at].astype(np.int64) + 1)
    return zip(octets, whole.tolist(), between.tolist(), strict=True)


def _since(times: Times, session: Session) -> list[int]:
    """`rows.since_start` of many."""
    started = session.started
    return [time - started if time > started else 0 for time in times.tolist()]


def _isos(times: Times) -> list[str]:
    """`rows.iso` of many, without the Z."""
    texts: list[str] = np.datetime_as_string(times.view("M8[ns]")).tolist()
    return texts
