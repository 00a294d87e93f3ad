"""Rows of a bus as columns, as a judge sees them: for captures of millions of frames.

Most rows are nothing but their columns. `RowColumns` is what a table of the engine looks like from here. A judge that
`JudgesColumns` takes one whole; any other is fed row by row (`in_turn`), with the same findings.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Protocol, runtime_checkable

if TYPE_CHECKING:
    from dissectors.columns import FrameColumns, Masks, Octets, PlacementColumns, Times, TransactionColumns
    from dissectors.findings import Judge
    from dissectors.frame import Event, Header
    from dissectors.tracker import Placement, Transaction


class SeenRow(Protocol):
    """A row as an object: its number, event, header and placement (both None for noise)."""

    @property
    def no(self) -> int:
        """Its number on the bus."""
        ...

    @property
    def event(self) -> Event:
        """The frame or noise."""
        ...

    @property
    def header(self) -> Header | None:
        """What `peek` says of it."""
        ...

    @property
    def placement(self) -> Placement | None:
        """Where it belongs."""
        ...


class RowColumns(Protocol):
    """Rows `first` … `first + len - 1` of a bus, and the transactions that closed with them, in the order of closing.

    `octets`: where `frames.offset` counts, also that of noise. `slack`: ns, of each row. `is_frame`: false for noise.
    `good`: frames with `Frame.ok`. `placed`: `tx` 0 where a row has no place. `closed_by`: place of the row that closed
    each transaction, ascending; -1, at the end, where none did. `odd`: rows of which the columns do not say all (noise,
    line errors, flags, repairs, pads, messages in several frames), by place; of every other row that is a frame they
    do. Damaged frames without any of these are no odd rows: see `good`.
    """

    @property
    def protocol(self) -> str:
        """Of the frames."""
        ...

    @property
    def first(self) -> int:
        """Number of the first row, or of the row to come."""
        ...

    @property
    def octets(self) -> Octets:
        """Octets of all rows."""
        ...

    @property
    def frames(self) -> FrameColumns:
        """Of all rows; for noise only offset, length, start and end say anything."""
        ...

    @property
    def slack(self) -> Times:
        """int64[n], ns."""
        ...

    @property
    def is_frame(self) -> Masks:
        """bool[n]."""
        ...

    @property
    def good(self) -> Masks:
        """bool[n]; computed when asked."""
        ...

    @property
    def placed(self) -> PlacementColumns:
        """Of all rows."""
        ...

    @property
    def transactions(self) -> TransactionColumns:
        """Those that closed."""
        ...

    @property
    def closed_by(self) -> Times:
        """int64[transactions]."""
        ...

    @property
    def odd(self) -> Mapping[int, SeenRow]:
        """Rows as they are, by place."""
        ...

    def __len__(self) -> int:
        """How many rows."""
        ...

    def row(self, place: int) -> SeenRow:
        """The row at a place, 0 … len - 1, as an object."""
        ...

    def transaction(self, place: int) -> Transaction:
        """The transaction that closed as number `place`, from 0."""
        ...


@runtime_checkable
class JudgesColumns(Protocol):
    """A judge (`dissectors.findings.Judge`) that takes many rows at once."""

    def take(self, rows: RowColumns) -> None:
        """Take rows and the transactions that closed with them: the same as `see` and `settle` for one after the other.

        Where the rows are cut into such values makes no difference, nor that some come by `see`.
        """
        ...


def in_order(rows: RowColumns) -> Iterator[tuple[int | None, tuple[Transaction, ...]]]:
    """Each place with the transactions that its row closed; those that no row closed come last, with None."""
    closed, at = rows.closed_by.tolist(), 0
    for place in range(len(rows)):
        begin = at
        while at < len(closed) and 0 <= closed[at] <= place:
            at += 1
        yield place, tuple(map(rows.transaction, range(begin, at)))
    if at < len(closed):
        yield None, tuple(map(rows.transaction, range(at, len(closed))))


def in_turn(judge: Judge, rows: RowColumns) -> None:
    """Feed a judge row by row."""
    for place, closed in in_order(rows):
        if place is not None:
            row = rows.row(place)
            judge.see(row.no, row.event, row.header, row.placement)
        for transaction in closed:
            judge.settle(transaction)
