"""The rows that the rules have still to see, of those that are kept: in the order of the wire. Pure."""

from __future__ import annotations

from bisect import bisect_left
from collections import deque
from itertools import islice

from sniff.bus.kept_tables import KeptTables
from sniff.engine.session import LineEvent
from sniff.engine.table import Table


class Unjudged:
    """What a model has still to take. `row`, `closed`: the last that it took; `events`: behind which they came."""

    def __init__(self) -> None:
        self.row = 0
        self.closed = 0
        self.events: deque[tuple[int, int, LineEvent]] = deque()

    def next(self, kept: KeptTables, rows: int) -> Table | None:
        """The next rows, at most so many, up to the next event."""
        at = bisect_left(kept.parts, self.row, key=lambda part: part.last)
        for part in islice(kept.parts, at, None):
            if part.last > self.row or part.closed_first + part.closed - 1 > self.closed:
                break
        else:
            return None
        begin = max(0, self.row + 1 - part.first)
        end = min(part.rows, begin + rows)
        if self.events:
            end = max(begin, min(end, self.events[0][0] + 1 - part.first))
        table = kept.table(part).part(begin, end)
        self.row = max(self.row, part.first + end - 1)
        self.closed = part.closed_first + part.closed - 1 if end == part.rows else self.closed + len(table.transactions)
        return table
