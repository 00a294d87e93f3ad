"""The source of rows from a capture file: its first rows at once, the others while one looks at them.

A thread reads, takes frames out and packs them; the store takes what it has made in small bites, between two keys. The
rules come last: what they find is final when all rows are judged.
"""

from __future__ import annotations

import contextlib
import queue
import sys
import threading
import time
from collections.abc import Iterator
from io import FileIO
from pathlib import Path
from typing import Any

from dissectors.profiles import Devices
from sniff.analysis.site_ear import SiteEar
from sniff.bus.closings_ahead import look_ahead
from sniff.bus.feed import FeedStatus
from sniff.bus.prepared import Prepared, prepare
from sniff.bus.row_source import rows_that_fit
from sniff.bus.rows import Store
from sniff.bus.second_protocol import ForeignFrames
from sniff.engine.blocks import in_pieces
from sniff.engine.bulk import tables
from sniff.engine.capture import Capture, CaptureError
from sniff.engine.follow_settings import dissector_for
from sniff.engine.packed_table import PackedTable
from sniff.engine.read_source import stored_tables
from sniff.engine.session import LineEvent, Session
from sniff.engine.table import Table
from sniff.formats.files import watched
from sniff.formats.mark_file import MarksBeside, mark_event, mark_file, place_of

FIRST_READS, READS = 512, 16_384
"""Reads that are taken together, at first and later."""
AT_FIRST = 0.05
"""Seconds that the first poll may spend on reading: small files are read then."""
SLICE = 0.012
"""Seconds that one piece of work may take, so that a key never waits for it."""
WAITING = 8
"""Pieces that the thread may be ahead by."""
LEAST_JUDGED = 32
SWITCHED, SWITCHING = sys.getswitchinterval(), 0.001
"""Seconds after which the thread gives way; while a file is read, a key waits for that several times."""
UNASKED = 0.5
"""Seconds after which a file that was read is asked for a second protocol: the screen comes first."""
PACKED_ROWS = 1024
"""Rows from which on a piece is packed at once."""

Piece = Prepared | LineEvent


class FileFeed:
    """A capture file, read on until its end. `buses`: how many share the memory."""

    def __init__(
        self, path: str, capture: Capture, session: Session, devices: Devices | None = None, buses: int = 1
    ) -> None:
        self.path = path
        self.capture = capture
        rows, ear = rows_that_fit(buses), SiteEar() if buses > 1 else None
        self._store = Store(session, dissector_for(session), rows, devices, judge_later=True, ear=ear)
        self._foreign = ForeignFrames(session)
        self._second: tuple[str, int] = "", 0
        self._unasked: list[Table] = []  # for a second protocol
        self._reads_at_once = True
        self._asking: threading.Timer | None = None
        self._pieces = self._read(session)
        self._thread: threading.Thread | None = None
        self._queue: queue.Queue[Piece | BaseException | None] = queue.Queue(WAITING)
        self._stopped = threading.Event()
        self._reading = True
        self._ended = ""
        self._polled = -1  # version of the store at the last poll
        self._at_once = LEAST_JUDGED  # rows that are judged in one slice
        self._progress = Progress()
        self._place = place_of(path, capture)
        self._beside = None if self._place is None else MarksBeside(self._place.file, self._place.bus)
        if self._beside is not None:
            self._beside.changes()  # they stand in the capture
        self._size = sum(map(_size, getattr(capture, "parts", [capture]))) or _size(path)

    @property
    def store(self) -> Store:
        """The rows so far."""
        return self._store

    def poll(self) -> bool:
        """Take what has been read; whether anything changed since the last time."""
        if self._polled < 0:
            self._begin()
        self._work()
        for mark in self._beside.changes() if self._beside is not None else ():
            self._store.add_mark(mark)  # which somebody else wrote, who looks at the same file
        changed = self._store.version != self._polled or self._polled < 0
        self._polled = self._store.version
        return changed

    def work(self) -> bool:
        """Take what has been read, or judge some rows; whether more is left."""
        if self._polled >= 0:
            self._work()
        return self._reading or not self._store.all_judged

    def _work(self) -> None:
        end = time.perf_counter() + SLICE
        while self._reading and time.perf_counter() < end:
            try:
                self._take(self._queue.get_nowait())
            except queue.Empty:
                return
        while not self._reading and not self._store.all_judged and (left := end - time.perf_counter()) > 0:
            begin = time.perf_counter()
            self._store.judge(self._at_once)
            took = max(1e-6, time.perf_counter() - begin)
            most = max(LEAST_JUDGED, int(self._at_once * SLICE / took))
            self._at_once = min(most, 2 * self._at_once)
            if took > left / 2:
                return

    def _take(self, piece: Piece | BaseException | None) -> None:
        if isinstance(piece, Prepared):
            self._store.add_prepared(piece)
        elif isinstance(piece, LineEvent):
            self._store.add_line_event(piece)
        else:
            self._reading = False
            sys.setswitchinterval(SWITCHED)
            self._asking = threading.Timer(UNASKED, self._ask_for_second) if self._store.error_total else None
            if self._asking is not None:
                self._asking.daemon = True
                self._asking.start()
            self._store.version += 1
            if isinstance(piece, CaptureError):  # what was read before it stays
                self._ended = str(piece)
            elif piece is not None:
                raise piece

    # -- reading -----------------------------------------------------------------------------------------------

    def _begin(self) -> None:
        """Read on at once for a while; what is left is for a thread."""
        self._store.version += 1
        until = time.perf_counter() + AT_FIRST
        with watched(self._progress.see):
            for piece in self._pieces:
                self._take(piece)
                if time.perf_counter() >= until or not self._reading:
                    break
        self._reads_at_once = False
        if self._reading:
            sys.setswitchinterval(SWITCHING)
            self._thread = threading.Thread(target=self._go_on, name="reading", daemon=True)
            self._thread.start()

    def _go_on(self) -> None:
        with watched(self._progress.see):
            for piece in self._pieces:
                while not self._stopped.is_set():
                    with contextlib.suppress(queue.Full):
                        self._queue.put(piece, timeout=0.2)
                        break
                else:
                    return

    def _read(self, session: Session) -> Iterator[Piece | BaseException | None]:
        """All that is in the file; last why it ends, None where all is well."""
        try:
            before: PackedTable | None = None
            for item in self._tables(session):
                if isinstance(item, LineEvent):
                    yield item
                    continue
                self._unasked.append(item)
                if not self._reads_at_once:
                    self._see()
                prepared = prepare(item, pack=len(item) >= PACKED_ROWS)
                if before is not None:
                    look_ahead(before, prepared.packed)
                before = prepared.packed
                yield prepared
            if before is not None:
                look_ahead(before, None)
            complete = self.capture.completeness()
            yield None if complete.whole else CaptureError(complete.text)
        except Exception as error:  # of the thread: whoever polls raises it
            yield error

    def _tables(self, session: Session) -> Iterator[Table | LineEvent]:
        held = stored_tables(self.capture, session)
        if held is None:
            yield from tables(in_pieces(self.capture.blocks(), FIRST_READS, READS), session)
            return
        for item in held:
            if isinstance(item, LineEvent):
                yield item
            else:
                yield from item.parts([*range(0, len(item), READS), len(item)] if len(item) else [0, 0])

    def _see(self) -> None:
        """Look for a second protocol; of a thread, for all protocols have to be imported when it is asked for."""
        unasked, self._unasked = self._unasked, []
        for table in unasked:
            self._foreign.add_table(table)

    def _ask_for_second(self) -> None:
        """Whether there is a second protocol."""
        self._see()
        told = self._foreign.told()
        if told is not None:
            self._second = told[0].name, told[1]

    # -- how things stand --------------------------------------------------------------------------------------

    def status(self) -> FeedStatus:
        """Where the file ends, once it has been read."""
        store = self._store
        session = store.session
        return FeedStatus(
            self.path,
            session.line_words,
            session.protocol_words,
            file_size=self._size,
            ended=self._ended,
            reading=self._reading,
            second=self._second[0],
            foreign=self._second[1],
            since=self._foreign.since,
            read=self._progress.share(self._size) if self._reading else 1.0,
            judged=1.0 if store.all_judged and not self._reading else min(0.99, store.judged / max(1, store.last_no)),
        )

    def mark(self, time: int, text: str | None) -> str:
        """Write it beside the file, which stays as it is."""
        self._store.add_mark(mark_event(time, text))
        if self._beside is None or self._place is None:
            return "until this view ends: no single file is shown"
        self._beside.add(time, text)
        return f"in {mark_file(self._place.file)}"

    def close(self) -> None:
        """Have the thread end."""
        self._stopped.set()
        if self._asking is not None:
            self._asking.cancel()
        sys.setswitchinterval(SWITCHED)
        if self._thread is not None:
            self._thread.join(2.0)


class Progress:
    """How far the files of a capture have been read."""

    def __init__(self) -> None:
        self._before = 0
        self._stream: FileIO | None = None

    def see(self, stream: FileIO) -> None:
        """The next file is opened."""
        self._before += 0 if self._stream is None else _size(self._stream.name)
        self._stream = stream

    def share(self, size: int) -> float | None:
        """Of files of `size` octets, 0 … 1; None at the end of the last of them: what is left is in memory."""
        try:
            seen = self._before + (0 if self._stream is None else self._stream.tell())
        except (ValueError, OSError):  # closed by now
            return None
        return seen / size if seen < size else None


def _size(file: Any) -> int:
    """Octets of a file, or of what was read from one; 0 where nobody knows."""
    try:
        return Path(getattr(file, "path", file)).stat().st_size
    except (OSError, TypeError, ValueError):
        return 0
