"""A token ring's observer alone, without the judge that watches it too: fed what an engine gives, asked what is new."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import TYPE_CHECKING

from dissectors.token_ring import RingObserver, RingWindow, WatchesColumns
from sniff.engine.engine import Output
from sniff.engine.session import LineEvent

if TYPE_CHECKING:
    from sniff.engine.table import Table


class WatchedRing:
    """The ring's observer, handed rows without their transactions."""

    def __init__(self, observer: RingObserver) -> None:
        self.observer = observer
        self._ahead: deque[RingWindow] = deque()

    def add(self, output: Output) -> None:
        """Take rows but those of a search for settings."""
        for row in output.rows:
            if row.searched is None:
                self.observer.see(row.no, row.event, row.header)

    def add_table(self, table: Table) -> None:
        """The same of many rows."""
        if isinstance(self.observer, WatchesColumns) and table.heard.all():
            self.observer.take(table)
        else:
            for output in table.outputs():
                self.add(output)

    def add_ahead(self, table: Table, stops: Sequence[tuple[int, int]]) -> bool:
        """Take a table all at once, to be asked what is new before each of `stops` (numbers of rows, and the end of all
        before it, ns) in their order; whether that can be."""
        if not isinstance(self.observer, WatchesColumns):
            return False
        self.add_table(table)
        self._ahead += self.observer.windows(stops)
        return True

    def window(self) -> RingWindow:
        """What is new since this was called the last time."""
        return self._ahead.popleft() if self._ahead else self.observer.window()

    def add_line_event(self, event: LineEvent) -> None:
        """Where octets were lost, what is missing says nothing."""
        if event.kind.is_hole:
            self.observer.miss(event.time)
