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
class Part:
    """One part of the time. `busy`: ns with octets on the wire; `noise`: octets; the others are counts."""

    busy: int = 0
    damaged: int = 0
    noise: int = 0
    failed: int = 0
    exceptions: int = 0
    line_errors: int = 0

    def add(self, other: Part) -> None:
        """Take in the part that follows."""
        self.busy += other.busy
        self.damaged += other.damaged
        self.noise += other.noise
        self.failed += other.failed
        self.exceptions += other.exceptions
        self.line_errors += other.line_errors


@dataclass(slots=True)
class Timeline:
    """Parts by number, counted from `origin`, ns: where the first row began; None before there is one. `char`: ns an
    octet takes. Times before the origin count as it."""

    char: int
    origin: int | None = None
    width: int = FIRST_WIDTH
    parts: dict[int, Part] = field(default_factory=dict)
    _most: int = 0

    def add(self, output: Output) -> None:
        """Take what the engine gave; what a search heard with other settings is left out."""
        for row in output.rows:
            if row.searched is None:
                self.add_row(row)
        if self.origin is not None:
            for transaction in output.transactions:
                self.add_transaction(transaction)

    def add_table(self, table: Table) -> None:
        """Take many rows at once; the same comes of it."""
        import numpy as np

        from dissectors.columns import VERDICTS

        heard, odd = table.heard, table.odd
        if self.origin is None:
            if not heard.any():
                return
            first = int(heard.argmax())
            self.origin = odd[first].event.start if first in odd else int(table.frames.start[first])
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

        origin = self.origin or 0
        if not len(ends):
            return
        self._part(max(int(ends.max()), origin))  # as many halvings as it takes
        ends = np.maximum(ends - origin, 0)
        starts = np.maximum(ends - lengths.astype(np.int64) * self.char, 0)
        at, began = ends // self.width, starts // self.width
        inside = (np.maximum(ends - 1, starts) // self.width == began) & (starts < ends)
        whole = {
            "damaged": np.bincount(at, ~good, int(at.max()) + 1),
            "busy": np.bincount(began[inside], (ends - starts)[inside], int(at.max()) + 1),
        }
        touched = np.unique(np.concatenate([at, began[inside]])).tolist()
        for number in touched:
            part = self._part(origin + number * self.width)
            part.damaged += int(whole["damaged"][number])
            part.busy += int(whole["busy"][number])
        for begin, end in zip(starts[~inside].tolist(), ends[~inside].tolist(), strict=True):
            self._spread(origin + begin, origin + end)

    def add_line_event(self, event: LineEvent) -> None:
        """Nothing of it is counted here."""

    def add_row(self, row: Row) -> None:
        """Count one row: its octets where they were on the wire, its trouble where it ended."""
        event = row.event
        if self.origin is None:
            self.origin = event.start
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

    def listed(self) -> list[Part]:
        """All parts from the first to the last, empty ones too."""
        return [self.parts.get(number, Part()) for number in range(self._most + 1)] if self.parts else []

    def _spread(self, start: int, end: int) -> None:
        origin = self.origin or 0
        start, end = max(start, origin), max(end, origin)
        while start < end:
            edge = min(end, origin + ((start - origin) // self.width + 1) * self.width)
            self._part(start).busy += edge - start
            start = edge

    def _part(self, time: int) -> Part:
        offset = max(0, time - (self.origin or 0))
        while offset // self.width >= MOST_PARTS:
            self._halve()
        number = offset // self.width
        self._most = max(self._most, number)
        part = self.parts.get(number)
        if part is None:
            part = self.parts[number] = Part()
        return part

    def _halve(self) -> None:
        before, self.parts = self.parts, {}
        self.width *= 2
        self._most //= 2
        for number, part in sorted(before.items()):
            kept = self.parts.get(number // 2)
            if kept is None:
                self.parts[number // 2] = part
            else:
                kept.add(part)
