"""Tables to /frames messages: what `frames.encode` makes of rows one by one, from columns."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from dissectors.columns import NONE
from sniff.engine.engine import Row
from sniff.engine.table import Table
from sniff.recording.frames import EVENTS, MARKS, TRANSACTIONS, ColumnLayout, event_values, message_of, number_of

AT_ONCE = 1000
"""Rows of a message, about: those of a table are dealt out evenly, so that none holds only what was left over."""

_TEXT = next(column for column in EVENTS if column.kind == "text")

Values = npt.NDArray[Any]


def messages(table: Table, offset: int) -> Iterator[tuple[int, int, bytes]]:
    """log time, publish time and data of each. `offset`: octets of the recording before the table."""
    strings: dict[str, int] = {}
    events = _events(table, offset, strings)
    closed = _transactions(table, strings)
    texts = list(strings)
    by = np.where(table.closed_by < 0, max(len(table) - 1, 0), table.closed_by)
    count = max(1, round(len(table) / AT_ONCE))
    ends = [len(table) * part // count for part in range(count + 1)]
    for begin, end in pairwise(ends):
        first = int(np.searchsorted(by, begin))
        last = len(by) if end == len(table) else int(np.searchsorted(by, end))
        if end == begin and first == last:
            continue
        odd = [(place - begin, row) for place, row in table.odd.items() if begin <= place < end]
        rows, ended = [column[begin:end] for column in events], [column[first:last] for column in closed]
        said = _renumbered((*zip(EVENTS, rows, strict=True), *zip(TRANSACTIONS, ended, strict=True)), texts)
        message = message_of(((EVENTS, rows), (MARKS, _marks(odd)), (TRANSACTIONS, ended)), said)
        yield *_span(table, begin, end, first, last), message


def _renumbered(columns: Iterable[tuple[ColumnLayout, Values]], texts: list[str]) -> dict[str, int]:
    """Change the numbers of texts, in place, to those of a message that holds only the texts that it needs."""
    told = [values for column, values in columns if column.kind == "text"]
    used = np.unique(np.concatenate(told))
    used = used[(used > 0) & (used <= len(texts))]
    numbers = np.zeros(1 << 16, np.uint16)
    numbers[used] = np.arange(1, len(used) + 1)
    for values in told:
        values[:] = numbers[values]
    return {texts[number - 1]: place for place, number in enumerate(used.tolist(), 1)}


def _span(table: Table, begin: int, end: int, first: int, last: int) -> tuple[int, int]:
    """The latest end and the earliest start, of rows, else of transactions."""
    if end == begin:
        closed = table.transactions
        return int(closed.end[first:last].max()), int(closed.start[first:last].min())
    odd = [row.event for place, row in table.odd.items() if begin <= place < end]
    ends = [int(table.frames.end[begin:end].max()), *(event.end for event in odd)]
    starts = [int(table.frames.start[begin:end].min()), *(event.start for event in odd)]
    return max(ends), min(starts)


def _marks(odd: list[tuple[int, Row]]) -> list[Values]:
    values = [(place, mark.offset, mark.error.value) for place, row in sorted(odd) for mark in row.event.marks]
    columns = zip(*values, strict=True) if values else ((),) * len(MARKS)
    return [
        np.array([number_of(column, value, {}) for value in part], column.form)
        for column, part in zip(MARKS, columns, strict=True)
    ]


def _events(table: Table, offset: int, strings: dict[str, int]) -> list[Values]:
    frames, placed, count = table.frames, table.placed, len(table)
    inside, nothing = placed.tx > 0, np.zeros(count, np.int64)
    names = _text_numbers(frames.names, strings)
    protocol = np.full(count, number_of(_TEXT, table.protocol, strings))
    by_name: dict[str, Values] = {
        "no": table.first + np.arange(count),
        "offset": offset + frames.offset,
        "length": frames.length,
        "start": frames.start,
        "end": frames.end,
        "slack": table.slack,
        "protocol": protocol,
        "check": frames.check.astype(np.int64) + 1,
        "found": frames.found.astype(np.int64) + 1,
        "damage": frames.damage,
        "expected": frames.expected,
        "skipped": nothing,
        "flags": nothing,
        "place": nothing,
        "reason": nothing,
        "source": frames.source,
        "destination": frames.destination,
        "role": frames.role.astype(np.int64) + 1,
        "kind": names[frames.kind],
        "function": frames.function,
        "address": frames.address,
        "count": frames.count,
        "ok": frames.ok,
        "error": np.where(frames.error > 0, names[frames.error], 0),
        "tx": placed.tx,
        "placed_role": np.where(inside, placed.role.astype(np.int64) + 1, 0),
        "placed_source": np.where(inside, placed.source, NONE),
        "placed_destination": np.where(inside, placed.destination, NONE),
        "searched": nothing,
    }
    columns = [_packed(column, by_name[column.name]) for column in EVENTS]
    for place, row in table.odd.items():
        values = event_values(row, offset + int(frames.offset[place]))
        for column, held, value in zip(EVENTS, columns, values, strict=True):
            held[place] = number_of(column, value, strings)
    return columns


def _transactions(table: Table, strings: dict[str, int]) -> list[Values]:
    closed = table.transactions
    names, timed = _text_numbers(closed.names, strings), closed.latency != NONE
    by_name: dict[str, Values] = {
        "id": closed.id,
        "station": closed.station,
        "kind": names[closed.kind],
        "request": closed.request,
        "response": closed.response,
        "verdict": closed.verdict.astype(np.int64) + 1,
        "start": closed.start,
        "end": closed.end,
        "latency": closed.latency,
        "latency_low": np.where(timed, closed.least, NONE),
        "latency_high": np.where(timed, closed.most, NONE),
        "attempt": closed.attempt,
        "of": closed.of,
        "error": np.where(closed.error > 0, names[closed.error], 0),
    }
    return [_packed(column, by_name[column.name]) for column in TRANSACTIONS]


def _text_numbers(texts: tuple[str, ...], strings: dict[str, int]) -> Values:
    """The numbers of texts in a message."""
    numbers: Values = np.array([number_of(_TEXT, text, strings) for text in texts], np.int64)
    return numbers


def _packed(column: ColumnLayout, values: Values) -> Values:
    """Values as they lie in a message."""
    if column.kind == "optional":
        values = np.where(values == NONE, column.least, values.astype(np.int64))
    packed: Values = values.astype(column.form)
    return packed
