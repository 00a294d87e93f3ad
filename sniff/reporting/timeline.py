"""Load and trouble over the time of a capture, in at most MOST_PARTS equal parts whatever its length. Pure."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from dissectors.frame import Frame
from dissectors.tracker import Transaction, Verdict
from sniff.engine.engine import Output, Row
from sniff.engine.session import LineEvent

if TYPE_CHECKING:
    from dissectors.columns import Masks, Numbers, Times
    from sniff.engine.table import Table

MOST_PARTS = 240
FIRST_WIDTH = 100_000_000
"""ns of a part at first; doubled whenever there would be too many of them."""

FAILED = frozenset((Verdict.NO_RESPONSE, Verdict.LATE, Verdict.DAMAGED_ANSWER, Verdict.DAMAGED_REQUEST))


@dataclass(slots=True)
class TimelinePart:
    """One part of the time. `busy`: ns with octets on the wire; `noise`: octets; the others are counts."""

    busy: int = 0
    damaged: int = 0
    noise: int = 0
    failed: int = 0
    exceptions: int = 0
    line_errors: int = 0

    def plus(self, other: TimelinePart) -> TimelinePart:
        """Both together."""
        return TimelinePart(
            self.busy + other.busy,
            self.damaged + other.damaged,
            self.noise + other.noise,
            self.failed + other.failed,
            self.exceptions + other.exceptions,
            self.line_errors + other.line_errors,
        )


@dataclass(slots=True)
class Timeline:
    """Parts by number, each `width` ns: part n begins at n · `width` of the capture's clock, so that the parts of two
    stretches are the same parts. `char`: ns an octet takes."""

    char: int
    width: int = FIRST_WIDTH
    parts: dict[int, TimelinePart] = field(default_factory=dict)

    @property
    def origin(self) -> int | None:
        """When the first part begins, ns; None before there is one."""
        return min(self.parts) * self.width if self.parts else None

    def add(self, output: Output) -> None:
        """Take what the engine gave; what a search heard with other settings is left out."""
        for row in output.rows:
            if row.searched is None:
                self.add_row(row)
        for transaction in output.transactions:
            self.add_transaction(transaction)

    def add_table(self, table: Table) -> None:
        """Take many rows at once; the same comes of it."""
        import numpy as np

        from dissectors.columns import VERDICTS

        heard, odd = table.heard, table.odd
        for row in odd.values():
            if row.searched is None:
                self.add_row(row)
        plain = heard.copy()
        plain[list(odd)] = False
        self._add_plain(table.frames.end[plain], table.frames.length[plain], table.good[plain])
        counted = np.array([verdict in FAILED or verdict is Verdict.EXCEPTION for verdict in VERDICTS])
        for place in np.flatnonzero(counted[table.transactions.verdict]).tolist():
            self.add_transaction(table.transaction(place))

    def _add_plain(self, ends: Times, lengths: Numbers, good: Masks) -> None:
        """Count frames without line errors."""
        import numpy as np

        if not len(ends):
            return
        starts = ends - lengths.astype(np.int64) * self.char
        for outermost in (int(ends.max()), int(starts.min())):
            self._part(outermost)  # as wide as it takes to hold both
        ended, began = ends // self.width, starts // self.width
        inside = (ends - 1) // self.width == began
        base, count = int(began.min()), int(ended.max() - began.min()) + 1
        damaged = np.bincount(ended - base, ~good, count)
        busy = np.bincount((began - base)[inside], (ends - starts)[inside], count)
        for number in np.union1d(ended, began[inside]).tolist():
            part = self._part(number * self.width)
            part.damaged += int(damaged[number - base])
            part.busy += int(busy[number - base])
        for begin, end in zip(starts[~inside].tolist(), ends[~inside].tolist(), strict=True):
            self._spread(begin, end)

    def add_line_event(self, event: LineEvent) -> None:
        """Nothing of it is counted here."""

    def add_row(self, row: Row) -> None:
        """Count one row: its octets where they were on the wire, its trouble where it ended."""
        event = row.event
        part = self._part(event.end)
        if isinstance(event, Frame):
            part.damaged += not event.ok
        else:
            part.noise += len(event.octets)
        part.line_errors += len(event.marks)
        self._spread(event.end - len(event.octets) * self.char, event.end)

    def add_transaction(self, transaction: Transaction) -> None:
        """Count one closed transaction where it began."""
        if transaction.verdict in FAILED:
            self._part(transaction.start).failed += 1
        elif transaction.verdict is Verdict.EXCEPTION:
            self._part(transaction.start).exceptions += 1

    def merge(self, later: Timeline) -> Timeline:
        """Both together, as a new value."""
        whole = Timeline(self.char)
        for one in (self, later):
            for number, part in one.parts.items():
                whole._widen(one.width)
                whole._put(number * one.width // whole.width, part)
        return whole

    def listed(self) -> list[TimelinePart]:
        """All parts from the first to the last, empty ones too."""
        if not self.parts:
            return []
        return [self.parts.get(number, TimelinePart()) for number in range(min(self.parts), max(self.parts) + 1)]

    def _spread(self, start: int, end: int) -> None:
        while start < end:
            part = self._part(start)
            edge = min(end, (start // self.width + 1) * self.width)
            part.busy += edge - start
            start = edge

    def _part(self, time: int) -> TimelinePart:
        """The part that holds a time."""
        number = time // self.width
        part = self.parts.get(number)
        return self._put(number, TimelinePart()) if part is None else part

    def _put(self, number: int, part: TimelinePart) -> TimelinePart:
        """Count a part as one of ours; the part of ours that holds it by then."""
        time = number * self.width
        self.parts[number] = self.parts.get(number, TimelinePart()).plus(part)
        while max(self.parts) - min(self.parts) >= MOST_PARTS:
            self._widen(self.width * 2)
        return self.parts[time // self.width]

    def _widen(self, width: int) -> None:
        """Draw parts together until they are at least so wide; `width` is ours, or ours doubled some times."""
        if width <= self.width:
            return
        before, times, self.width = self.parts, width // self.width, width
        self.parts = {}
        for number, part in before.items():
            at = number // times
            self.parts[at] = self.parts.get(at, TimelinePart()).plus(part)
