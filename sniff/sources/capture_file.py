"""A capture as a source: what was recorded comes again, with its own times."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

from dissectors.line import LineSettings
from sniff.engine.capture import CaptureError
from sniff.engine.session import Adapter, Item, LineEvent, LineEventKind, Session
from sniff.formats import read
from sniff.formats.files import explain
from sniff.formats.table import suffixes
from sniff.sources import PortError
from sniff.sources.clock import Clock

AT_ONCE = 256
"""Items given by one read."""


class CaptureFileSource:
    """Plays a capture. `speed`: 1 as it was, 2 twice as fast, None as fast as it is read.

    Items keep the times of the file, so `now` is on its clock, not on the one that paces it. Raises PortError when it
    cannot be opened; a file that turns out to be damaged ends there, with a NOTE that says why.
    """

    def __init__(self, path: str, clock: Clock, speed: float | None = 1.0) -> None:
        if speed is not None and not speed > 0:
            raise PortError(f"{path}: speed {speed}: expected more than 0")
        try:
            capture = read(path)
            self._items: Iterator[Item] = capture.items()
            self._next = next(self._items, None)
        except (CaptureError, OSError) as error:
            named = path.lower().endswith(suffixes())
            said = explain(path, error) if isinstance(error, OSError) else error
            raise PortError(str(said) if named else f"{path}: a file, not a serial port; {said}") from error
        self.session: Session = capture.session
        self._clock = clock
        self._speed = speed
        self._closed = False
        self._began = clock.now()
        self._first = self._now = self._next.time if self._next is not None else self.session.started

    @property
    def session_adapter(self) -> Adapter:
        """The adapter that the capture was made with."""
        return self.session.adapter

    @property
    def ended(self) -> bool:
        """Whether all has been given."""
        return self._closed or self._next is None

    def fileno(self) -> int | None:
        """A file has nothing to wait on."""
        return None

    def deadline(self) -> int | None:
        """When the next item is due."""
        return None if self._next is None or self._closed else self._due(self._next)

    def now(self) -> int:
        """The time of the file that has been reached: never beyond what is still to be given."""
        if self._speed is None or self._next is None or self._closed:
            return self._now
        paced = self._first + int((self._clock.now() - self._began) * self._speed)
        return max(self._now, min(paced, self._next.time - 1))

    def read(self) -> list[Item]:
        """What is due, at most some hundred items."""
        if self._closed:
            return []
        items = list(islice(self._take_due(), AT_ONCE))
        if items:
            self._now = max(self._now, items[-1].time)
        return items

    def reconfigure(self, line: LineSettings) -> None:
        """What was recorded cannot be read with other settings. Raises PortError."""
        raise PortError(f"a capture cannot be changed to {line}: its octets were read as {self.session.line}")

    def close(self) -> None:
        """Stop playing."""
        self._closed = True

    def _take_due(self) -> Iterator[Item]:
        now = self._clock.now()
        while self._next is not None and self._due(self._next) <= now:
            item = self._next
            try:
                self._next = next(self._items, None)
            except (CaptureError, OSError) as error:
                self._next = None
                yield from (item, LineEvent(item.time, LineEventKind.NOTE, f"ends here: {error}"))
                return
            yield item

    def _due(self, item: Item) -> int:
        if self._speed is None:
            return self._began
        return self._began + int((item.time - self._first) / self._speed)
