"""The /frames topic: tables of the engine, packed, so that what was found once need not be found again. Pure.

Derived, never evidence: only the program that wrote them takes them for what it would find (`stored_tables`), and only
with the octets that they were made of. A message holds one table without its octets, which are in /raw: those that
follow the octets of the table before.
"""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from dissectors.columns import (
    CHECKS,
    DAMAGES,
    FOUNDS,
    NONE,
    ROLES,
    VERDICTS,
    FrameColumns,
    Octets,
    PlacementColumns,
    TransactionColumns,
)
from sniff.engine.engine import Row
from sniff.engine.packed_table import PackedColumn, PackedParts
from sniff.engine.row_packing import PLACEMENT_FORMS, ROW_FORMS, TRANSACTION_FORMS
from sniff.engine.table import Table
from sniff.recording import odd_rows
from sniff.recording.topics import SchemaText

VERSION = 3

MOST_ROWS = 1 << 17
"""Rows of a message that is read, and transactions; more are not written."""

FAR = 1 << 62
"""What no number of a message exceeds: ns, octets, rows."""

MORE_CLOSED = 1024
"""Exchanges that close in a table beyond `MOST_OPEN` to a row: those that were open before."""

_SIZE = struct.Struct("<I")

FORMS: dict[str, np.dtype[Any]] = {
    **{f"frames.{one.name}": np.dtype(form) for one, form in zip(fields(FrameColumns)[:-1], ROW_FORMS, strict=True)},
    "slack": np.dtype("i8"),
    "is_frame": np.dtype("?"),
    **{
        f"placed.{one.name}": np.dtype(form)
        for one, form in zip(fields(PlacementColumns), PLACEMENT_FORMS, strict=True)
    },
    **{
        f"closed.{one.name}": np.dtype(form)
        for one, form in zip(fields(TransactionColumns)[:-1], TRANSACTION_FORMS, strict=True)
    },
    "closed_by": np.dtype("i8"),
}
"""The columns of a table, and what their values are."""

FOLLOWING = frozenset(("frames.offset", "placed.role", "placed.source", "placed.destination"))
"""Columns that are not there when they follow from others; the first never is."""

MOST_OPEN = 4
"""Exchanges to a row, at most: most rows open one or none. A table that has more is not written (`FrameLog`)."""

_OPTIONAL = ("expected", "source", "destination", "function", "address", "count")

_CODES = {
    "frames.check": len(CHECKS),
    "frames.found": len(FOUNDS),
    "frames.damage": len(DAMAGES),
    "frames.role": len(ROLES),
    "placed.role": len(ROLES),
    "closed.verdict": len(VERDICTS),
}


LAYOUT = """\
sniff485 /frames, version {version}. Derived from /raw; used only by the program that wrote it, and with the metadata
record "frames" at the end. One message is a table of rows and of the exchanges that closed with them. Little-endian,
no padding: u32 octets of a description, the description (JSON), the columns.

The description: first (number of the first row), rows, closed (exchanges), octets (that the rows hold, which follow
those of the message before in /raw), check (CRC-32 of them), events (events on /line before the table), char (ns),
names and closed_names (texts, by number), odd ([place, row] of each that columns do not say) and columns: by name
[base, width, step, none, missing]. A column of width 0 is base everywhere; of width 1, 2, 4 or 8 its numbers, unsigned,
stand among the columns: base + number each, or, with a step, base first and then step + number above the one before.
What comes out as missing is none.

Columns of rows: {rows}.
Columns of exchanges: {closed}.
frames.start stands as what end - char * length is above it, closed.start as what the end is above it, closed.least and
closed.most as what they are above the latency. frames.offset follows from the lengths; other columns of placed that are
absent are as in frames where tx is not 0. Times are ns since the Unix epoch. closed_by is the place of the row that
closed it, -1 is none.

An odd row:
{odd}"""


def _layout() -> str:
    rows = ", ".join(name for name in FORMS if not name.startswith("closed"))
    closed = ", ".join(name for name in FORMS if name.startswith("closed"))
    return LAYOUT.format(version=VERSION, rows=rows, closed=closed, odd=odd_rows.LAYOUT)


SCHEMA = SchemaText("sniff485.Frames", "x-sniff485-layout", "x-sniff485-frames", _layout())


def encode(table: Table, events: int) -> bytes:
    """A message; `events`: on /line before the table. Raises ValueError for a table that no file keeps."""
    if not table.has_true_times or max(len(table), len(table.transactions)) > MOST_ROWS:
        raise ValueError("a table that is not kept")
    parts = PackedParts.of(_alone(table))
    if "frames.offset" in parts.columns:
        raise ValueError("rows that do not follow one another")
    described = {
        "first": parts.first,
        "rows": parts.count,
        "closed": parts.closed,
        "octets": len(parts.octets),
        "check": zlib.crc32(parts.octets.tobytes()),
        "events": events,
        "char": parts.char,
        "names": parts.names,
        "closed_names": parts.closed_names,
        "odd": [[place, odd_rows.values_of(row)] for place, row in sorted(parts.odd.items())],
        "columns": {name: _described(column) for name, column in parts.columns.items()},
    }
    head = json.dumps(described, separators=(",", ":")).encode()
    columns = [column.narrow for column in parts.columns.values() if column.narrow is not None]
    return b"".join((_SIZE.pack(len(head)), head, *(np.ascontiguousarray(one).tobytes() for one in columns)))


def octets_of(table: Table) -> Octets:
    """Those of its rows alone, which follow one another."""
    frames = table.frames
    if not len(frames):
        return table.octets[:0]
    return table.octets[int(frames.offset[0]) : int(frames.offset[-1] + frames.length[-1])]


def _alone(table: Table) -> Table:
    """The table with no octets but its own."""
    frames = table.frames
    begin = int(frames.offset[0]) if len(frames) else 0
    return replace(table, octets=octets_of(table), frames=replace(frames, offset=frames.offset - begin))


def _described(column: PackedColumn) -> list[int | None]:
    width = 0 if column.narrow is None else column.narrow.dtype.itemsize
    return [column.base, width, column.step, column.none, column.missing]


@dataclass(frozen=True, slots=True)
class StoredTable:
    """A message that was read. `octets`: how many its rows hold; `events`: on /line before it."""

    first: int
    rows: int
    closed: int
    octets: int
    check: int
    events: int
    _described: Mapping[str, Any]
    _columns: Mapping[str, PackedColumn]

    @classmethod
    def decode(cls, data: bytes) -> StoredTable | None:
        """None when it contradicts itself."""
        try:
            (size,) = _SIZE.unpack_from(data)
            described = json.loads(data[_SIZE.size : _SIZE.size + size])
            numbers = [described[name] for name in ("first", "rows", "closed", "octets", "check", "events")]
            if not all(type(number) is int and 0 <= number < FAR for number in numbers):
                return None
            first, rows, closed, octets, check, events = numbers
            if (
                max(rows, closed) > MOST_ROWS
                or closed > MOST_OPEN * rows + MORE_CLOSED
                or type(described["char"]) is not int
                or abs(described["char"]) > 2 * FAR
            ):
                return None
            columns = _columns(described["columns"], rows, closed, data, _SIZE.size + size)
        except (ValueError, KeyError, TypeError, IndexError, struct.error, RecursionError):
            return None
        return cls(first, rows, closed, octets, check, events, described, columns)

    def table(self, protocol: str, octets: Octets) -> Table | None:
        """The table, of these octets; None where it does not fit them, or holds what no engine gives."""
        if len(octets) != self.octets or zlib.crc32(octets.tobytes()) != self.check:
            return None
        told = self._described
        try:
            names, closed_names = _texts(told["names"]), _texts(told["closed_names"])
            columns = self._columns
            shape = self.rows, self.closed, told["char"]
            odd: dict[int, Row] = {}
            table = PackedParts(protocol, self.first, *shape, octets, names, closed_names, columns, odd).table()
            places = [place for place, _ in told["odd"]]
            if not all(type(place) is int and 0 <= place < self.rows for place in places):
                return None
            if not _is_sound(table, places):
                return None
            for place, values in told["odd"]:
                begin = int(table.frames.offset[place])
                own = octets[begin : begin + int(table.frames.length[place])].tobytes()
                odd[place] = row = odd_rows.row_of(values, self.first + place, protocol, own)
                frames, event = table.frames, row.event
                if (row.header is not None) != table.is_frame[place]:
                    return None
                if (event.start, event.end) != (frames.start[place], frames.end[place]):
                    return None
        except (ValueError, KeyError, TypeError, OverflowError, IndexError):
            return None
        return table


def _columns(described: Any, rows: int, closed: int, data: bytes, at: int) -> dict[str, PackedColumn]:
    """The columns of a message. Raises ValueError, TypeError."""
    columns: dict[str, PackedColumn] = {}
    if not isinstance(described, dict):
        raise ValueError("columns")
    for name, (base, width, step, none, missing) in described.items():
        count, form = closed if name.startswith("closed") else rows, FORMS[name]
        for number in (base, step, none, missing):
            if number is not None and (type(number) is not int or abs(number) > 2 * FAR):
                raise ValueError(name)
        narrow: npt.NDArray[Any] | None = None
        if width:
            there = count if step is None else count - 1
            if there < 0:
                raise ValueError(name)
            narrow = np.frombuffer(data, _WIDTHS[width], there, at)
            at += narrow.nbytes
        columns[name] = PackedColumn(form, count, base, narrow, step, none, missing)
    if at != len(data) or not set(FORMS) - FOLLOWING <= set(columns):
        raise ValueError("columns")
    return columns


_WIDTHS = {1: "<u1", 2: "<u2", 4: "<u4", 8: "<u8"}


def _texts(values: Any) -> tuple[str, ...]:
    texts = tuple(values)
    if not texts or not all(isinstance(text, str) for text in texts):
        raise ValueError("texts")
    return texts


def _is_sound(table: Table, odd: Sequence[int]) -> bool:
    """Whether no number leads whoever takes it beyond what is there, and rows without octets or a header are told of
    each by itself: a few octets of a file make no million rows."""
    frames, placed, closed, last = table.frames, table.placed, table.transactions, table.first + len(table)
    bounds: list[tuple[npt.NDArray[Any], int, int]] = [
        (frames.length, 0, len(table.octets)),
        (frames.kind, 0, len(frames.names) - 1),
        (frames.error, 0, len(frames.names) - 1),
        (closed.kind, 0, len(closed.names) - 1),
        (closed.error, 0, len(closed.names) - 1),
        *((values, -FAR, FAR) for values in (frames.start, frames.end, closed.start, closed.end)),
        *((values, -FAR, FAR) for values in (table.slack, closed.latency, closed.least, closed.most)),
        *((getattr(frames, name), NONE, FAR) for name in _OPTIONAL),
        *((values, NONE, FAR) for values in (placed.source, placed.destination, closed.station)),
        (placed.tx, 0, MOST_OPEN * last),
        (closed.id, 0, MOST_OPEN * last),
        (closed.of, NONE, MOST_OPEN * last),
        (closed.attempt, 0, FAR),
        *((values, NONE, last) for values in (closed.request, closed.response)),
        (table.closed_by, NONE, len(table) - 1),
    ]
    for name, count in _CODES.items():
        kind, column = name.split(".")
        of = {"frames": frames, "placed": placed, "closed": closed}[kind]
        bounds.append((getattr(of, column), 0, count - 1))
    if any(len(values) and (int(values.min()) < low or int(values.max()) > high) for values, low, high in bounds):
        return False
    plain = table.is_frame & (frames.length > 0)
    plain[odd] = True
    return bool(plain.all()) and int(frames.length.sum()) == len(table.octets)
