"""Tables put together as columns with a name and a type, for data frames: no object a row.

Frames carry the names of `show --json`, as far as they mean the same; times count from the epoch.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np
import numpy.typing as npt

from dissectors.columns import DAMAGES, FOUNDS, NONE, ROLES, VERDICTS, Masks, Times
from dissectors.frame import Frame
from dissectors.line import MS
from sniff.engine.engine import Row
from sniff.engine.table import Table

Values = npt.NDArray[Any]
SEARCHING, NOISE = "searching", "noise"
NOTHING: Mapping[int, Sequence[Row]] = {}


class ColumnForm(Enum):
    """What a column holds. `TEXT`: few different texts, by number. `TIME`: ns since the epoch."""

    INTEGER = "integer"
    NUMBER = "number"
    TRUTH = "truth"
    TEXT = "text"
    TIME = "time"


@dataclass(frozen=True, slots=True)
class Column:
    """Values of one column, one a row. `missing`: bool[n], where there is none; None where all are there.

    `texts`: of a TEXT column, whose values are places in it.
    """

    form: ColumnForm
    values: Values
    missing: Masks | None = None
    texts: tuple[str, ...] = ()


Columns = Mapping[str, Column]


@dataclass
class _Growing:
    """A column that takes one part after the other."""

    form: ColumnForm
    parts: list[Values] = field(default_factory=list)
    holes: list[Masks] = field(default_factory=list)
    numbers: dict[str, int] = field(default_factory=dict)

    def text_numbers(self, texts: Iterable[str]) -> Values:
        """The numbers of texts, new ones for new texts."""
        return np.array([self.numbers.setdefault(text, len(self.numbers)) for text in texts], np.int32)

    def column(self) -> Column:
        """All that it took."""
        values = np.concatenate(self.parts) if self.parts else np.zeros(0, _NUMPY[self.form])
        missing: Masks = np.concatenate(self.holes) if self.holes else np.zeros(0, bool)
        return Column(self.form, values, missing if missing.any() else None, tuple(self.numbers))


_NUMPY = {
    ColumnForm.INTEGER: np.int64,
    ColumnForm.NUMBER: np.float64,
    ColumnForm.TRUTH: np.bool_,
    ColumnForm.TEXT: np.int32,
    ColumnForm.TIME: np.int64,
}

FRAMES = {
    "no": ColumnForm.INTEGER,
    "t": ColumnForm.TIME,
    "start_ns": ColumnForm.INTEGER,
    "end_ns": ColumnForm.INTEGER,
    "proto": ColumnForm.TEXT,
    "src": ColumnForm.INTEGER,
    "dst": ColumnForm.INTEGER,
    "role": ColumnForm.TEXT,
    "kind": ColumnForm.TEXT,
    "func": ColumnForm.INTEGER,
    "register": ColumnForm.INTEGER,
    "count": ColumnForm.INTEGER,
    "ok": ColumnForm.TRUTH,
    "error": ColumnForm.TEXT,
    "found": ColumnForm.TEXT,
    "damage": ColumnForm.TEXT,
    "noise_before": ColumnForm.INTEGER,
    "len": ColumnForm.INTEGER,
    "tx": ColumnForm.INTEGER,
    "verdict": ColumnForm.TEXT,
    "latency_ms": ColumnForm.NUMBER,
}
"""Columns of frames, in their order. `t` and `start_ns` are the same instant; `noise_before`, `len`: octets."""

TRANSACTIONS = {
    "tx": ColumnForm.INTEGER,
    "station": ColumnForm.INTEGER,
    "kind": ColumnForm.TEXT,
    "request": ColumnForm.INTEGER,
    "response": ColumnForm.INTEGER,
    "verdict": ColumnForm.TEXT,
    "t": ColumnForm.TIME,
    "start_ns": ColumnForm.INTEGER,
    "end_ns": ColumnForm.INTEGER,
    "latency_ms": ColumnForm.NUMBER,
    "latency_low_ms": ColumnForm.NUMBER,
    "latency_high_ms": ColumnForm.NUMBER,
    "attempt": ColumnForm.INTEGER,
    "of": ColumnForm.INTEGER,
    "error": ColumnForm.TEXT,
}
"""Columns of transactions, in their order. `request`, `response`: numbers of frames; `of`: another transaction."""


class TableColumns:
    """Takes the tables of one capture, in their order; gives their columns. `octets`: keep those of the rows too."""

    def __init__(self, octets: bool = False) -> None:
        self._frames = {name: _Growing(form) for name, form in FRAMES.items()}
        self._transactions = {name: _Growing(form) for name, form in TRANSACTIONS.items()}
        self._octets: list[bytes] | None = [] if octets else None

    def add(self, table: Table, replaced: Mapping[int, Sequence[Row]] = NOTHING) -> None:
        """Take what follows. `replaced`: what stands in place of some of its rows, by place in the table."""
        self._add_frames(table)
        self._add_transactions(table)
        if self._octets is not None:
            held, ends = table.octets.tobytes(), table.frames.offset + table.frames.length
            spans = zip(table.frames.offset.tolist(), ends.tolist(), strict=True)
            found = [held[begin:end] for begin, end in spans]
            for place, rows in sorted(replaced.items(), reverse=True):
                found[place : place + 1] = [row.event.octets for row in rows]
            self._octets.extend(found)
        if replaced:
            self._replace(len(table), replaced)

    def frames(self) -> Columns:
        """A row for every frame, for noise and for what a search heard, with the verdicts of the transactions."""
        verdicts = self._transactions
        for name in ("verdict", "latency_ms"):
            if not self._frames[name].parts:
                self._join(name, verdicts["tx"].column().values, verdicts[name].column())
        return {name: one.column() for name, one in self._frames.items()}

    def octets(self) -> Sequence[bytes]:
        """Of every row; empty unless they were to be kept."""
        return self._octets or ()

    def transactions(self) -> Columns:
        """A row for every transaction that closed, in the order of closing."""
        return {name: one.column() for name, one in self._transactions.items()}

    def _add_frames(self, table: Table) -> None:
        frames, placed, count = table.frames, table.placed, len(table)
        inside = placed.tx > 0
        codes = {
            "role": (np.where(inside, placed.role, frames.role), [one.value for one in ROLES], ~table.is_frame),
            "kind": (frames.kind, frames.names, ~table.is_frame),
            "error": (frames.error, frames.names, frames.error == 0),
            "found": (frames.found, [one.value for one in FOUNDS], ~table.is_frame),
            "damage": (frames.damage, [one.value if one else "" for one in DAMAGES], frames.damage == 0),
            "proto": (np.zeros(count, np.uint8), [table.protocol], ~table.is_frame),
        }
        numbers: dict[str, Values] = {
            "src": np.where(inside, placed.source, frames.source),
            "dst": np.where(inside, placed.destination, frames.destination),
            "func": frames.function,
            "register": frames.address,
            "count": frames.count,
            "tx": np.where(inside, placed.tx, NONE),
        }
        whole: dict[str, Values] = {
            "no": np.arange(table.first, table.first + count),
            "t": frames.start,
            "start_ns": frames.start,
            "end_ns": frames.end,
            "ok": table.good,
            "noise_before": np.zeros(count),
            "len": frames.length,
        }
        into = self._frames
        for name, (values, texts, missing) in codes.items():
            _add_texts(into[name], values, texts, missing)
        for name, values in numbers.items():
            _add(into[name], values, values == NONE)
        for name, values in whole.items():
            _add(into[name], values, np.zeros(count, bool))
        for place, row in table.odd.items():  # of which the columns of its table do not say all
            self._put(place, _odd(row))

    def _replace(self, count: int, replaced: Mapping[int, Sequence[Row]]) -> None:
        """Other rows in place of some of those that were added last."""
        many: Times = np.ones(count, np.int64)
        many[list(replaced)] = [len(rows) for rows in replaced.values()]
        begins = np.cumsum(many) - many
        for column in self._frames.values():
            if column.parts:  # the others are joined when all is there
                column.parts[-1] = np.repeat(column.parts[-1], many)
                column.holes[-1] = np.repeat(column.holes[-1], many)
        for place, rows in replaced.items():
            for at, row in enumerate(rows, int(begins[place])):
                self._put(at, {**_odd(row), **_placed_by_itself(row)})

    def _put(self, place: int, said: Mapping[str, int | str | None]) -> None:
        """What a row says, into the part that was added last."""
        for name, value in said.items():
            into = self._frames[name]
            if isinstance(value, str):
                value = int(into.text_numbers([value])[0])
            elif value is not None and not -_I64 <= value < _I64:
                value = None
            into.holes[-1][place] = value is None
            into.parts[-1][place] = 0 if value is None else value

    def _add_transactions(self, table: Table) -> None:
        held, into = table.transactions, self._transactions
        nothing: Masks = np.zeros(len(held), bool)
        _add_texts(into["kind"], held.kind, held.names, nothing)
        _add_texts(into["error"], held.error, held.names, held.error == 0)
        _add_texts(into["verdict"], held.verdict, [one.value for one in VERDICTS], nothing)
        for name, values in (("t", held.start), ("start_ns", held.start), ("end_ns", held.end), ("tx", held.id)):
            _add(into[name], values, nothing)
        _add(into["attempt"], held.attempt, nothing)
        for name, values in (("request", held.request), ("response", held.response), ("of", held.of)):
            _add(into[name], values, values == NONE)
        _add(into["station"], held.station, held.station == NONE)
        untimed = held.latency == NONE
        for name, values in (("latency", held.latency), ("latency_low", held.least), ("latency_high", held.most)):
            _add(into[f"{name}_ms"], values / MS, untimed)

    def _join(self, name: str, ids: Times, told: Column) -> None:
        """What the transactions say, for their frames."""
        placed = self._frames["tx"].column()
        column = self._frames[name]
        column.numbers = {text: number for number, text in enumerate(told.texts)}
        if not len(ids):
            _add(column, np.zeros(len(placed.values)), np.ones(len(placed.values), bool))
            return
        order = np.argsort(ids, kind="stable")
        at = np.searchsorted(ids[order], placed.values, side="right") - 1
        found = order[np.maximum(at, 0)]
        missing = (at < 0) | (ids[found] != placed.values)
        if placed.missing is not None:
            missing |= placed.missing
        if told.missing is not None:
            missing |= told.missing[found]
        _add(column, told.values[found], missing)


def _add(into: _Growing, values: Values, missing: Masks) -> None:
    into.parts.append(values.astype(_NUMPY[into.form]))
    into.holes.append(missing.copy())


def _add_texts(into: _Growing, values: Values, texts: Sequence[str], missing: Masks) -> None:
    """Only texts that stand in a row get a number."""
    used = np.flatnonzero(np.bincount(values[~missing], minlength=len(texts)))
    numbers = np.zeros(len(texts), np.int32)
    numbers[used] = into.text_numbers(texts[place] for place in used.tolist())
    _add(into, numbers[values], missing)


def _odd(row: Row) -> dict[str, int | str | None]:
    """What a row says by itself, its transaction's part left out."""
    event, header, placement = row.event, row.header, row.placement
    frame = event if isinstance(event, Frame) else None
    heard = row.searched is None
    return {
        "proto": header.protocol if header else None,
        "src": placement.source if placement else header.source if header else None,
        "dst": placement.destination if placement else header.destination if header else None,
        "role": (placement.role if placement else header.role).value if header else None,
        "kind": header.kind if header else NOISE if heard else SEARCHING,
        "func": header.function if header else None,
        "register": header.address if header else None,
        "count": header.count if header else None,
        "ok": frame.ok if frame is not None else False if heard else None,
        "error": header.error if header else None,
        "found": frame.found.value if frame is not None else None,
        "damage": frame.damage.value if frame is not None and frame.damage is not None else None,
        "noise_before": frame.skipped if frame is not None else 0,
    }


def _placed_by_itself(row: Row) -> dict[str, int | None]:
    """What the columns of a table say of each of its rows, of a row that stands in place of one."""
    event = row.event
    return {"no": row.no, "t": event.start, "start_ns": event.start, "end_ns": event.end} | {
        "len": len(event.octets),
        "tx": row.placement.tx if row.placement else None,
    }


_I64 = 1 << 63
