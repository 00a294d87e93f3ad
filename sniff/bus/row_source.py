"""What fills the terminal UI: a live bus, or a capture file read in slices, so that the first screen comes at once."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from dissectors.profiles import Devices
from sniff.bus.feed import FeedStatus
from sniff.bus.live import LiveBus
from sniff.bus.offline import outputs
from sniff.bus.rows import KEPT_ROWS, Store
from sniff.capture.wire import Status
from sniff.engine.capture import Capture, CaptureError
from sniff.engine.engine import Output
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import LineEvent, Session

SLICE = 0.05
"""Seconds that one poll may spend on reading a file."""

LEAST_ROWS = 100_000
ROW_OCTETS = 1000
"""What a row and its share of a transaction take in memory, about."""


def rows_that_fit() -> int:
    """Rows that a quarter of this machine's memory holds; as many as a store keeps where the system does not tell."""
    try:
        memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, OSError, ValueError):  # Windows has no sysconf
        return KEPT_ROWS
    return max(LEAST_ROWS, memory // 4 // ROW_OCTETS)


class LiveFeed:
    """A running capture. `tell` is called once where closing it waits for a slow disk."""

    def __init__(self, live: LiveBus, tell: Callable[[Status], None] = lambda status: None) -> None:
        self.live = live
        self._tell = tell
        self._store = Store(live.session, live.dissector, min(KEPT_ROWS, rows_that_fit()), model=live.model)
        self._session = live.session

    @property
    def store(self) -> Store:
        """The rows so far."""
        return self._store

    def poll(self) -> bool:
        """Take what has come."""
        before = self._store.version
        items = self.live.poll()
        if self.live.session is not self._session:  # a search has ended
            self._session = self.live.session
            self._store.settle(self.live.session, self.live.dissector)
        for item in items:
            if isinstance(item, Output):
                self._store.add(item)
            elif isinstance(item, LineEvent):
                self._store.add_line_event(item)
        return self._store.version != before

    def status(self) -> FeedStatus:
        """How the capture is doing."""
        status, ended = self.live.status, self.live.ended
        searching = self.live.searching
        return FeedStatus(
            port=self.live.session.port,
            line=self.live.session.line_words,
            protocol=self.live.session.protocol_words,
            recording=None if ended is not None and self.live.file_is_gone else status.path or None,
            file_size=status.size,
            dropped=self.live.unseen + status.lost,
            live=True,
            ended=ended.reason if ended is not None else "",
            trouble=status.error,
            behind=status.behind,
            priority=status.priority,
            searching="" if searching is None else f"{searching.line}",
        )

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


class FileFeed:
    """A capture file, read on in every poll until its end."""

    def __init__(self, path: str, capture: Capture, session: Session, devices: Devices | None = None) -> None:
        self.path = path
        self.capture = capture
        self._store = Store(session, dissector_for(session), rows_that_fit(), devices)
        self._outputs: Iterator[Output | LineEvent] | None = outputs(capture.items(), session)
        self._ended = ""
        try:
            self._size = Path(path).stat().st_size
        except OSError:
            self._size = 0

    @property
    def store(self) -> Store:
        """The rows so far."""
        return self._store

    def poll(self) -> bool:
        """Read on for a while."""
        if self._outputs is None:
            return False
        until = time.monotonic() + SLICE
        try:
            for output in self._outputs:
                if isinstance(output, Output):
                    self._store.add(output)
                else:
                    self._store.add_line_event(output)
                if time.monotonic() > until:
                    return True
            complete = self.capture.completeness()
            self._ended = "" if complete.whole else complete.text
        except CaptureError as error:  # what was read before it stays
            self._ended = str(error)
        self._outputs = None
        return True

    def status(self) -> FeedStatus:
        """Where the file ends, once it has been read."""
        session = self._store.session
        return FeedStatus(
            self.path,
            session.line_words,
            session.protocol_words,
            file_size=self._size,
            ended=self._ended,
            reading=self._outputs is not None,
        )

    def close(self) -> None:
        """Nothing to stop."""
        self._outputs = None
