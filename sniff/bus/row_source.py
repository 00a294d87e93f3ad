"""The source of rows from a live bus."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable

from sniff.bus.feed import FeedStatus
from sniff.bus.live import LiveBus
from sniff.bus.rows import KEPT_ROWS, Store
from sniff.capture.ipc import Status
from sniff.engine.engine import Output
from sniff.engine.session import LineEvent
from sniff.engine.table import Table
from sniff.formats.mark_file import MarksBeside, mark_event, mark_file
from sniff.recording.rotation import file_octets

LEAST_ROWS = 100_000
ROW_OCTETS = 120
"""What a row and its share of a transaction take in memory, about."""


def rows_that_fit(buses: int = 1) -> int:
    """Rows of each of so many buses that a quarter of this machine's memory holds together; as many as a store keeps
    where the system does not tell."""
    try:
        memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, OSError, ValueError):  # Windows has no sysconf
        return KEPT_ROWS
    return max(LEAST_ROWS, memory // 4 // ROW_OCTETS // max(1, buses))


class LiveFeed:
    """A running capture. `tell` is called once where closing it waits for a slow disk. `buses`: how many share the
    memory. `follows`: the recording of another process that this is."""

    def __init__(
        self,
        live: LiveBus,
        tell: Callable[[Status], None] = lambda status: None,
        buses: int = 1,
        follows: str = "",
    ) -> None:
        self.live = live
        self._follows = follows
        self._tell = tell
        rows = min(KEPT_ROWS, rows_that_fit(buses))
        self._store = Store(live.session, live.dissector, rows, model=live.model, ear=live.ear)
        self._session = live.session
        self._beside = MarksBeside(follows) if follows else None

    @property
    def store(self) -> Store:
        """The rows so far."""
        return self._store

    def poll(self) -> bool:
        """Take what has come."""
        before = self._store.version
        items = self.live.poll_tables()
        outputs: list[Output] = []
        if self.live.session is not self._session:  # a search has ended
            self._session = self.live.session
            self._store.settle(self.live.session, self.live.dissector)
        for item in items:
            if isinstance(item, Output):
                outputs.append(item)
                continue
            if isinstance(item, Table | LineEvent):
                self._store.add_outputs(outputs)
                outputs = []
            if isinstance(item, Table):
                self._store.add_table(item)
            elif isinstance(item, LineEvent):
                self._store.add_line_event(item)
        self._store.add_outputs(outputs)
        for mark in self._beside.changes() if self._beside is not None else ():
            self._store.add_mark(mark)
        return self._store.version != before

    def work(self) -> bool:
        """There is none: the bus brings what it has to whoever polls."""
        return False

    def status(self) -> FeedStatus:
        """How the capture is doing."""
        status, ended = self.live.status, self.live.ended
        searching = self.live.searching
        return FeedStatus(
            port=self.live.session.port,
            line=self.live.session.line_words,
            protocol=self.live.session.protocol_words,
            recording=None if ended is not None and self.live.file_is_gone else status.path or None,
            file_size=file_octets(self._follows) if self._follows else status.size,
            dropped=self.live.unseen + status.lost,
            live=True,
            ended=ended.reason if ended is not None else "",
            trouble=status.error,
            behind=status.behind,
            priority=status.priority,
            searching="" if searching is None else f"{searching.line}",
            follows=self._follows,
            now=self.live.now,
        )

    def mark(self, time: int, text: str | None) -> str:
        """Have it written into the recording; beside it, where that is another's."""
        if self._beside is not None:
            self._store.add_mark(mark_event(time, text))
            self._beside.add(time, text)
            return f"in {mark_file(self._follows)}"
        self.live.link.mark(self.live.bus, time, text)
        return f"in {self.live.status.path}" if self.live.status.path else "until this view ends: nothing is recorded"

    def close(self) -> None:
        """End the capture and close its file; where a slow disk takes its time, say so, and let Ctrl-C end that."""
        told = False

        def tell() -> None:
            nonlocal told
            status = self.live.status
            if status.closing and status.unwritten and not told:
                told = True
                self._tell(status)

        while self.live.ended is None:
            with contextlib.suppress(KeyboardInterrupt):  # then it is told to stop once more
                self.live.stop(tell)
