"""The writing thread of a recorder: owns the files, writes, rotates, and remembers what went wrong.

Everything comes to it through one queue. Its numbers (`taken`, `lost_octets`, `size`, `trouble`, `paths`) are read by
the capture's thread and written only here. A write may hang as long as the disk likes: what comes meanwhile waits in
the queue. Syncs, which hang more often, have a thread of their own (`sync_thread.py`).
"""

from __future__ import annotations

import contextlib
import os
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from queue import SimpleQueue
from typing import BinaryIO

from dissectors.line import NS_PER_S
from sniff.engine.capture import CaptureError
from sniff.engine.session import Session
from sniff.formats.files import explain
from sniff.recording.part import PartFile
from sniff.recording.rotation import FreeSpace, NewestParts, Rotation, part_name, parts
from sniff.recording.sync_thread import Syncer
from sniff.recording.topic_message import Message
from sniff.recording.topics import LINE, RAW

MOST_WAITING = 32 << 20
"""Octets kept in memory for a disk that is slow or full: 45 min at 115200 Bd."""

RELEASE_AFTER = 120 * NS_PER_S
"""ns that results of the engine are kept back, so that many are packed together."""

MOVED, REMOVED, CUT = "moved away", "removed", "cut short"
"""What somebody can do to a file that is being written."""

MOST_DERIVED = MOST_WAITING // 4
"""The same for results of the engine, which can be computed again: they give way first."""


@dataclass(frozen=True, slots=True)
class WriteBatch:
    """Messages of a bus that stay together, with how many octets and reads of it they hold."""

    messages: list[Message]
    octets: int
    next: int
    schema: str = ""
    metadata: Mapping[str, str] | None = None
    bus: int = 0

    @property
    def weight(self) -> int:
        """Octets of memory, roughly."""
        return sum(len(message.data) + 300 for message in self.messages)


class WriterCommand:
    """What the writing thread is told besides messages."""

    def __init__(self, name: str) -> None:
        self.name = name


class Flush(WriterCommand):
    """Write everything out; the flushes that a bus asks for are numbered from 1. `now`: ns on the capture's clock."""

    def __init__(self, number: int, bus: int, now: int) -> None:
        super().__init__("flush")
        self.number = number
        self.bus = bus
        self.now = now


@dataclass(frozen=True, slots=True)
class Changed:
    """What a bus is from here on, for the parts to come."""

    bus: int
    session: Session


@dataclass(slots=True)
class Share:
    """What the keeper did for one bus.

    `taken`: weight of its parcels that came through `orders`. `flushed`: number of the newest of its flushes after
    which nothing waited. `confirmed`, `lost_octets`: octets of the bus that are in a file, and that never will be;
    `taken_away`: those of the latter that were in a file that somebody removed or cut.
    `notices`: what became of files, in words, for whoever takes them from there. `next`: number of the next entry of
    its reads; `first`: the same at the begin of the part. `octets`, `part_octets`: of the bus, in all parts and in
    this one; `unwritten`: those that were taken since everything was in the file.
    """

    taken: int = 0
    flushed: int = 0
    confirmed: int = 0
    lost_octets: int = 0
    notices: deque[str] = field(default_factory=deque)
    next: int = 0
    first: int = 0
    octets: int = 0
    part_octets: int = 0
    unwritten: int = 0
    taken_away: int = 0

    def written(self) -> None:
        """All that was taken is in the file."""
        self.confirmed += self.unwritten
        self.unwritten = 0

    def lose(self) -> None:
        """What was taken and not written never will be."""
        self.lost_octets += self.unwritten
        self.unwritten = 0

    def forget(self, octets: int) -> None:
        """Octets that a part had of it are in no file any more."""
        self.confirmed -= octets - self.unwritten
        self.lost_octets += octets - self.unwritten
        self.taken_away += octets - self.unwritten


SYNC, CHECK, CLOSE = WriterCommand("sync"), WriterCommand("check"), WriterCommand("close")


class Keeper:
    """Opens the first file at once (raises CaptureError); `run` is the thread, until it is told to CLOSE.

    `sessions`: of the buses that share the files. `shares`: what was done for each. `gone`: whether the last file is
    not where it was begun, and nothing followed it.
    """

    def __init__(
        self,
        path: Path,
        sessions: Sequence[Session],
        rotation: Rotation | None,
        keep: int | None,
        keep_free: int | None = None,
        keep_of_all: bool = False,
    ) -> None:
        self.orders: SimpleQueue[WriteBatch | WriterCommand | Changed] = SimpleQueue()
        self.paths: list[Path] = []
        self.shares = [Share() for _ in sessions]
        self.gone = False
        self._troubles: dict[str, str] = {}
        self._trouble: str | None = None
        self._path = path
        self._start = _current_folder()  # it may be removed, and made again by somebody
        self._sessions = list(sessions)
        self._to_close = len(sessions)
        self._rotation = rotation
        self._newest = NewestParts(keep, [self._start / old for _, old in parts(path)] if keep_of_all else ())
        self._free = FreeSpace(path, keep_free) if keep_free is not None else None
        self._finished_size = 0
        self._count = self._number = 0  # of parts begun; of the newest, as its name has it
        self._began: int | None = None  # time of the part's first batch
        self._released: int | None = None  # when results were written last, ns on the capture's clock
        self._syncer = Syncer()
        try:
            self._open()
        except OSError as error:
            self._syncer.end()
            raise _refused(path, error) from None

    @property
    def size(self) -> int:
        """Octets of all files, as far as they are written."""
        return self._finished_size + self._part.size - self._part.waiting

    @property
    def waiting(self) -> int:
        """Octets that are packed and that the file did not take yet."""
        return self._part.waiting

    @property
    def trouble(self) -> str | None:
        """What is wrong with the disk, in words; None while all is well."""
        return self._trouble or self._syncer.trouble

    @property
    def syncing(self) -> int:
        """For how long the system has been busy with a sync, ns."""
        return self._syncer.busy

    def synced(self, seconds: float) -> bool:
        """After the end: wait until the disk has everything, at most so long; whether it has."""
        return self._syncer.wait(seconds)

    def run(self) -> None:
        """Do what comes through `orders`, until every bus has told it to close. Never raises."""
        while not self.closed:
            self.do(self.orders.get())

    @property
    def closed(self) -> bool:
        """Whether every bus has told it to close."""
        return self._to_close == 0

    def do(self, order: WriteBatch | WriterCommand | Changed) -> None:
        """Do one thing. Never raises."""
        steps = {SYNC: self._sync, CHECK: self._check, CLOSE: self._finish}
        if isinstance(order, WriteBatch):
            self._try("take", partial(self._take, order), order.octets, order.bus)
        elif isinstance(order, Changed):
            self._sessions[order.bus] = order.session
        elif isinstance(order, Flush):
            self._try("flush", partial(self._flush, order))
        else:
            self._to_close -= order is CLOSE
            if order is not CLOSE or not self._to_close:
                self._try(order.name, steps[order])
        if self.closed:
            self._syncer.end()

    def _try(self, name: str, step: Callable[[], None], octets: int = 0, bus: int = 0) -> None:
        """Do one thing; when it fails say so, until it succeeds again. `octets`: of the bus that are lost then."""
        try:
            step()
        except OSError as error:
            self._troubles[name] = str(explain(error.filename or self.paths[-1], error))
            self.shares[bus].lost_octets += octets
        except Exception as error:  # the recording goes on whatever is wrong in here
            self._troubles[name] = f"{self.paths[-1]}: {type(error).__name__}: {error}"
            self.shares[bus].lost_octets += octets
        else:
            self._troubles.pop(name, None)
        self._trouble = next(iter(self._troubles.values()), None)

    def _take(self, batch: WriteBatch) -> None:
        share = self.shares[batch.bus]
        share.taken += batch.weight
        if batch.messages[-1].topic == RAW and self._part_is_full(batch):
            self._try("rotate", self._rotate)  # the old part goes on when it fails; the next batch tries again
        add = self._part.add if batch.messages[-1].topic in (RAW, LINE) else self._part.hold
        for message in batch.messages:
            add(message, batch.schema, batch.metadata, batch.bus)
        share.octets += batch.octets
        share.part_octets += batch.octets
        share.unwritten += batch.octets
        share.next = batch.next
        if self._began is None and batch.messages[-1].topic == RAW:
            self._began = batch.messages[-1].publish_time

    def _part_is_full(self, batch: WriteBatch) -> bool:
        if self._rotation is None or self._began is None:
            return False
        age = batch.messages[-1].publish_time - self._began
        reads = sum(share.next - share.first for share in self.shares)
        return self._rotation.due(self._part.size, age, reads)

    def _flush(self, flush: Flush) -> None:
        if self._released is None:
            self._released = flush.now
        if self._part.holds_enough or not 0 <= flush.now - self._released < RELEASE_AFTER:
            self._released = flush.now
            self._part.release()
        self._part.flush()
        self._written()
        self.shares[flush.bus].flushed = flush.number

    def _written(self) -> None:
        for share in self.shares:
            share.written()

    def _sync(self) -> None:
        self._syncer.sync(self.paths[-1], self._part.stream)

    def _rotate(self) -> None:
        """Go on in a new part. Raises OSError before anything changed, or when the old part cannot be finished."""
        old, path = self._part, self.paths[-1]
        self._open()
        try:
            old.finish()
            self._written()
        finally:
            self._finished_size += old.size - old.waiting
            self._leave(old, path)

    def _leave(self, old: PartFile, path: Path) -> None:
        """Let go of a part that something has followed."""
        for share in self.shares:
            share.lose()
        self._syncer.sync(path, old.stream, last=True)
        self._newest.remove_old()

    def _check(self) -> None:
        """Go on in a new part if the file is no longer where it was begun. Raises OSError while none can be begun."""
        if self._free is not None:
            for gone in self._free.make(self.paths[-1]):
                self._tell(f"{gone} was removed: the disk is nearly full")
        fate = self._fate()
        if fate is None:
            return
        old, path, octets = self._part, self.paths[-1], [share.part_octets for share in self.shares]
        with contextlib.suppress(OSError):
            (self._start / path.parent).mkdir(parents=True, exist_ok=True)
        try:
            self._open()
        except OSError as error:
            raise OSError(error.errno, f"{fate} while it was recorded, and no other can be begun", str(path)) from None
        if fate == MOVED:
            with contextlib.suppress(OSError):
                old.finish()
                self._written()
        else:
            for share, held in zip(self.shares, octets, strict=True):
                share.forget(held)
        self.paths.remove(path)
        self._leave(old, path)
        for share, held in zip(self.shares, octets, strict=True):
            said = f", with {held} octets of the bus in it" if fate != MOVED else ""
            share.notices.append(f"{path} was {fate} while it was recorded{said}; goes on in {self.paths[-1]}")

    def _tell(self, text: str) -> None:
        for share in self.shares:
            share.notices.append(text)

    def _fate(self) -> str | None:
        """What somebody did to the file that is being written; None where it is as it should be, or nobody knows."""
        try:
            ours = os.fstat(self._part.stream.fileno())
            if os.path.samestat(os.stat(self._start / self.paths[-1]), ours):
                return CUT if ours.st_size < self._part.size - self._part.waiting else None
        except (FileNotFoundError, NotADirectoryError):
            pass
        except (OSError, ValueError):
            return None
        # asked anew: it may have been removed since
        return MOVED if os.fstat(self._part.stream.fileno()).st_nlink else REMOVED

    def _finish(self) -> None:
        self._try("check", self._check)
        try:
            self._part.finish()
            self._written()
        finally:
            fate = self._fate()
            self.gone = fate is not None
            if fate in (REMOVED, CUT):
                for share in self.shares:
                    share.forget(share.part_octets)
            for share in self.shares:
                share.lose()  # at most: some of them may be in the file
            self._syncer.sync(self._path, self._part.stream, last=True)

    def _open(self) -> None:
        path, number = self._path, 1
        if self._rotation is not None or self.paths:
            there = max((number for number, _ in parts(path)), default=0)
            number = max(there, self._number) + 1
            path = part_name(path, number)
        stream: BinaryIO = open(self._start / path, "xb", buffering=0)  # noqa: SIM115
        try:
            before = [{"first_chunk": share.next, "octets_before": share.octets} for share in self.shares]
            part = PartFile(stream, self._sessions, self._count + 1, before)
            part.flush()
            self._newest.add(self._start / path, stream)
        except OSError:
            stream.close()
            (self._start / path).unlink(missing_ok=True)
            raise
        self._syncer.sync_folder(self._start / path.parent)
        self._part = part
        self._number, self._count = number, self._count + 1
        for share in self.shares:
            share.first, share.part_octets = share.next, 0
        self._began = None
        self.paths.append(path)


def _current_folder() -> Path:
    """Where relative names begin; as they are where it is gone already."""
    try:
        return Path.cwd()
    except OSError:
        return Path()


def _refused(path: Path, error: OSError) -> CaptureError:
    if path.is_dir():
        return CaptureError(f"{path}: a directory; name a file in it")
    if isinstance(error, FileNotFoundError):
        return CaptureError(f"{path}: no such directory; create {path.parent} first")
    return explain(error.filename or path, error)
