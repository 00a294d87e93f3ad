"""A recording that is still being written, read as it grows."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from sniff.engine.session import Item, Session
from sniff.formats.files import open_capture
from sniff.recording import scan
from sniff.recording.messages import MessagePass
from sniff.recording.reader import McapCapture


class Following:
    """One bus of a recording. `ended`: whether its writer has closed it and all of it was given.

    Whole records are taken as they come to be in the file; what was read before is not read again. Raises CaptureError
    for what is no recording.
    """

    def __init__(self, path: str | Path, bus: int = 0) -> None:
        self._capture = McapCapture(Path(path), bus)
        self._joiner = self._capture.joiner()
        self._at: int | None = None
        self._size = 0
        self.ended = False

    @property
    def session(self) -> Session:
        """What the recording says of itself."""
        return self._capture.session

    def items(self) -> Iterator[Item]:
        """What has come since the last time. Raises CaptureError when the file cannot be read any more."""
        with open_capture(self._capture.path) as stream:
            size = os.fstat(stream.fileno()).st_size
            if self.ended or size <= self._size:
                return
            report = scan.Report(size)
            one = MessagePass(stream, report, None, self._at, self._capture.known_topics)
            for head, batch in self._capture.batches_of(one, self._joiner):
                yield from self._joiner.raw(head[1], batch)
            self._at, self._size, self.ended = report.end, size, report.footer
            if self.ended:
                yield from self._joiner.close()
