"""The writing thread of a recorder: owns the files, writes, syncs, rotates, and remembers what went wrong.

Everything comes to it through one queue. Its numbers (`taken`, `lost_octets`, `size`, `trouble`, `paths`) are read by
the capture's thread and written only here.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from queue import SimpleQueue
from typing import BinaryIO

from sniff.formats import CaptureError
from sniff.formats.files import explain
from sniff.recording.batch import Message
from sniff.recording.part import PartFile
from sniff.recording.rotation import NewestParts, Rotation, part_name, parts
from sniff.recording.topics import RAW
from sniff.session import Session

MOST_WAITING = 32 << 20
"""Octets kept in memory for a disk that is slow or full: 45 min at 115200 Bd."""


@dataclass(frozen=True, slots=True)
class Parcel:
    """Messages that stay together, with how many octets and reads of the bus they hold."""

    messages: list[Message]
    octets: int
    next: int
    schema: str = ""
    metadata: Mapping[str, str] | None = None

    @property
    def weight(self) -> int:
        """Octets of memory, roughly."""
        return sum(len(message.data) + 64 for message in self.messages)


class Order:
    """What the writing thread is told besides messages."""

    def __init__(self, name: str) -> None:
        self.name = name


FLUSH, SYNC, CLOSE = Order("flush"), Order("sync"), Order("close")


class Keeper:
    """Opens the first file at once (raises CaptureError); `run` is the thread, until it is told to CLOSE."""

    def __init__(self, path: Path, session: Session, rotation: Rotation | None, keep: int | None) -> None:
        self.orders: SimpleQueue[Parcel | Order | Session] = SimpleQueue()
        self.paths: list[Path] = []
        self.trouble: str | None = None
        self.taken = 0
        self.lost_octets = 0
        self._troubles: dict[str, str] = {}
        self._path = path
        self._session = session
        self._rotation = rotation
        self._newest = NewestParts(keep)
        self._next = 0  # number of the next entry of /raw
        self._octets = 0  # of the bus, in all parts
        self._finished_size = 0
        self._unwritten = 0  # octets of the bus that were taken since everything was in the file
        self._first = 0  # of the part
        self._began: int | None = None  # time of the part's first batch
        try:
            self._open()
        except OSError as error:
            raise _refused(path, error) from None

    @property
    def size(self) -> int:
        """Octets of all files, as far as they are written."""
        return self._finished_size + self._part.size - self._part.waiting

    def run(self) -> None:
        """Do what comes through `orders`. Never raises."""
        steps = {FLUSH: self._flush, SYNC: self._sync, CLOSE: self._finish}
        order: Parcel | Order | Session | None = None
        while order is not CLOSE:
            order = self.orders.get()
            if isinstance(order, Parcel):
                self._try("take", partial(self._take, order), order.octets)
            elif isinstance(order, Session):
                self._session = order  # of the parts to come
            else:
                self._try(order.name, steps[order])

    def _try(self, name: str, step: Callable[[], None], octets: int = 0) -> None:
        """Do one thing; when it fails say so, until it succeeds again. `octets`: of the bus that are lost then."""
        try:
            step()
        except OSError as error:
            self._troubles[name] = str(explain(error.filename or self.paths[-1], error))
            self.lost_octets += octets
        except Exception as error:  # the recording goes on whatever is wrong in here
            self._troubles[name] = f"{self.paths[-1]}: {type(error).__name__}: {error}"
            self.lost_octets += octets
        else:
            self._troubles.pop(name, None)
        self.trouble = next(iter(self._troubles.values()), None)

    def _take(self, batch: Parcel) -> None:
        self.taken += batch.weight
        if self._part.waiting > MOST_WAITING:
            self.lost_octets += batch.octets
            return
        if batch.messages[-1].topic == RAW and self._part_is_full(batch):
            self._try("rotate", self._rotate)  # the old part goes on when it fails; the next batch tries again
        for message in batch.messages:
            self._part.add(message, batch.schema, batch.metadata)
        self._octets += batch.octets
        self._unwritten += batch.octets
        self._next = batch.next
        if self._began is None and batch.messages[-1].topic == RAW:
            self._began = batch.messages[-1].publish_time

    def _part_is_full(self, batch: Parcel) -> bool:
        if self._rotation is None or self._began is None:
            return False
        age = batch.messages[-1].publish_time - self._began
        return self._rotation.due(self._part.size, age, self._next - self._first)

    def _flush(self) -> None:
        self._part.flush()
        self._unwritten = 0

    def _sync(self) -> None:
        self._part.sync()

    def _rotate(self) -> None:
        """Go on in a new part. Raises OSError before anything changed, or when the old part cannot be finished."""
        old = self._part
        self._open()
        try:
            old.finish()
            self._unwritten = 0
            old.sync()
        finally:
            self.lost_octets += self._unwritten
            self._unwritten = 0
            self._finished_size += old.size - old.waiting
            old.stream.close()
            self._newest.remove_old()

    def _finish(self) -> None:
        try:
            self._part.finish()
            self._unwritten = 0
            self._part.sync()
        finally:
            self.lost_octets += self._unwritten  # at most: some of them may be in the file
            with contextlib.suppress(OSError):
                self._part.stream.close()

    def _open(self) -> None:
        path, number = self._path, 1
        if self._rotation is not None:
            number = max((number for number, _ in parts(path)), default=0) + 1
            path = part_name(path, number)
        stream: BinaryIO = open(path, "xb", buffering=0)  # noqa: SIM115
        try:
            before = {"first_chunk": self._next, "octets_before": self._octets}
            part = PartFile(stream, self._session, len(self.paths) + 1, before)
            part.flush()
            self._newest.add(path, stream)
        except OSError:
            stream.close()
            path.unlink(missing_ok=True)
            raise
        with contextlib.suppress(OSError):
            _sync_folder(path.parent)
        self._part = part
        self._first = self._next
        self._began = None
        self.paths.append(path)


def _sync_folder(folder: Path) -> None:
    """Have the system write down that a file is there. Raises OSError, always on Windows."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _refused(path: Path, error: OSError) -> CaptureError:
    if path.is_dir():
        return CaptureError(f"{path}: a directory; name a file in it")
    if isinstance(error, FileNotFoundError):
        return CaptureError(f"{path}: no such directory; create {path.parent} first")
    return explain(error.filename or path, error)
