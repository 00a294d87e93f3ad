"""Load and trouble over the time of a capture, in at most MOST_PARTS equal parts whatever its length. Pure."""

from __future__ import annotations

from dataclasses import dataclass, field

from dissectors.frame import Frame
from dissectors.tracker import Transaction, Verdict
from sniff.engine.engine import Output, Row
from sniff.engine.session import LineEvent

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
