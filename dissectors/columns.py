"""Columns: reads and frames of a bus as arrays, for captures of millions of frames; and the contract of a kernel.

A kernel is a framer and a peek for the clean stretches of a capture, where no Python object is made for a frame. It
gives *chains*: frames each of which begins where the one before it ends. What it says of a chain is

    if the reference framer is at rest where the chain begins (it holds nothing, and its last event was a good frame
    that ended there), it gives exactly these frames, with these times, and `peek` gives exactly these headers.

So it need not be complete: what it does not give is doubtful, and goes through the reference framer. Whoever puts both
together (`sniff/engine`) takes a chain up where the reference comes to rest inside it. A kernel is pure and total: any
octets, any times, any lengths; it never raises.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Protocol, Self, runtime_checkable

import numpy as np
import numpy.typing as npt

from dissectors.frame import Check, Damage, FoundBy, Frame, Header, Role
from dissectors.line import Timing
from dissectors.tracker import Interval, Transaction, Verdict

if TYPE_CHECKING:
    from dissectors.framer import Framer
    from dissectors.tracker import Tracker

Octets = npt.NDArray[np.uint8]
Times = npt.NDArray[np.int64]
Numbers = npt.NDArray[np.int32]
Small = npt.NDArray[np.int16]
Codes = npt.NDArray[np.uint8]
Names = npt.NDArray[np.uint16]
Masks = npt.NDArray[np.bool_]

NONE = -1
"""An optional number that is not there."""

CHECKS = tuple(Check)
FOUNDS = tuple(FoundBy)
DAMAGES = (None, *Damage)
ROLES = tuple(Role)
VERDICTS = tuple(Verdict)
"""What the codes in `check`, `found`, `damage`, `role` and `verdict` stand for: the member at that place."""


UNSAID = 255
"""In `damage` of rows that are handed to a pairing: columns do not say all of that row."""


def some(value: np.integer[Any]) -> int | None:
    """An optional number; None for `NONE`."""
    number = int(value)
    return None if number == NONE else number


@dataclass(frozen=True, slots=True)
class Reads:
    """Reads of one bus in the order of the wire, without line events.

    `octets`: uint8[n], of all reads. `times`: int64[k], ns, when each read returned (may run backwards). `lengths`:
    int64[k], octets of each, 1 or more, n together. `marked`: bool[k], whether line errors were reported in it: such
    a read is doubtful. `before`: nominal end of the octet before the first, ns; None at the begin of a capture.
    """

    octets: Octets
    times: Times
    lengths: Times
    marked: Masks
    before: int | None = None

    def __len__(self) -> int:
        return len(self.times)

    @property
    def begins(self) -> Times:
        """int64[k+1]: place in `octets` of the first octet of each read, and their number."""
        begins: Times = np.zeros(len(self.lengths) + 1, np.int64)
        np.cumsum(self.lengths, out=begins[1:])
        return begins


@dataclass(frozen=True, slots=True)
class OctetTimes:
    """The nominal end of every octet, as `framer.OctetWindow` has it, without an array of all of them.

    Octet j of read c ends at max(floors[c], times[c] - (begins[c+1] - 1 - j) * char).
    """

    begins: Times  # int64[k+1]
    times: Times
    floors: Times  # nominal end of the octet before each read; that of the first read of a capture: one character early
    char: int

    @classmethod
    def of(cls, reads: Reads, char: int) -> Self:
        """The times of some reads."""
        begins = reads.begins
        if not len(reads):
            return cls(begins, reads.times, reads.times, char)
        first = reads.before
        if first is None:
            first = int(reads.times[0]) - int(reads.lengths[0]) * char
        floors = np.empty(len(reads), np.int64)
        floors[0] = first
        np.maximum(np.maximum.accumulate(reads.times[:-1]), first, out=floors[1:])
        return cls(begins, reads.times, floors, char)

    def read_of(self, octets: Times) -> Times:
        """Index of the read that holds each octet (places in the octets of all reads)."""
        return places_in(self.begins, octets, "right") - 1

    def end(self, octets: Times) -> Times:
        """Nominal end of octets, ns."""
        reads = self.read_of(octets)
        return np.maximum(self.floors[reads], self.times[reads] - (self.begins[reads + 1] - 1 - octets) * self.char)

    def start(self, octets: Times) -> Times:
        """Latest possible begin of octets, ns."""
        reads = self.read_of(octets)
        first = self.times[reads] - (self.begins[reads + 1] - octets) * self.char
        start: Times = np.maximum(first, self.floors[reads])
        return start

    def gaps(self) -> Times:
        """int64[k]: nominal silence before each read, ns, 0 or more."""
        first_end = self.times - (self.begins[1:] - self.begins[:-1] - 1) * self.char
        gaps: Times = np.maximum(first_end - self.char - self.floors, 0)
        return gaps


@dataclass(frozen=True, slots=True)
class FrameColumns:
    """Frames as columns, one entry a frame, and what `peek` says of them. `NONE` where an optional number is None.

    `offset`: place of the first octet among those of all reads. `start`, `end`: ns, as in `Frame`. `slack` is the
    adapter's latency for all, `skipped` 0, there are no marks, flags or repairs. `kind`, `error`: places in `names`;
    error 0 is None. `expected`: `NONE` for None.
    """

    offset: Times
    length: Numbers
    start: Times
    end: Times
    check: Codes
    found: Codes
    damage: Codes
    expected: Numbers
    source: Small
    destination: Small
    role: Codes
    kind: Names
    function: Small
    address: Numbers
    count: Numbers
    ok: Masks
    error: Names
    names: tuple[str, ...] = ("",)

    def __len__(self) -> int:
        return len(self.offset)

    def take(self, which: slice | Masks | Times) -> FrameColumns:
        """Some of them."""
        return replace(self, **{one.name: getattr(self, one.name)[which] for one in fields(self)[:-1]})

    def frame(self, row: int, octets: Octets, protocol: str, slack: int) -> Frame:
        """The frame that a row stands for. `octets`: where `offset` counts. `slack`: ns."""
        begin = int(self.offset[row])
        return Frame(
            protocol,
            octets[begin : begin + int(self.length[row])].tobytes(),
            int(self.start[row]),
            int(self.end[row]),
            CHECKS[self.check[row]],
            FOUNDS[self.found[row]],
            DAMAGES[self.damage[row]],
            some(self.expected[row]),
            0,
            slack,
        )

    def header(self, row: int, protocol: str) -> Header:
        """What `peek` says of it."""
        return Header(
            protocol,
            some(self.source[row]),
            some(self.destination[row]),
            ROLES[self.role[row]],
            self.names[self.kind[row]],
            some(self.function[row]),
            some(self.address[row]),
            some(self.count[row]),
            bool(self.ok[row]),
            self.names[self.error[row]] if self.error[row] else None,
        )

    @property
    def chained(self) -> Masks:
        """bool[n]: whether each begins where the one before it ends; False for the first."""
        chained: Masks = np.zeros(len(self), bool)
        if len(self):
            chained[1:] = self.offset[1:] == self.offset[:-1] + self.length[:-1]
        return chained


@dataclass(frozen=True, slots=True)
class PlacementColumns:
    """Where frames belong, one entry a row, as `tracker.Placement`. `tx`: 0 where a row has no place (noise)."""

    tx: Times
    role: Codes
    source: Small
    destination: Small

    def __len__(self) -> int:
        return len(self.tx)


@dataclass(frozen=True, slots=True)
class TransactionColumns:
    """Transactions in the order of closing, as `tracker.Transaction`; `NONE` where an optional number is None.

    `request`, `response`, `of`: numbers of rows and of a transaction. `latency`, `least`, `most`: ns, the three
    readings of the interval. `kind`, `error`: places in `names`; error 0 is None.
    """

    id: Times
    station: Small
    kind: Names
    request: Times
    response: Times
    verdict: Codes
    start: Times
    end: Times
    latency: Times
    least: Times
    most: Times
    attempt: Numbers
    of: Times
    error: Names
    names: tuple[str, ...] = ("",)

    def __len__(self) -> int:
        return len(self.id)

    def take(self, which: slice | Masks | Times) -> TransactionColumns:
        """Some of them."""
        return replace(self, **{one.name: getattr(self, one.name)[which] for one in fields(self)[:-1]})

    def transaction(self, place: int) -> Transaction:
        """The transaction that an entry stands for."""
        latency = None
        if self.latency[place] != NONE:
            latency = Interval(int(self.latency[place]), int(self.least[place]), int(self.most[place]))
        return Transaction(
            int(self.id[place]),
            some(self.station[place]),
            self.names[self.kind[place]],
            some(self.request[place]),
            some(self.response[place]),
            VERDICTS[self.verdict[place]],
            int(self.start[place]),
            int(self.end[place]),
            latency,
            int(self.attempt[place]),
            some(self.of[place]),
            self.names[self.error[place]] if self.error[place] else None,
        )


def places_in(ascending: Times, values: Times, side: Literal["left", "right"] = "left") -> Times:
    """`np.searchsorted`; at once where every value falls one place behind the one before it, as frames do among reads
    that each hold one."""
    first = int(ascending.searchsorted(values[0], side)) if len(values) else 0
    end = first + len(values)
    if first > 0 and end <= len(ascending):
        below, above = ascending[first - 1 : end - 1], ascending[first:end]
        if side == "left":
            fits = (below < values) & (values <= above)
        else:
            fits = (below <= values) & (values < above)
        if fits.all():
            return np.arange(first, end)
    places: Times = ascending.searchsorted(values, side)
    return places


def holds_any(begins: Times, ends: Times, places: Times) -> Masks:
    """bool[n]: whether one of the ascending `places` lies in each [begin, end)."""
    holds: Masks = np.searchsorted(places, ends, "left") > np.searchsorted(places, begins, "left")
    return holds


def counted(*keys: npt.NDArray[np.integer[Any]]) -> Iterator[tuple[tuple[int, ...], int]]:
    """How often each combination of numbers, 0 or more, stands in columns of one length; in ascending order."""
    if not len(keys[0]):
        return
    sizes = [int(key.max()) + 1 for key in keys]
    combined = np.zeros(len(keys[0]), np.int64)
    for key, size in zip(keys, sizes, strict=True):
        combined = combined * size + key
    if math.prod(sizes) <= min(_DENSE, _SPARSE * len(combined) + _FEW):
        counts = np.bincount(combined)
        distinct = np.flatnonzero(counts)
        counts = counts[distinct]
    else:
        distinct, counts = np.unique(combined, return_counts=True)
    for value, count in zip(distinct.tolist(), counts.tolist(), strict=True):
        parts = []
        for size in reversed(sizes):
            value, part = divmod(value, size)
            parts.append(part)
        yield tuple(reversed(parts)), count


_DENSE = 1 << 22
"""So many combinations are counted without sorting."""

_SPARSE, _FEW = 64, 4096
"""And no more than so many for each number, and at least so many: a look at each costs more than sorting a few."""


class Run(NamedTuple):
    """What was paired: rows [begin, end), where they belong, and the transactions that they closed, in order.

    `closed_by`: the row that closed each.
    """

    begin: int
    end: int
    placements: PlacementColumns
    transactions: TransactionColumns
    closed_by: Times


class BlockPairing(Protocol):
    """Frames that follow one another, paired by columns wherever the tracker need not see them."""

    def run(self, begin: int, no: int) -> Run | None:
        """Pair rows from `begin` on, which has the number `no`, and put the tracker behind them.

        The tracker has just taken the row before, which had the number before. None where it must take `begin` too.
        """
        ...


class Pairing(Protocol):
    """Makes the bulk form of a protocol's tracker for some frames."""

    def __call__(
        self, tracker: Tracker, frames: FrameColumns, octets: Octets, timing: Timing, slack: Times
    ) -> BlockPairing:
        """`tracker`: will be moved. `octets`: where `frames.offset` counts. `slack`: ns, of each frame.

        Among frames of the kernel there may be rows that the reference framer gave, noise too. Those of which columns
        do not say all are not `ok`, `damage` is UNSAID, other columns may say anything: the tracker must take them.
        """
        ...


@runtime_checkable
class Remembering(Protocol):
    """A framer that weighs octets by what it remembers of the bus. `primed`: how many of the last rows of a chain tell
    it all that it has not been told."""

    primed: int

    def remember(self, earlier: Framer, frames: FrameColumns, octets: Octets, begin: int, end: int) -> None:
        """Go on with the memory of an earlier framer, and with what rows [begin, end) of `frames` teach, which came
        after what it gave. Without rows what it waits for comes next, or a request does.

        `frames`: of the whole block, the same object as long as it lasts. `octets`: where `frames.offset` counts.
        """
        ...


class Kernel(Protocol):
    """Framer and peek for clean stretches; see the contract above."""

    def __call__(self, reads: Reads, timing: Timing) -> FrameColumns:
        """The frames of all chains, ascending by `offset`, none overlapping another."""
        ...


def disjoint(begins: Times, ends: Times) -> Masks:
    """Which frames to keep so that none overlaps another: of those that do, each that begins behind the last kept.

    `begins`, `ends`: places of their octets, [begin, end), ascending by `begins`.
    """
    kept = np.ones(len(begins), bool)
    if not len(begins):
        return kept
    overlapped = np.flatnonzero(begins[1:] < np.maximum.accumulate(ends)[:-1]) + 1
    before, end = -1, 0
    for row in overlapped.tolist():
        if row != before + 1:
            end = int(ends[row - 1])
        if begins[row] >= end:
            end = int(ends[row])
        else:
            kept[row] = False
        before = row
    return kept
