"""The /frames topic: what peek and the tracker found, as columns, for programs that do not dissect.

Derived, never evidence: `McapCapture.frames` gives only what the very same version made (layout and program). Commands
compute everything from /raw. A message holds a string table and three tables, `EVENTS`, `MARKS` and `TRANSACTIONS`; the
layout is written into the schema record from these tables, so that the two cannot differ.

An event names its octets by their place in the stream of all octets of the recording (all parts), which is the same
thing in /raw and here because a framer loses none.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any

from dissectors.frame import Check, Damage, FoundBy, Frame, Header, LineError, Mark, Noise, Place, Reason, Role
from dissectors.line import LineSettings
from dissectors.tracker import Interval, Placement, Transaction, Verdict
from sniff.engine.engine import Output, Row
from sniff.recording.topics import SchemaText
from sniff.version import __version__

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

METADATA = {"program": __version__}
"""Metadata of the channel: whose dissectors these are."""


@dataclass(frozen=True, slots=True)
class ColumnLayout:
    """`form`: numpy's, little-endian. `kind`: an enum (its members by place, from 1; 0 is None), "text" (place in
    the string table, from 1; 0 is None), "number", or "optional": a number whose smallest value is None."""

    name: str
    form: str
    kind: type[Enum] | str = "number"

    @property
    def least(self) -> int:
        bits = 8 * int(self.form[2:])
        return -(1 << (bits - 1)) if self.form[1] == "i" else 0

    @property
    def most(self) -> int:
        bits = 8 * int(self.form[2:])
        return (1 << (bits - 1)) - 1 if self.form[1] == "i" else (1 << bits) - 1


EVENTS = (
    ColumnLayout("no", "<u8"),
    ColumnLayout("offset", "<u8"),  # of its first octet in the stream of all octets
    ColumnLayout("length", "<u4"),
    ColumnLayout("start", "<i8"),
    ColumnLayout("end", "<i8"),
    ColumnLayout("slack", "<i8"),
    ColumnLayout("protocol", "<u2", "text"),  # None for noise
    ColumnLayout("check", "<u1", Check),
    ColumnLayout("found", "<u1", FoundBy),
    ColumnLayout("damage", "<u1", Damage),
    ColumnLayout("expected", "<i4", "optional"),
    ColumnLayout("skipped", "<u4"),
    ColumnLayout("flags", "<u2", "text"),  # with spaces between
    ColumnLayout("place", "<u1", Place),  # None for frames
    ColumnLayout("reason", "<u1", Reason),
    ColumnLayout("source", "<i4", "optional"),  # the header's, from here
    ColumnLayout("destination", "<i4", "optional"),
    ColumnLayout("role", "<u1", Role),
    ColumnLayout("kind", "<u2", "text"),
    ColumnLayout("function", "<i4", "optional"),
    ColumnLayout("address", "<i8", "optional"),
    ColumnLayout("count", "<i8", "optional"),
    ColumnLayout("ok", "<u1"),
    ColumnLayout("error", "<u2", "text"),
    ColumnLayout("tx", "<u8"),  # the placement's, from here; 0 without one
    ColumnLayout("placed_role", "<u1", Role),
    ColumnLayout("placed_source", "<i4", "optional"),
    ColumnLayout("placed_destination", "<i4", "optional"),
    ColumnLayout("searched", "<u2", "text"),  # settings with which a search heard it; None for everything else
)
MARKS = (
    ColumnLayout("event", "<u4"),  # place in EVENTS
    ColumnLayout("offset", "<u4"),  # from the event's first octet
    ColumnLayout("error", "<u1"),  # LineError's bits
)
TRANSACTIONS = (
    ColumnLayout("id", "<u8"),
    ColumnLayout("station", "<i4", "optional"),
    ColumnLayout("kind", "<u2", "text"),
    ColumnLayout("request", "<i8", "optional"),
    ColumnLayout("response", "<i8", "optional"),
    ColumnLayout("verdict", "<u1", Verdict),
    ColumnLayout("start", "<i8"),
    ColumnLayout("end", "<i8"),
    ColumnLayout("latency", "<i8", "optional"),
    ColumnLayout("latency_low", "<i8", "optional"),
    ColumnLayout("latency_high", "<i8", "optional"),
    ColumnLayout("attempt", "<u4"),
    ColumnLayout("of", "<i8", "optional"),
    ColumnLayout("error", "<u2", "text"),
)
TABLES = {"events": EVENTS, "marks": MARKS, "transactions": TRANSACTIONS}

_HEAD = struct.Struct("<IIII")  # octets of the string table; rows of each table
_TEXT_END = b"\0"


def _layout() -> str:
    lines = [
        "sniff485 /frames, version 2. Derived from /raw; used only by the version of the program that wrote it.",
        "Little-endian, no padding: u32 octets of the string table, u32 rows of each of the three tables; the string",
        "table (UTF-8, each string ends with NUL); the tables, one column after the other.",
        "text: place in the string table, from 1, 0 is none. Enums: place in the list, from 1, 0 is none.",
        "optional: a number, its smallest value is none. Times in ns since the Unix epoch.",
    ]
    for table, columns in TABLES.items():
        lines.append(f"\n{table}:")
        for column in columns:
            kind = column.kind
            words = kind if isinstance(kind, str) else " | ".join(str(member.value) for member in kind)
            lines.append(f"  {column.form[1:]:<3} {column.name}: {words}")
    return "\n".join(lines) + "\n"


SCHEMA = SchemaText("sniff485.Frames", "x-sniff485-layout", "x-sniff485-frames", _layout())


# -- writing ---------------------------------------------------------------------------------------------------


class FrameLog:
    """Collects what an engine gives into messages. `offset`: octets of the recording before the first event."""

    def __init__(self, offset: int = 0) -> None:
        self._offset = offset
        self._rows: list[Row] = []
        self._transactions: list[Transaction] = []
        self._first_offset = offset

    def add(self, output: Output) -> None:
        """Take what the engine gave, in order."""
        self._rows.extend(output.rows)
        self._transactions.extend(output.transactions)
        self._offset += sum(len(row.event.octets) for row in output.rows)

    def take(self) -> tuple[int, int, bytes] | None:
        """log time, publish time and data of a message with all that was added since; None when that is nothing."""
        if not self._rows and not self._transactions:
            return None
        things = [row.event for row in self._rows] or self._transactions
        data = encode(self._rows, self._transactions, self._first_offset)
        times = max(thing.end for thing in things), min(thing.start for thing in things)
        self._rows, self._transactions, self._first_offset = [], [], self._offset
        return *times, data


def encode(rows: Sequence[Row], transactions: Sequence[Transaction], offset: int) -> bytes:
    """A message; `offset`: of the first row's octets in the stream of all octets. Rows follow each other."""
    strings: dict[str, int] = {}
    events = []
    for row in rows:
        events.append(event_values(row, offset))
        offset += len(row.event.octets)
    tables: tuple[tuple[tuple[ColumnLayout, ...], list[tuple[Any, ...]]], ...] = (
        (EVENTS, events),
        (MARKS, [(at, mark.offset, mark.error.value) for at, row in enumerate(rows) for mark in row.event.marks]),
        (TRANSACTIONS, [_transaction_values(transaction) for transaction in transactions]),
    )
    return message_of([(columns, _pack(columns, values, strings)) for columns, values in tables], strings)


def message_of(
    tables: Iterable[tuple[tuple[ColumnLayout, ...], Sequence[npt.NDArray[Any]]]], strings: Mapping[str, int]
) -> bytes:
    """A message of the three tables, each with its columns packed, and the texts that they refer to, by number."""
    packed = [values for _, values in tables]
    texts = b"".join(text.encode("utf-8", "replace").replace(_TEXT_END, b"?") + _TEXT_END for text in strings)
    head = _HEAD.pack(len(texts), *(len(values[0]) for values in packed))
    return b"".join((head, texts, *(column.tobytes() for values in packed for column in values)))


def event_values(row: Row, offset: int) -> tuple[Any, ...]:
    """A row in the order of `EVENTS`."""
    event, header, placement = row.event, row.header, row.placement
    values: tuple[Any, ...] = (row.no, offset, len(event.octets), event.start, event.end)
    if isinstance(event, Frame):
        flags = " ".join(event.flags) or None
        values += (event.slack, event.protocol, event.check, event.found, event.damage)
        values += (event.expected, event.skipped, flags, None, None)
    else:
        values += (0, None, None, None, None, None, 0, None, event.place, event.reason)
    if header is None:
        values += (None, None, None, None, None, None, None, 0, None)
    else:
        values += (header.source, header.destination, header.role, header.kind, header.function)
        values += (header.address, header.count, int(header.ok), header.error)
    searched = None if row.searched is None else str(row.searched)
    if placement is None:
        return (*values, 0, None, None, None, searched)
    return (*values, placement.tx, placement.role, placement.source, placement.destination, searched)


def _transaction_values(one: Transaction) -> tuple[Any, ...]:
    latency = (None, None, None) if one.latency is None else (one.latency.nominal, one.latency.low, one.latency.high)
    values = (one.id, one.station, one.kind, one.request, one.response, one.verdict, one.start, one.end)
    return (*values, *latency, one.attempt, one.of, one.error)


def _pack(
    columns: Sequence[ColumnLayout], rows: Sequence[tuple[Any, ...]], strings: dict[str, int]
) -> list[npt.NDArray[Any]]:
    import numpy as np

    parts = zip(*rows, strict=True) if rows else ((),) * len(columns)
    return [
        np.array([number_of(column, value, strings) for value in values], column.form)
        for column, values in zip(columns, parts, strict=True)
    ]


def number_of(column: ColumnLayout, value: Any, strings: dict[str, int]) -> int:
    """A value as it lies in a column; a new text gets a number."""
    if value is None:
        return column.least
    if column.kind == "text":
        return min(strings.setdefault(str(value), len(strings) + 1), column.most)
    if isinstance(value, Enum):
        return 1 + _PLACES[type(value)][value]
    return min(max(int(value), column.least), column.most)


_PLACES: dict[type[Enum], dict[Enum, int]] = {
    kind: {member: place for place, member in enumerate(kind)}
    for kind in (Check, FoundBy, Damage, Place, Reason, Role, Verdict)
}


# -- reading ---------------------------------------------------------------------------------------------------


class FrameBatch:
    """A decoded message: `events`, `marks`, `transactions` are columns by name, `strings` what they refer to."""

    def __init__(self, strings: list[str], tables: dict[str, dict[str, npt.NDArray[np.generic]]]) -> None:
        self.strings = strings
        self.events = tables["events"]
        self.marks = tables["marks"]
        self.transactions = tables["transactions"]

    @classmethod
    def decode(cls, data: bytes) -> FrameBatch | None:
        """None when the sizes or places in it contradict each other."""
        import numpy as np

        if len(data) < _HEAD.size:
            return None
        text_size, *counts = _HEAD.unpack_from(data)
        sizes = [
            count * sum(int(column.form[2:]) for column in columns)
            for count, columns in zip(counts, TABLES.values(), strict=True)
        ]
        if _HEAD.size + text_size + sum(sizes) != len(data):
            return None
        at = _HEAD.size + text_size
        strings = data[_HEAD.size : at].decode("utf-8", "replace").split("\0")[:-1]
        tables: dict[str, dict[str, npt.NDArray[np.generic]]] = {}
        for (name, columns), count in zip(TABLES.items(), counts, strict=True):
            tables[name] = {}
            for column in columns:
                values = np.frombuffer(data, column.form, count, at)
                at += values.nbytes
                if count and int(values.max()) > _highest(column, len(strings)):
                    return None
                tables[name][column.name] = values
        if counts[1] and int(tables["marks"]["event"].max()) >= counts[0]:
            return None
        return cls(strings, tables)

    def rows(self, octets: bytes, offset: int = 0) -> Iterator[Row]:
        """The engine's rows again; `octets`: of the recording from `offset` on. An event that lies outside is left
        out."""
        marks = self._marks()
        for at, values in enumerate(self._values(EVENTS, self.events)):
            begin = values["offset"] - offset
            if begin >= 0 and begin + values["length"] <= len(octets):
                yield _row(values, octets[begin : begin + values["length"]], tuple(marks.get(at, ())))

    def transaction_values(self) -> Iterator[Transaction]:
        """The tracker's transactions again."""
        for values in self._values(TRANSACTIONS, self.transactions):
            latency = values.pop("latency")
            low, high = values.pop("latency_low"), values.pop("latency_high")
            values["kind"] = values["kind"] or ""
            values["verdict"] = values["verdict"] or Verdict.OPEN
            interval = None if None in (latency, low, high) else Interval(latency, low, high)
            yield Transaction(**values, latency=interval)

    def _marks(self) -> dict[int, list[Mark]]:
        marks: dict[int, list[Mark]] = {}
        for values in self._values(MARKS, self.marks):
            marks.setdefault(values["event"], []).append(Mark(values["offset"], LineError(values["error"] & 15)))
        return marks

    def _values(
        self, columns: Sequence[ColumnLayout], table: dict[str, npt.NDArray[np.generic]]
    ) -> Iterator[dict[str, Any]]:
        readers = [self._column(column, table[column.name].tolist()) for column in columns]
        names = [column.name for column in columns]
        for values in zip(*readers, strict=True):
            yield dict(zip(names, values, strict=True))

    def _column(self, column: ColumnLayout, numbers: list[int]) -> list[Any]:
        if column.kind == "text":
            texts = [None, *self.strings]
            return [texts[number] for number in numbers]
        if not isinstance(column.kind, str):
            members = [None, *column.kind]
            return [members[number] for number in numbers]
        if column.kind == "optional":
            return [None if number == column.least else number for number in numbers]
        return list(numbers)


def _highest(column: ColumnLayout, strings: int) -> int:
    if column.kind == "text":
        return strings
    return column.most if isinstance(column.kind, str) else len(column.kind)


def _settings(token: str | None) -> LineSettings | None:
    try:
        return None if token is None else LineSettings.parse(token)
    except ValueError:
        return None


def _row(values: dict[str, Any], octets: bytes, marks: tuple[Mark, ...]) -> Row:
    no, start, end = values["no"], values["start"], values["end"]
    if values["protocol"] is None:
        place, reason = values["place"] or Place.BETWEEN, values["reason"] or Reason.NO_FRAME
        return Row(no, Noise(octets, start, end, place, reason, marks), searched=_settings(values["searched"]))
    frame = Frame(
        values["protocol"],
        octets,
        start,
        end,
        values["check"] or Check.ABSENT,
        values["found"] or FoundBy.LENGTH,
        values["damage"],
        values["expected"],
        values["skipped"],
        values["slack"],
        marks,
        tuple((values["flags"] or "").split()),
    )
    header = Header(
        frame.protocol,
        values["source"],
        values["destination"],
        values["role"] or Role.UNKNOWN,
        values["kind"] or "",
        values["function"],
        values["address"],
        values["count"],
        bool(values["ok"]),
        values["error"],
    )
    if not values["tx"]:
        return Row(no, frame, header)
    role = values["placed_role"] or Role.UNKNOWN
    placement = Placement(no, values["tx"], role, values["placed_source"], values["placed_destination"])
    return Row(no, frame, header, placement)
