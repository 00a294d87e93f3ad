"""The syncing thread of a recorder: has the system write files to the disk, so that writing never waits for that.

A disk may need seconds for it (memory cards, network shares). Octets that the system has taken meanwhile survive the
death of this process; only a power cut can lose them.
"""

from __future__ import annotations

import contextlib
import os
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue
from typing import BinaryIO

from sniff.formats.files import explain

MOST_WAITING = 16
"""Syncs of open files that wait for the one that runs; more would say nothing new."""


@dataclass(frozen=True, slots=True)
class _Sync:
    """A file to be synced, then closed if `last`; without a stream a folder."""

    name: str
    stream: BinaryIO | None
    last: bool = False


class Syncer:
    """Syncs in a thread of its own, in order. `trouble`: what the disk said last, in words; None while all is well."""

    def __init__(self) -> None:
        self.trouble: str | None = None
        self._orders: SimpleQueue[_Sync | None] = SimpleQueue()
        self._since: int | None = None
        self._thread = threading.Thread(target=self._run, name="syncer", daemon=True)
        self._thread.start()

    def sync(self, name: object, stream: BinaryIO, last: bool = False) -> None:
        """Sync a file. `last`: and close it, for nothing more is written to it."""
        if last or self._orders.qsize() < MOST_WAITING:
            self._orders.put(_Sync(str(name), stream, last))

    def sync_folder(self, path: Path) -> None:
        """Have the system write down that a file is there, as far as it can."""
        self._orders.put(_Sync(str(path), None))

    def end(self) -> None:
        """Nothing more will come."""
        self._orders.put(None)

    @property
    def busy(self) -> int:
        """For how long the sync that runs has been running, ns; 0 while none does."""
        since = self._since
        return 0 if since is None else time.monotonic_ns() - since

    def wait(self, seconds: float) -> bool:
        """After `end`: wait until all is done, at most so long; whether it is."""
        self._thread.join(seconds)
        return not self._thread.is_alive()

    def _run(self) -> None:
        while (order := self._orders.get()) is not None:
            self._since = time.monotonic_ns()
            try:
                _do(order)
            except OSError as error:
                self.trouble = str(explain(order.name, error))
            except ValueError:  # closed by somebody who gave up
                pass
            else:
                self.trouble = None
            if order.stream is not None and order.last:
                with contextlib.suppress(OSError):
                    order.stream.close()
            self._since = None


def _do(order: _Sync) -> None:
    """Raises OSError for a file; a folder cannot be synced everywhere (never on Windows)."""
    if order.stream is not None:
        order.stream.flush()
        os.fsync(order.stream.fileno())
        return
    with contextlib.suppress(OSError):
        descriptor = os.open(order.name, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
