"""The recorder of a live bus: writes MCAP and never waits for the disk.

The capture's thread only collects octets; another thread packs, writes and rotates, and one more syncs. Loss is bounded
in time by the caller's `tick`: a chunk is in the file within 1 s and on the disk within 10 s. When the disk does not
take it, `trouble` says so in words, `behind` for how long, up to `writer_thread.MOST_WAITING` octets wait in memory,
and what comes after that is counted in `lost_octets` and, where it is missing, in the file. Nothing is raised into the
capture but a file that cannot be created at the start.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from dissectors.frame import Chunk
from dissectors.line import NS_PER_S
from sniff.engine.event_texts import SettingsChange, settings_change
from sniff.engine.session import UNKNOWABLE, LineEvent, LineEventKind, Session
from sniff.recording import writer_thread
from sniff.recording.batcher import Batcher
from sniff.recording.derived_message import DerivedMessage
from sniff.recording.line_messages import loss_message
from sniff.recording.rotation import Rotation
from sniff.recording.topic_message import Message, of_derived
from sniff.recording.topics import LINE, RAW
from sniff.recording.writer_thread import CHECK, CLOSE, SYNC, Changed, Flush, Keeper, WriteBatch

if TYPE_CHECKING:
    pass

FLUSH_AFTER = 900_000_000
"""ns that something may wait before it is written: with a tick when it is `due`, all is in the file within 1 s."""

SYNC_AFTER = 8_000_000_000
"""ns between syncs: all is on the disk within 10 s, unless it takes more than 2 s for a sync."""

CHECK_EVERY = NS_PER_S
"""ns between looks whether the file is still where it was begun."""

MOST_FLUSHES = 4096
"""Flushes remembered while they wait for the disk; of a longer jam the beginning is known."""

SYNC_PATIENCE = 1.0
"""Seconds that closing waits for the last sync: the system has the octets by then."""


class SharedFile:
    """The file of some buses, and the thread that writes it until all their recorders are finished.

    Created at once; arguments as `Recorder` takes them. Raises CaptureError.
    """

    def __init__(
        self,
        path: str | Path,
        sessions: Sequence[Session],
        rotation: Rotation | None = None,
        keep: int | None = None,
        keep_free: int | None = None,
        keep_of_all: bool = False,
    ) -> None:
        """`keep_free`: octets of the disk that stay free; the oldest parts of this name go for them. `keep_of_all`:
        `keep` counts the parts of earlier recordings of this name, too."""
        self.keeper = Keeper(Path(path), sessions, rotation, keep, keep_free, keep_of_all)
        self._sessions = sessions
        self._thread = threading.Thread(target=self.keeper.run, name="recorder", daemon=True)
        self._thread.start()

    def recorders(self) -> list[Recorder]:
        """One for each bus, in their order."""
        path = self.keeper.paths[0]
        return [Recorder(path, session, file=self, bus=bus) for bus, session in enumerate(self._sessions)]

    @property
    def finished(self) -> bool:
        """Whether everything is written, or failed to be."""
        return not self._thread.is_alive()

    def join(self, patience: float) -> None:
        """Wait so many seconds for that."""
        self._thread.join(patience)


class Recorder:
    """Records one bus. All methods are for one thread; none of them waits for the disk but `close`.

    `chunks`, `octets`: what was given to it. `lost_octets`: how many of those are not in the file. `trouble`: what is
    wrong with the disk, in words, None while all is well. `notices`: what became of files, in words, to be taken.
    """

    def __init__(
        self,
        path: str | Path,
        session: Session,
        rotation: Rotation | None = None,
        keep: int | None = None,
        *,
        file: SharedFile | None = None,
        bus: int = 0,
    ) -> None:
        """Create the first file, or write into a `file` that several share, as the `bus` of this number.

        With a rotation it is NAME-0001.mcap, or the number after the highest that is there.

        `keep`: how many parts of this very recording stay, from 1 on; parts of an earlier one are left alone. Raises
        CaptureError when the file cannot be created or exists already; nothing is ever overwritten.
        """
        self.chunks = 0
        self.octets = 0
        self._batcher = Batcher()
        self._open_octets = 0
        self._now: int | None = None
        self._ticked: int | None = None
        self._oldest: int | None = None  # time of the oldest thing that was not sent to be written
        self._oldest_came = 0  # the same on the clock of `tick`, which is not that of a replayed capture
        self._unsynced: int | None = None
        self._sequences: dict[str, int] = {}
        self._sent = 0
        self._dropped_octets = 0
        self._gap_octets = self._gap_reads = 0  # dropped since the last batch that was not
        self._following = 0  # number of the entry after the last batch
        self._flushes: deque[tuple[int, int]] = deque()  # number and oldest time of flushes that wait
        self._flush_number = 0
        self._checked: int | None = None
        self._stepped = self._step_at = 0
        self._closed = False
        self._given_up = False
        self._session = session
        self._file = file or SharedFile(path, [session], rotation, keep)
        self._keeper, self._bus = self._file.keeper, bus
        self._share = self._keeper.shares[bus]

    # what it is given

    def chunk(self, chunk: Chunk) -> None:
        """Record what a read returned."""
        if not chunk.octets or self._closed:
            return
        self.chunks += 1
        self.octets += len(chunk.octets)
        messages = self._batcher.add(chunk)
        if messages:
            self._send_raw(messages, self._batcher.first)
        self._open_octets += len(chunk.octets)
        time = chunk.time
        if self._oldest is None:
            self._note(time)
        if self._stepped <= time < self._step_at:
            self._now = time
        else:
            self._step(time)

    def line(self, event: LineEvent) -> None:
        """Record what happened to the line."""
        if self._closed:
            return
        change = settings_change(event)
        if change is not None:  # what was heard before stays in the part that says so
            self._close_batch()
            self._session = changed(self._session, change)
            self._keeper.orders.put(Changed(self._bus, self._session))
        self._batcher.add_event(event)
        self._note(event.time)
        self._step(event.time)

    def derived(self, one: DerivedMessage) -> None:
        """Record a result of the engine, best effort."""
        if self._closed or one.topic in (RAW, LINE) or self._full(writer_thread.MOST_DERIVED):
            return
        message = of_derived(one, self._sequences)
        self._send(WriteBatch([message], 0, self._batcher.first, one.schema, one.metadata, self._bus))
        self._note(one.log_time if self._now is None else self._now)

    def tick(self, now_ns: int) -> None:
        """Say what time it is on the capture's clock, at least every 0.25 s: closes, flushes and syncs what is due."""
        self._ticked = now_ns
        if not self._closed:
            if self.due is not None and now_ns >= self.due:
                self._flush(now_ns)
            self._step(now_ns)

    def finish(self) -> None:
        """Take nothing more; write everything and finish the file, in the background. `finished` says when."""
        if not self._closed:
            self._close_batch()
            self._closed = True
            if self._gap_octets:  # nothing came after it
                self._send(WriteBatch([self._gap(self._now or 0)], 0, self._following, bus=self._bus))
            self._keeper.orders.put(CLOSE)

    @property
    def finished(self) -> bool:
        """Whether everything is written, or failed to be."""
        return self._file.finished

    def give_up(self) -> None:
        """After `finish`: wait no longer; what is not in the file is lost, and counted."""
        self._given_up = not self.finished

    def synced(self, seconds: float) -> bool:
        """Once `finished`: wait until the disk has everything, at most so long; whether it has. The system has it."""
        return self._keeper.synced(seconds)

    def close(self, patience: float = 60.0) -> None:
        """Finish the file; wait so many seconds for the disk. Never raises."""
        self.finish()
        self._file.join(patience)
        self.give_up()
        if self.finished:
            self.synced(SYNC_PATIENCE)

    # what it tells

    @property
    def path(self) -> Path:
        """The file that is being written."""
        return self._keeper.paths[-1]

    @property
    def gone(self) -> bool:
        """Whether that file is not there any more, now that all is over."""
        return self._keeper.gone

    @property
    def paths(self) -> tuple[Path, ...]:
        """All files of this recording, oldest first; old ones may be removed already (`keep`)."""
        return tuple(self._keeper.paths)

    @property
    def size(self) -> int:
        """Octets of all files of this recording, as far as they are written."""
        return self._keeper.size

    @property
    def notices(self) -> deque[str]:
        """What became of files, in words; whoever takes one removes it."""
        return self._share.notices

    @property
    def trouble(self) -> str | None:
        """What is wrong, in words; None while all is well."""
        if self._given_up:
            return f"{self.path}: the disk does not answer; what it did not take is lost"
        return self._keeper.trouble

    @property
    def lost_octets(self) -> int:
        """Octets of the bus that are not in a file and never will be."""
        return self._dropped_octets + self._share.lost_octets + (self.unwritten if self._given_up else 0)

    @property
    def taken_away(self) -> int:
        """Those of them that were in a file that somebody removed or cut."""
        return self._share.taken_away

    @property
    def unwritten(self) -> int:
        """Octets of the bus that are not in a file yet."""
        return max(0, self.octets - self._dropped_octets - self._share.lost_octets - self._share.confirmed)

    @property
    def due(self) -> int | None:
        """When (ns on the clock of `tick`) the next tick is wanted at the latest; None while nothing waits."""
        return None if self._oldest is None or self._closed else self._oldest_came + FLUSH_AFTER

    def behind(self, now: int) -> int:
        """Age of the oldest thing that is not in the file yet (ns at `now`, the capture's clock), 0 for nothing."""
        while self._flushes and self._flushes[0][0] <= self._share.flushed:
            self._flushes.popleft()
        if self.finished or not (self._flushes or self._oldest is not None):
            return 0
        return max(0, now - (self._flushes[0][1] if self._flushes else self._oldest_came))

    @property
    def syncing(self) -> int:
        """For how long the system has been busy with a sync, ns; 0 while it is not."""
        return self._keeper.syncing

    # inside

    def _note(self, time: int) -> None:
        if self._oldest is None:
            self._oldest = time
            self._oldest_came = time if self._ticked is None else self._ticked
            self._step_at = self._stepped  # there is more to be asked now

    def _step(self, now: int) -> None:
        """Do what is due. Reads between `_stepped` and `_step_at` need not ask: nothing is due before."""
        self._now = now
        if self._oldest is not None and _due(self._oldest, now, FLUSH_AFTER):
            self._flush(now)
        if self._unsynced is not None and _due(self._unsynced, now, SYNC_AFTER):
            self._unsynced = None
            self._keeper.orders.put(SYNC)
        if self._checked is None or _due(self._checked, now, CHECK_EVERY):
            self._checked = now
            self._keeper.orders.put(CHECK)
        self._stepped = now
        since = [(self._checked, CHECK_EVERY), (self._oldest, FLUSH_AFTER), (self._unsynced, SYNC_AFTER)]
        self._step_at = min(begin + after for begin, after in since if begin is not None)

    def _flush(self, now: int) -> None:
        self._close_batch()
        self._flush_number += 1
        if len(self._flushes) < MOST_FLUSHES:
            self._flushes.append((self._flush_number, self._oldest_came))
        self._keeper.orders.put(Flush(self._flush_number, self._bus, now if self._ticked is None else self._ticked))
        self._oldest = None
        if self._unsynced is None:
            self._unsynced = now

    def _close_batch(self) -> None:
        messages = self._batcher.close()
        if messages:
            self._send_raw(messages, self._batcher.first)

    def _send_raw(self, messages: list[Message], following: int) -> None:
        octets, self._open_octets = self._open_octets, 0
        if self._full(writer_thread.MOST_WAITING):
            self._dropped_octets += octets
            self._gap_octets += octets
            self._gap_reads += following - self._following
            self._following = following
            return
        if self._gap_octets and messages[-1].topic == RAW:
            messages = [self._gap(messages[-1].publish_time), *messages]
        self._following = following
        self._send(WriteBatch(messages, octets, following, bus=self._bus))

    def _gap(self, time: int) -> Message:
        """What says in the file how much is missing before a batch."""
        octets, reads = self._gap_octets, self._gap_reads
        self._gap_octets = self._gap_reads = 0
        text = f"{octets} octets lost: the disk did not keep up"
        event = LineEvent(time, LineEventKind.DROPPED, text, octets)
        return loss_message(event, self._following, reads)

    def _full(self, limit: int) -> bool:
        return self._sent - self._share.taken + self._keeper.waiting > limit

    def _send(self, parcel: WriteBatch) -> None:
        self._sent += parcel.weight
        self._keeper.orders.put(parcel)


def changed(session: Session, change: SettingsChange) -> Session:
    """The session as a part of a recording that begins after a change of settings says it."""
    if change.found:
        return session.found(change.line, change.protocol)
    unknown = session.unknown or (UNKNOWABLE if change.searching else ())
    return replace(
        session, line=change.line or session.line, protocol=change.protocol or session.protocol, unknown=unknown
    )


def _due(since: int, now: int, limit: int) -> bool:
    """Whether that long has passed, or the clock jumped back and nobody knows."""
    return not -limit < now - since < limit
