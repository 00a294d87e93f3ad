"""A recording that another process writes, as a source: what it gets is given about a second later."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from itertools import islice
from typing import Protocol

from dissectors.line import LineSettings
from sniff.engine.capture import CaptureError
from sniff.engine.session import Adapter, Item, LineEvent, LineEventKind, Session
from sniff.sources import PortError
from sniff.sources.clock import Clock

SCHEME = "follow:"
"""What stands before the path in a source's name."""

AT_ONCE = 4096
"""Items given by one read."""

PAUSE = 250_000_000
"""ns between two looks at the file."""


class _Following(Protocol):
    """See `sniff.recording.following.Following`."""

    session: Session
    ended: bool

    def items(self) -> Iterator[Item]: ...


class GrowingRecordingSource:
    """Items keep the times of the file. Raises PortError for what is no recording."""

    def __init__(self, path: str, clock: Clock) -> None:
        try:
            # by its name, as the readers of all formats: sources know files, not the engine behind a recording
            self._file: _Following = import_module("sniff.recording.following").Following(path)
        except (CaptureError, OSError) as error:
            raise PortError(str(error)) from error
        self._clock = clock
        self._items: Iterator[Item] | None = None
        self._due = clock.now()
        self._now: int = self._file.session.started
        self._closed = False

    @property
    def session(self) -> Session:
        """What the recording says of itself."""
        return self._file.session

    @property
    def session_adapter(self) -> Adapter:
        """The adapter that the recording is made with."""
        return self._file.session.adapter

    @property
    def ended(self) -> bool:
        """Whether the recording was closed and all of it given."""
        return self._closed or (self._file.ended and self._items is None)

    def fileno(self) -> int | None:
        """A file has nothing to wait on."""
        return None

    def deadline(self) -> int | None:
        """When to look again."""
        return None if self.ended else self._due

    def now(self) -> int:
        """The time of the file that has been reached."""
        return self._now

    def read(self) -> list[Item]:
        """What has come to be in the file."""
        if self.ended:
            return []
        if self._items is None:
            self._items = self._file.items()
        try:
            items = list(islice(self._items, AT_ONCE))
        except (CaptureError, OSError) as error:
            self._closed = True
            return [LineEvent(self._now, LineEventKind.NOTE, f"ends here: {error}")]
        if len(items) < AT_ONCE:
            self._items = None
            self._due = self._clock.now() + PAUSE
        if items:
            self._now = max(self._now, items[-1].time)
        return items

    def reconfigure(self, line: LineSettings) -> None:
        """What was recorded cannot be read with other settings. Raises PortError."""
        raise PortError(f"a recording cannot be changed to {line}; whoever makes it can")

    def close(self) -> None:
        """Look no more."""
        self._closed = True
