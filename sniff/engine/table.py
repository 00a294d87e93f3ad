"""The table: rows and transactions of one bus as columns; an object is the view of a row that somebody looks at.

A table holds rows that follow one another. Most of them are nothing but their columns. Those of which the columns do
not say all (noise, damage, line errors, pads, messages in several frames) are kept as they are beside them (`odd`).
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise, repeat
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from dissectors.columns import (
    CHECKS,
    DAMAGES,
    FOUNDS,
    NONE,
    ROLES,
    Codes,
    FrameColumns,
    Masks,
    Octets,
    PlacementColumns,
    Times,
    TransactionColumns,
    some,
)
from dissectors.frame import Check, Frame, Header
from dissectors.tracker import Placement, Transaction
from sniff.engine.engine import Output, Row, together
from sniff.engine.row_packing import Names, frame_columns, is_plain, placement_columns, transaction_columns

TEXTS = frozenset(("kind", "error"))
"""Columns that are places in `names`."""

_BAD = CHECKS.index(Check.BAD)

_FAR = 1 << 62  # ns

AT_ONCE = 4096
"""Rows made at a time."""


@dataclass(frozen=True, slots=True)
class Table:
    """Rows `first` … `first + len - 1` of a bus, and the transactions that closed with them, in the order of closing.

    `octets`: of all rows, in their order; `frames.offset` is a place in it. `slack`: ns, of each row. `is_frame`: false
    for noise and for what a search only heard. `closed_by`: place of the row that closed each transaction; -1
    where none did. `odd`: rows as they are, by place in the table. `protocol`: of its
    frames.
    """

    protocol: str
    first: int
    octets: Octets
    frames: FrameColumns
    slack: Times
    is_frame: Masks
    placed: PlacementColumns
    transactions: TransactionColumns
    closed_by: Times
    odd: Mapping[int, Row]

    @classmethod
    def of(
        cls,
        protocol: str,
        first: int,
        rows: Sequence[Row],
        closed: Sequence[Transaction],
        closed_by: Sequence[int] | None = None,
    ) -> Table:
        """What an engine gave; `first`: the number of the first row, or of the row to come. `closed_by`: by the last
        row where it is not said."""
        return cls(
            protocol,
            first,
            np.frombuffer(b"".join(row.event.octets for row in rows), np.uint8),
            frame_columns(rows),
            np.array([row.event.slack if isinstance(row.event, Frame) else 0 for row in rows], np.int64),
            np.array([row.header is not None for row in rows], bool),
            placement_columns(rows),
            transaction_columns(closed),
            np.array(closed_by if closed_by is not None else [len(rows) - 1] * len(closed), np.int64),
            {place: row for place, row in enumerate(rows) if not is_plain(row)},
        )

    @classmethod
    def of_outputs(cls, protocol: str, first: int, outputs: Iterable[Output]) -> Table:
        """What an engine gave, output by output. `protocol`: where no frame says it; what a change of the settings
        completes was heard before it, and is of the protocol of then."""
        whole = together(outputs)
        frames = (row.event for row in whole.rows if isinstance(row.event, Frame))
        protocol = next((frame.protocol for frame in frames), protocol)
        least = 0 if whole.rows else -1  # what closed before any row came goes with the first
        closed_by = [max(place, least) for place in whole.closed_by]
        return cls.of(protocol, first, whole.rows, whole.transactions, closed_by)

    @property
    def heard(self) -> Masks:
        """bool[n]: all rows but those that were only heard while settings were searched for."""
        heard: Masks = np.ones(len(self), bool)
        for place, row in self.odd.items():
            heard[place] = row.searched is None
        return heard

    @property
    def has_true_times(self) -> bool:
        """Whether the columns hold all times: those of a damaged file may be out of their range."""
        ends, most = (self.frames.start, self.frames.end), 1 << 62
        return not len(self) or all(-most < int(one.min()) and int(one.max()) < most for one in ends)

    @property
    def good(self) -> Masks:
        """bool[n]: frames of which nothing is damaged, with a good check where they have one (`Frame.ok`)."""
        return good_rows(self.is_frame, self.frames.damage, self.frames.check)

    @property
    def repaired(self) -> Masks:
        """bool[n]: damaged frames that could be put right."""
        repaired: Masks = np.zeros(len(self), bool)
        for place, row in self.odd.items():
            repaired[place] = isinstance(row.event, Frame) and row.event.repair is not None
        return repaired

    @property
    def latest(self) -> int:
        """The latest end of a row, ns; long ago where there is none."""
        return int(self.frames.end.max(initial=-_FAR))

    def shown(self, name: str) -> npt.NDArray[Any]:
        """What a row says of itself: "source", "destination" or "role", by the tracker where it has a place, else by
        its header."""
        values: npt.NDArray[Any] = np.where(self.placed.tx > 0, getattr(self.placed, name), getattr(self.frames, name))
        return values

    def __len__(self) -> int:
        return len(self.frames)

    def __bool__(self) -> bool:
        return len(self.frames) > 0 or len(self.transactions) > 0

    def row(self, place: int) -> Row:
        """The row at a place, 0 … len - 1."""
        odd = self.odd.get(place)
        if odd is not None:
            return odd
        frame = self.frames.frame(place, self.octets, self.protocol, int(self.slack[place]))
        return Row(self.first + place, frame, self.frames.header(place, self.protocol), self._placement(place))

    def without_times(self) -> Table:
        """The same where nobody knows when anything came: no answer took so long."""
        none = np.full(len(self.transactions), NONE)
        return replace(self, transactions=replace(self.transactions, latency=none, least=none, most=none))

    def rows(self) -> Iterator[Row]:
        """All rows as objects."""
        for begin in range(0, len(self), AT_ONCE):
            yield from rows_at(self, range(begin, min(begin + AT_ONCE, len(self))))

    def outputs(self) -> Iterator[Output]:
        """Row by row, each with the transactions that it closed; those that no row closed come last."""
        closed, at = self.closed_by.tolist(), 0
        for place, row in enumerate(self.rows()):
            begin = at
            while at < len(closed) and 0 <= closed[at] <= place:
                at += 1
            yield Output((row,), tuple(map(self.transaction, range(begin, at))))
        if at < len(closed):
            yield Output((), tuple(map(self.transaction, range(at, len(closed)))))

    def part(self, begin: int, end: int) -> Table:
        """Rows [begin, end) with what they closed; those that no row closed go with the last row.

        They share their octets with the whole.
        """
        return next(self.parts([begin, end]))

    def parts(self, stops: Sequence[int]) -> Iterator[Table]:
        """The rows between each of some ascending places and the next, as `part` gives them."""
        closed_by = np.maximum.accumulate(np.where(self.closed_by < 0, len(self), self.closed_by))
        ends = [stop if stop < len(self) else len(self) + 1 for stop in stops[1:]]
        firsts, lasts = (np.searchsorted(closed_by, places).tolist() for places in (stops[:-1], ends))
        odd = sorted(self.odd)
        for (begin, end), first, last in zip(pairwise(stops), firsts, lasts, strict=True):
            rows, of_rows = slice(begin, end), slice(first, last)
            closed_by = self.closed_by[of_rows]
            yield replace(
                self,
                first=self.first + begin,
                frames=self.frames.take(rows),
                slack=self.slack[rows],
                is_frame=self.is_frame[rows],
                placed=PlacementColumns(*(getattr(self.placed, one.name)[rows] for one in fields(PlacementColumns))),
                transactions=self.transactions.take(of_rows),
                closed_by=np.where(closed_by < 0, -1, closed_by - begin),
                odd={at - begin: self.odd[at] for at in odd[bisect_left(odd, begin) : bisect_left(odd, end)]},
            )

    def without(self, torn: Masks) -> Table:
        """The same rows without some of the transactions."""
        return replace(self, transactions=self.transactions.take(~torn), closed_by=self.closed_by[~torn])

    def _placement(self, place: int) -> Placement | None:
        placed = self.placed
        tx = int(placed.tx[place])
        if not tx:
            return None
        source, destination = some(placed.source[place]), some(placed.destination[place])
        return Placement(self.first + place, tx, ROLES[placed.role[place]], source, destination)

    def transaction(self, place: int) -> Transaction:
        """The transaction that closed as number `place` of the table, from 0."""
        return self.transactions.transaction(place)


def rows_at(table: Table, places: Sequence[int]) -> list[Row]:
    """Rows at some places, in that order: what `Table.row` gives, for less than half."""
    odd = table.odd
    at = np.array([place for place in places if place not in odd], np.int64)
    made = map(Row, _numbers(table, at), _frames(table, at), _headers(table, at), _placements(table, at))
    return [odd[place] if place in odd else next(made) for place in places]


def _numbers(table: Table, at: Times) -> list[int]:
    numbers: list[int] = (at + table.first).tolist()
    return numbers


def _frames(table: Table, at: Times) -> Iterator[Frame]:
    frames = table.frames
    begins = frames.offset[at]
    base = int(begins.min()) if len(at) else 0
    ends = begins + frames.length[at]
    octets = table.octets[base : int(ends.max()) if len(at) else base].tobytes()
    return map(
        Frame,
        repeat(table.protocol),
        [octets[begin:end] for begin, end in zip((begins - base).tolist(), (ends - base).tolist(), strict=True)],
        frames.start[at].tolist(),
        frames.end[at].tolist(),
        [CHECKS[code] for code in frames.check[at].tolist()],
        [FOUNDS[code] for code in frames.found[at].tolist()],
        [DAMAGES[code] for code in frames.damage[at].tolist()],
        _optional(frames.expected, at),
        repeat(0),
        table.slack[at].tolist(),
    )


def _headers(table: Table, at: Times) -> Iterator[Header]:
    frames, names = table.frames, table.frames.names
    return map(
        Header,
        repeat(table.protocol),
        _optional(frames.source, at),
        _optional(frames.destination, at),
        [ROLES[code] for code in frames.role[at].tolist()],
        [names[name] for name in frames.kind[at].tolist()],
        _optional(frames.function, at),
        _optional(frames.address, at),
        _optional(frames.count, at),
        frames.ok[at].tolist(),
        [names[name] if name else None for name in frames.error[at].tolist()],
    )


def _placements(table: Table, at: Times) -> list[Placement | None]:
    placed = table.placed
    columns = zip(
        _numbers(table, at),
        placed.tx[at].tolist(),
        placed.role[at].tolist(),
        _optional(placed.source, at),
        _optional(placed.destination, at),
        strict=True,
    )
    return [Placement(no, tx, ROLES[role], source, goal) if tx else None for no, tx, role, source, goal in columns]


def _optional(column: npt.NDArray[Any], at: Times) -> list[int | None]:
    return [None if value == NONE else value for value in column[at].tolist()]


def good_rows(is_frame: Masks, damage: Codes, check: Codes) -> Masks:
    """Frames of which nothing is damaged, with a good check where they have one."""
    good: Masks = is_frame & (damage == 0) & (check != _BAD)
    return good


def joined(protocol: str, first: int, parts: Sequence[Table]) -> Table:
    """Tables whose rows follow one another as one; an empty one whose rows would begin with `first` for none."""
    if not parts:
        return Table.of(protocol, first, [], [])
    if len(parts) == 1:
        return parts[0]
    lengths, first = [len(part.octets) for part in parts], parts[0].first
    odd = {part.first - first + place: row for part in parts for place, row in part.odd.items()}
    frames = joined_columns(FrameColumns, [part.frames for part in parts])
    begins = np.repeat(np.cumsum([0, *lengths[:-1]]), [len(part) for part in parts])
    return Table(
        protocol,
        first,
        np.concatenate([part.octets for part in parts]),
        replace(frames, offset=frames.offset + begins),
        np.concatenate([part.slack for part in parts]),
        np.concatenate([part.is_frame for part in parts]),
        PlacementColumns(
            *(
                np.concatenate([getattr(part.placed, name) for part in parts])
                for name in ("tx", "role", "source", "destination")
            )
        ),
        joined_columns(TransactionColumns, [part.transactions for part in parts]),
        np.concatenate([part.closed_by + np.where(part.closed_by < 0, 0, part.first - first) for part in parts]),
        odd,
    )


Named = TypeVar("Named", FrameColumns, TransactionColumns)


def joined_columns(kind: type[Named], parts: Sequence[Named]) -> Named:
    """Columns one after the other, their texts under common numbers."""
    names, columns = Names(), [one.name for one in fields(kind)[:-1]]
    held: dict[str, list[npt.NDArray[Any]]] = {name: [] for name in columns}
    known: dict[tuple[str, ...], npt.NDArray[np.uint16] | None] = {}  # by their texts, which many parts share
    for part in parts:
        if part.names not in known:
            told = [names.number(text) for text in part.names]
            known[part.names] = None if told == list(range(len(told))) else np.array(told, np.uint16)
        numbers = known[part.names]
        for name in columns:
            values = getattr(part, name)
            held[name].append(numbers[values] if name in TEXTS and numbers is not None else values)
    texts = names.texts
    same = next((part.names for part in parts if part.names == texts), texts)  # shared again by the next joining
    return kind(**{name: np.concatenate(values) for name, values in held.items()}, names=same)
