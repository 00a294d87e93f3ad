"""Reads to frames of any protocol in bulk: clean stretches by its kernel, everything else by its reference framer.

The reference framer runs until it gives a good frame that the kernel gives too; from there on it is at rest inside a
chain (`dissectors/columns.py`), whose rows are taken as they stand. Where the chain ends a new framer goes on. It is
handed the last rows of the chain first, whose events are known and dropped, so that it has what it needs of the past.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from dissectors.columns import ROLES, FrameColumns, Octets, Reads, Remembering, Times
from dissectors.frame import Chunk, Event, Frame, Role
from dissectors.framer import Framer
from dissectors.line import Timing
from dissectors.manifest import Dissector
from sniff.engine.blocks import Block

MARGIN = 520
"""Octets before the end of a block from which on nothing is taken from a kernel: what follows may decide them. Two of
the longest frames of a protocol that is framed by silences; most frames end where they say."""

LEAST = 1536
"""Octets that a block must hold for a kernel to be worth its while; the reference is as fast with fewer."""

SHORTEST = 3
"""Rows that a chain must still hold for it to be worth taking up."""

PRIMED, MANY = 6, 100
"""Rows of a chain that a new framer is handed first, where it does not say itself how many it needs
(`Remembering.primed`); those that it is handed where it makes something else of the fewer."""


@dataclass(frozen=True, slots=True)
class Clean:
    """Rows [begin, end) of a kernel's columns. `octets`: of the block, where `columns.offset` counts."""

    columns: FrameColumns
    octets: Octets
    begin: int
    end: int


Stretch = Clean | list[Event]
"""Rows that follow one another: by columns, or events of the reference framer."""


_REQUEST = ROLES.index(Role.REQUEST)


class BulkFraming:
    """Blocks in, stretches of rows out; the same rows as the reference framer alone gives."""

    def __init__(
        self,
        dissector: Dissector,
        timing: Timing,
        framer: Framer | None = None,
        before: int | None = None,
        held: int = 0,
    ) -> None:
        """`framer`: to go on with, which has taken octets and still holds so many; the nominal end of the newest of
        them was `before`, ns."""
        self._dissector = dissector
        self._timing = timing
        self._framer: Framer = framer if framer is not None else dissector.framer(timing)
        remembers = isinstance(self._framer, Remembering)  # asked once: all framers of a protocol are of one kind
        self._primed = cast(Remembering, self._framer).primed if remembers else None
        self._known = 0  # octets handed to the framer whose events were given already
        self._given = -held  # octets of the stream that are in rows; it begins with the first block
        self._base = 0  # octets of the stream before the block at work
        self._before = before  # nominal end of the newest octet

    @property
    def framer(self) -> Framer:
        """The reference framer, which has read all that came."""
        return self._framer

    @property
    def held(self) -> int:
        """Octets that are in no row yet."""
        return self._base - self._given

    def take(self, block: Block) -> list[Stretch]:
        """Take the reads that follow; give the rows that are certain by now."""
        if self._dissector.kernel is None or len(block.reads.octets) < LEAST:
            stretches = self._one_by_one(block)
        else:
            stretches = _Work(self, block, replace(block.reads, before=self._before)).run()
        self._base += len(block.reads.octets)
        last = int(block.reads.times.max())
        self._before = last if self._before is None else max(self._before, last)
        return stretches

    def _one_by_one(self, block: Block) -> list[Stretch]:
        events = [event for chunk in block.chunks() for event in self._framer.feed(chunk)]
        self._given += sum(len(event.octets) for event in events)
        return [events] if events else []

    def advance(self, now: int) -> list[Event]:
        """Say that no read returned up to `now` (ns); what the silence completes."""
        return self._of_end(self._framer.advance(now))

    def deadline(self) -> int | None:
        """When silence will mean something next (ns), or None when it never will."""
        return self._framer.deadline()

    def close(self) -> list[Stretch]:
        """End of the capture, or of its settings: everything still held."""
        events = self._of_end(self._framer.close())
        return [events] if events else []

    def _of_end(self, events: list[Event]) -> list[Event]:
        """Events between two blocks, where the framer has given all that was known before."""
        self._given += sum(len(event.octets) for event in events)
        return events

    def _fresh(self, events: Sequence[Event]) -> list[Event]:
        """Those of the framer's events that were not given already."""
        if not self._known:
            return list(events)
        fresh = []
        for event in events:
            if self._known > 0:
                self._known -= len(event.octets)
            else:
                fresh.append(event)
        if self._known < 0:  # an event over the end of the chain: the framer makes something else of it
            raise _AnotherReadingError
        return fresh


class _AnotherReadingError(Exception):
    """A framer that was handed the last rows of a chain goes over its end."""


@dataclass(frozen=True, slots=True)
class _TakenUp:
    """A chain that was taken up behind `row`, up to `end`, as the stretch of that number; and what the reference had
    come to: its framer, which had been fed up to `fed`, and the events that it had given behind the row."""

    row: int
    end: int
    stretch: int
    framer: Framer
    following: list[Event]
    fed: int


class _Work:
    """One block on its way."""

    def __init__(self, framing: BulkFraming, block: Block, reads: Reads) -> None:
        self._framing = framing
        self._block = block
        self._reads = reads
        self._begins = reads.begins
        self._size = len(reads.octets)
        kernel = framing._dissector.kernel
        self._columns = kernel(reads, framing._timing) if kernel is not None and _is_forward(reads) else None
        self._last: Times | None = None
        if self._columns is not None and len(self._columns):
            self._columns, self._last = _chains(self._columns, self._size - MARGIN)
        self._stretches: list[Stretch] = []
        self._events: list[Event] = []
        self._newest: _TakenUp | None = None
        self._doubted = 0  # no chain is taken up before this place

    def run(self) -> list[Stretch]:
        """All stretches of the block."""
        framing = self._framing
        at = 0
        while at < self._size or framing._known:
            if at >= self._size:  # the framer has not said of all rows of the chain that it makes the same of them
                at = self._give_back()
                continue
            chunk, at = self._part(at, self._size)
            try:
                fresh = framing._fresh(framing._framer.feed(chunk))
            except _AnotherReadingError:
                at = self._give_back()
                continue
            jump = self._take_events(fresh, at)
            if jump is not None:
                at = jump
        self._end_events()
        return self._stretches

    def _take_events(self, events: list[Event], fed: int) -> int | None:
        """Keep events of a framer that has been fed up to a place of the block; where a chain is taken up, the place in
        the block where it ends."""
        framing = self._framing
        for number, event in enumerate(events, 1):
            begin = framing._given - framing._base
            framing._given += len(event.octets)
            self._events.append(event)
            if begin >= self._doubted and isinstance(event, Frame) and event.ok and self._columns is not None:
                row = int(np.searchsorted(self._columns.offset, begin))
                if row < len(self._columns) and self._columns.offset[row] == begin:
                    end = self._take_up(row, fed, events, number)
                    if end is not None:
                        return end
        return None

    def _take_up(self, row: int, fed: int, events: list[Event], number: int) -> int | None:
        """Take up the chain behind a row that the reference gave, as the last of the first `number` of some events."""
        columns, last = self._columns, self._last
        assert columns is not None
        assert last is not None
        end = int(last[row]) + 1
        if end - row - 1 < SHORTEST or columns.length[row] != len(events[number - 1].octets):
            return None
        if int(columns.offset[end - 1]) + int(columns.length[end - 1]) <= fed:  # the framer has read it all already
            return None
        earlier = self._framing._framer
        for primed in (self._framing._primed or PRIMED, MANY, end - row):
            first = self._with_request(row, max(row, end - primed), number == len(events))
            if first is not None and self._prime(slice(row + 1, max(row + 1, first)), slice(first, end)):
                self._end_events()
                self._newest = _TakenUp(row, end, len(self._stretches), earlier, events[number:], fed)
                self._stretches.append(Clean(columns, self._reads.octets, row + 1, end))
                stop = int(columns.offset[end - 1]) + int(columns.length[end - 1])
                self._framing._given = self._framing._base + stop
                return stop
        return None

    def _with_request(self, row: int, first: int, is_newest: bool) -> int | None:
        """From which row on a framer that remembers is to be handed rows: the last request up to `first`, so that it
        knows what an answer answers. Where there is none, from the one behind `row`, with what the earlier framer waits
        for; None where that one has gone on already."""
        columns = self._columns
        assert columns is not None
        if self._framing._primed is None:
            return first
        asked = np.flatnonzero(columns.role[row : first + 1] == _REQUEST)
        if len(asked):
            return row + int(asked[-1])
        return row + 1 if is_newest else None

    def _give_back(self) -> int:
        """Let the reference read the newest chain after all; where it goes on in the block."""
        columns, framing, newest = self._columns, self._framing, self._newest
        assert columns is not None
        assert newest is not None
        self._doubted = int(columns.offset[newest.end - 1]) + int(columns.length[newest.end - 1])
        del self._stretches[newest.stretch :]
        self._events = newest.following
        framing._framer, framing._known = newest.framer, 0
        behind = int(columns.offset[newest.row]) + int(columns.length[newest.row])
        framing._given = framing._base + behind + sum(len(event.octets) for event in newest.following)
        return newest.fed

    def _prime(self, known: slice, handed: slice) -> bool:
        """Put a new framer behind rows of the kernel, of which it is handed the last; whether it makes the same of them
        so far. `known`: those before them, which it may learn from."""
        columns, framing = self._columns, self._framing
        assert columns is not None
        framer = framing._dissector.framer(framing._timing)
        if framing._primed is not None:
            cast(Remembering, framer).remember(framing._framer, columns, self._reads.octets, known.start, known.stop)
        lengths = columns.length[handed].tolist()
        begin = int(columns.offset[handed.start])
        stop = int(columns.offset[handed.stop - 1]) + lengths[-1]
        at, events = begin, []
        while at < stop:
            chunk, at = self._part(at, stop)
            events += framer.feed(chunk)
        if any(len(event.octets) != length for event, length in zip(events, lengths, strict=False)):
            return False
        framing._framer = framer
        framing._known = stop - begin - sum(len(event.octets) for event in events)
        return framing._known >= 0

    def _part(self, at: int, stop: int) -> tuple[Chunk, int]:
        """The read that holds octet `at`, from there on and before `stop`, and where it ends."""
        begins, reads = self._begins, self._reads
        index = int(np.searchsorted(begins, at, side="right")) - 1
        begin, whole = int(begins[index]), int(begins[index + 1])
        end = min(whole, stop)
        marks = self._block.marks.get(index, ())
        if marks and (at, end) != (begin, whole):
            marks = tuple(
                replace(m, offset=m.offset - at + begin) for m in marks if at - begin <= m.offset < end - begin
            )
        time = int(reads.times[index]) - (whole - end) * self._framing._timing.char
        before = int(reads.times[index - 1]) if index else reads.before
        if end < whole and before is not None:  # it came since the read before, however many octets it holds
            time = max(time, before)
        return Chunk(time, reads.octets[at:end].tobytes(), marks), end

    def _end_events(self) -> None:
        if self._events:
            self._stretches.append(self._events)
            self._events = []


def _is_forward(reads: Reads) -> bool:
    """Whether times never run backwards: what a framer makes of that depends on all of the past."""
    return (reads.before is None or int(reads.times[0]) >= reads.before) and bool((np.diff(reads.times) >= 0).all())


def _chains(columns: FrameColumns, limit: int) -> tuple[FrameColumns, Times]:
    """The rows that end at or before `limit`, and for each the index of the last row of its chain."""
    columns = columns.take(slice(0, int(np.searchsorted(columns.offset + columns.length, limit, side="right"))))
    if not len(columns):
        return columns, np.zeros(0, np.int64)
    begins = np.flatnonzero(~columns.chained)
    ends = np.append(begins[1:], len(columns)) - 1
    return columns, np.repeat(ends, np.diff(np.append(begins, len(columns))))
