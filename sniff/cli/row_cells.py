"""Rows as CSV, chosen fields or JSON, many at a time: what `rows.to_json` and `rows.fields_of` say, from columns."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dissectors.columns import FOUNDS, NONE, ROLES, VERDICTS, Masks, Times
from dissectors.line import NS_PER_S
from dissectors.manifest import Dissector
from dissectors.stencil import Stencil
from sniff.bus import row_words as rows
from sniff.cli import json_output
from sniff.cli.byte_columns import (
    Chosen,
    Codes,
    Column,
    digits,
    encoded,
    fixed_digits,
    hex_octets,
    matrix,
    pieced,
    since,
    where,
)
from sniff.cli.distinct import distinct_codes
from sniff.cli.merged_columns import merged
from sniff.cli.said_texts import SaidTexts
from sniff.cli.specimens import Specimens
from sniff.cli.tables import plain_cell
from sniff.engine.column_join import SettledRows
from sniff.engine.engine import Row
from sniff.engine.session import Session
from sniff.engine.table import Table
from sniff.engine.verdict_join import JudgedRow

_LATENCIES = {"latency_ms": "latency", "tx.latency_ms": "latency", "tx.latency_low_ms": "least"} | {
    "tx.latency_high_ms": "most"
}
_SHORT_FLOATS = (100, 10**15)
"""ns within which a float of milliseconds is written as its decimal digits."""


@dataclass(frozen=True, slots=True)
class Style:
    """How cells make a line. `render(value)`: a cell; `before`: what stands before each; `quote`: around plain text."""

    render: Callable[[Any], bytes]
    before: tuple[bytes, ...]
    end: bytes
    quote: bytes = b""


def separated(count: int, delimiter: str, first: Sequence[str] = ()) -> Style:
    """`count` values with something between them, quoted where need be; no cell is a formula. `first`: what every line
    begins with."""
    held = io.StringIO()
    writer = csv.writer(held, delimiter=delimiter, lineterminator="\n")
    more = [] if count == 1 else ["x"]

    def render(value: Any) -> bytes:
        held.seek(0)
        held.truncate()
        writer.writerow([plain_cell(value), *more])
        return encoded(held.getvalue()[: -1 - 2 * len(more)])

    between = delimiter.encode()
    return Style(render, (b"".join(render(text) + between for text in first), *[between] * (count - 1)), b"\n")


def chosen(names: Sequence[str], source: str) -> Style:
    """The same of chosen names, with tabs between; `source`: what each line has where that is named."""
    style = separated(len(names), "\t")
    said = style.render(source)
    before, held = [], b""
    for at, name in enumerate(names):
        held += b"\t" if at else b""
        if name == "source":
            held += said
        else:
            before.append(held)
            held = b""
    return replace(style, before=tuple(before), end=held + b"\n")


def json_lines(names: Sequence[str], source: str | None = None) -> Style:
    """An object a line, which begins with its source where there is one."""
    begin = "{" if source is None else f'{{"source": {json_output.dumps(source)}, '
    before = (f'{", " if at else begin}"{name}": '.encode() for at, name in enumerate(names))
    return Style(lambda value: encoded(json_output.dumps(value)), tuple(before), b"}\n", b'"')


class RowCells:
    """Makes lines of cells of the rows of one capture: of each name, a key of `rows.to_json` or a field of
    `rows.fields_of`."""

    def __init__(self, dissector: Dissector, session: Session, names: Sequence[str], style: Style) -> None:
        self._dissector = dissector
        self._session = session
        self._names = tuple(names)
        self._style = style
        self._none = style.render(None)
        self._texts = SaidTexts(dissector, style.render)
        self._fields = [name for name in names if name not in _HELD and name != "text"]
        self._specimens = Specimens(self._ask)
        self._cells: list[tuple[bytes, ...]] = []

    def lines(self, settled: SettledRows, places: Times) -> Iterator[bytes]:
        """The lines of rows at some places, in parts."""
        alone = np.isin(places, np.fromiter(settled.table.odd, np.int64, len(settled.table.odd)))
        some = _Some(settled, places, settled.which[places - settled.begin], alone)
        fields = self._of_specimens(some) if self._fields else {}
        columns: list[Column] = []
        for before, name in zip(self._style.before, self._names, strict=True):
            columns.append(before)
            if name == "text":
                texts, _, odd = self._texts.column(settled.table, places)
                alone |= odd
                columns.append(texts)
            elif name in fields:
                columns.append(fields[name])
            else:
                columns += _HELD[name](self, some, name)
        return pieced(merged([*columns, self._style.end]), alone, lambda at: self._alone(settled, int(places[at])))

    def _alone(self, settled: SettledRows, place: int) -> bytes:
        cells = map(self._style.render, self._values(settled.item(place), self._names))
        pairs = zip(self._style.before, cells, strict=True)
        return b"".join(before + cell for before, cell in pairs) + self._style.end

    def _values(self, item: JudgedRow, names: Sequence[str]) -> list[Any]:
        values: dict[str, Any] = {}
        if any(name in rows.JSON_KEYS for name in names):
            values = rows.to_json(item, self._dissector, self._session)
        if any(name not in rows.JSON_KEYS for name in names):
            values = {**values, **rows.fields_of(item, self._dissector)}
        return [values.get(name) for name in names]

    # what depends on the octets of a row, and is said by a specimen

    def _of_specimens(self, some: _Some) -> dict[str, Column]:
        if self._specimens.is_full:
            self._specimens.clear()
            self._cells.clear()
        which = self._specimens.find(some.settled.table, some.places).which
        some.alone |= which < 0
        if not self._cells:
            return dict.fromkeys(self._fields, b"")
        distinct, codes = distinct_codes(np.maximum(which, 0))
        cells = [self._cells[one] for one in distinct.tolist()]
        columns: dict[str, Column] = {}
        for name, texts in zip(self._fields, zip(*cells, strict=True), strict=True):
            sizes = np.array(list(map(len, texts)))
            long = sizes > 4 * sizes.mean() + 32
            some.alone |= long[codes]
            columns[name] = Chosen.of([b"" if it_is else text for text, it_is in zip(texts, long, strict=True)], codes)
        return columns

    def _ask(self, row: Row, _: Stencil | None) -> bool:
        cells = tuple(map(self._style.render, self._values(JudgedRow(row, None), self._fields)))
        if any(b"\0" in cell for cell in cells):
            return False
        self._cells.append(cells)
        return True

    # what differs from row to row

    def no(self, some: _Some, _: str) -> list[Column]:
        """Numbers of rows."""
        return [digits(some.places + some.settled.table.first)]

    def t(self, some: _Some, _: str) -> list[Column]:
        """Instants."""
        if not self._session.has_times:
            return [self._none]
        times = some.settled.table.frames.start[some.places]
        seconds = times // NS_PER_S
        first = int(seconds.min(initial=0 if not len(seconds) else seconds[0]))
        distinct, codes = distinct_codes(seconds - first)
        words = [encoded(rows.iso((first + one) * NS_PER_S)[: -len(".000000000Z")]) for one in distinct.tolist()]
        quote = self._style.quote
        rest = fixed_digits(times - seconds * NS_PER_S, 9)
        return [quote, Chosen.of(words, codes), b".", rest, b"Z" + quote]

    def since(self, some: _Some, name: str) -> list[Column]:
        """ns since the capture's start."""
        if not self._session.has_times:
            return [self._none]
        frames = some.settled.table.frames
        times = (frames.start if name == "start_ns" else frames.end)[some.places]
        return [digits(since(times, self._session.started))]

    def tx(self, some: _Some, _: str) -> list[Column]:
        """Numbers of transactions."""
        tx = some.settled.table.placed.tx[some.places]
        return self._where(tx > 0, digits(np.maximum(tx, 0)))

    def of_transaction(self, some: _Some, name: str) -> list[Column]:
        """Number or attempt of what the row belongs to."""
        if not len(some.settled.closed):
            return [self._none]
        column = some.settled.closed.id if name == "tx.id" else some.settled.closed.attempt
        return self._where(some.has, digits(np.where(some.has, column[some.which], 0)))

    def verdict(self, some: _Some, _: str) -> list[Column]:
        """Verdicts."""
        words = [self._none, *(self._style.render(verdict.value) for verdict in VERDICTS)]
        if not len(some.settled.closed):
            return [self._none]
        return [Chosen.of(words, np.where(some.has, some.settled.closed.verdict[some.which].astype(np.int64) + 1, 0))]

    def latency(self, some: _Some, name: str) -> list[Column]:
        """Milliseconds with up to six decimals."""
        closed = some.settled.closed
        if not len(closed):
            return [self._none]
        has = some.has & (closed.latency[some.which] != NONE)
        times = np.where(has, getattr(closed, _LATENCIES[name])[some.which], 0)
        least, most = _SHORT_FLOATS
        some.alone |= (times != 0) & ((times < least) | (times >= most))
        times = np.clip(times, 0, most)
        whole = times // 1_000_000
        parts = fixed_digits(times - whole * 1_000_000, 6)
        trailing = np.ones(len(parts), bool)
        for place in range(5, 0, -1):
            trailing &= parts[:, place] == ord("0")
            parts[trailing, place] = 0
        number = np.concatenate([digits(whole), np.full((len(parts), 1), ord("."), np.uint8), parts], axis=1)
        return self._where(has, number)

    # what a table holds

    def station(self, some: _Some, name: str) -> list[Column]:
        """Who speaks, or to whom."""
        values = some.settled.table.shown("source" if name == "src" else "destination")[some.places]
        distinct, codes = distinct_codes(values.astype(np.int64) - NONE)
        texts = [self._none if not one else b"%d" % (one + NONE) for one in distinct.tolist()]
        return [Chosen.of(texts, codes)]

    def worded(self, some: _Some, name: str) -> list[Column]:
        """What is one of some texts."""
        codes, texts = _WORDED[name](some.settled.table)
        distinct, codes = distinct_codes(codes[some.places].astype(np.int64))
        return [Chosen.of([self._style.render(texts[one]) for one in distinct.tolist()], codes)]

    def length(self, some: _Some, _: str) -> list[Column]:
        """Octets of frames."""
        return [digits(some.settled.table.frames.length[some.places].astype(np.int64))]

    def hex(self, some: _Some, _: str) -> list[Column]:
        """The octets."""
        frames = some.settled.table.frames
        lengths = frames.length[some.places].astype(np.int64)
        some.alone |= lengths > 4 * lengths.mean() + 32
        lengths = np.where(some.alone, 0, lengths)
        octets = hex_octets(some.settled.table.octets, frames.offset[some.places], lengths)
        return [self._style.quote, octets, self._style.quote]

    def _where(self, has: Masks, column: Any) -> list[Column]:
        """A column where there is something."""
        if has.all():
            return [column]
        held: list[Column] = [where(has, column)]
        return [*held, Chosen(matrix([b"", self._none]), (~has).view(np.uint8))] if self._none else held


@dataclass(slots=True)
class _Some:
    """Rows at some places; `which`: of each the place of its transaction in what closed, -1 for none; `alone`: rows
    that columns do not say."""

    settled: SettledRows
    places: Times
    which: Times
    alone: Masks

    @property
    def has(self) -> Masks:
        """Whether a row belongs to something that closed."""
        has: Masks = self.which >= 0
        return has


_WORDED: dict[str, Callable[[Table], tuple[Codes, Sequence[str | bool | int | None]]]] = {
    "proto": lambda table: (np.zeros(len(table), np.uint8), [table.protocol]),
    "role": lambda table: (table.shown("role"), [role.value for role in ROLES]),
    "kind": lambda table: (table.frames.kind, table.frames.names),
    "ok": lambda table: (table.good.astype(np.uint8), [False, True]),
    "error": lambda table: (table.frames.error, [None, *table.frames.names[1:]]),
    "found": lambda table: (table.frames.found, [found.value for found in FOUNDS]),
    "noise_before": lambda table: (np.zeros(len(table), np.uint8), [0]),
}
_HELD: dict[str, Callable[[RowCells, _Some, str], list[Column]]] = {
    **dict.fromkeys(_WORDED, RowCells.worded),
    **dict.fromkeys(_LATENCIES, RowCells.latency),
    **dict.fromkeys(("no", "frame.number"), RowCells.no),
    **dict.fromkeys(("start_ns", "end_ns"), RowCells.since),
    **dict.fromkeys(("src", "dst"), RowCells.station),
    **dict.fromkeys(("verdict", "tx.verdict"), RowCells.verdict),
    **dict.fromkeys(("tx.id", "tx.attempt"), RowCells.of_transaction),
    "t": RowCells.t,
    "tx": RowCells.tx,
    "frame.len": RowCells.length,
    "hex": RowCells.hex,
}
"""What is made of columns, by name; all else says a specimen."""
