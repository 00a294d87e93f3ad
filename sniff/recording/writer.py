"""Writing MCAP: `create` for a conversion, `Recorder` for a live bus.

A recorder never waits for the disk: the capture's thread only collects octets; another thread packs, writes, syncs
and rotates. Loss is bounded in time by the caller's `tick`: a chunk is in the file within 1 s and on the disk within
10 s. When the disk does not take it, `trouble` says so in words, up to `keeper.MOST_WAITING` octets wait in memory for
room, and what comes after that is counted in `lost_octets`; the numbering in the file shows the hole. Nothing is
raised into the capture but a file that cannot be created at the start.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from dissectors.frame import Chunk
from sniff.formats.files import NewFile, explain
from sniff.recording import keeper
from sniff.recording.batch import Batcher, Message, stamp
from sniff.recording.keeper import CLOSE, FLUSH, SYNC, Keeper, Parcel
from sniff.recording.part import PartFile
from sniff.recording.rotation import Rotation
from sniff.recording.topics import LINE, RAW
from sniff.session import UNKNOWABLE, Item, LineEvent, Session, SettingsChange, settings_change

FLUSH_AFTER = 700_000_000
"""ns that something may wait before it is written: with a tick each 0.25 s, all is in the file within 1 s."""

SYNC_AFTER = 8_000_000_000
"""ns between syncs: with a slow disk, all is on it within 10 s."""


# -- converting ------------------------------------------------------------------------------------------------


def create(path: str | Path, session: Session) -> McapWriter:
    """Create an MCAP capture; it takes its name when it is closed. Raises CaptureError."""
    return McapWriter(NewFile(Path(path)), session)


class McapWriter:
    """Writes a capture that is already there. An empty chunk says nothing and is not written."""

    def __init__(self, file: NewFile, session: Session) -> None:
        self._file = file
        self._batcher = Batcher()
        self._part = PartFile(file.stream, session)
        self._sequences: dict[str, int] = {}

    def derived(
        self,
        topic: str,
        schema_name: str,
        log_time: int,
        publish_time: int,
        data: bytes,
        metadata: Mapping[str, str] | None = None,
    ) -> None:
        """Add a result of the engine; arguments as `Recorder.derived` takes them. Raises CaptureError."""
        if topic in (RAW, LINE):
            return
        sequence = self._sequences.get(topic, 0)
        self._sequences[topic] = (sequence + 1) % (1 << 32)
        self._part.add(Message(topic, stamp(log_time), stamp(publish_time), sequence, data), schema_name, metadata)

    def write(self, item: Item) -> None:
        """Add a chunk or line event. Raises CaptureError."""
        if isinstance(item, LineEvent):
            self._batcher.add_event(item)
        else:
            self._add(self._batcher.add(item))

    def close(self) -> None:
        """Finish the file and give it its name; again is harmless. Raises CaptureError."""
        if self._file.stream.closed:
            return
        self._add(self._batcher.close())
        try:
            self._part.finish()
        except OSError as error:
            self._file.discard()
            raise explain(self._file.path, error) from None
        self._file.close()

    def _add(self, messages: list[Message]) -> None:
        for message in messages:
            self._part.add(message)
        if self._part.waiting > 1 << 20:
            try:
                self._part.flush()
            except OSError as error:
                raise explain(self._file.path, error) from None

    def __enter__(self) -> McapWriter:
        return self

    def __exit__(self, kind: object, *exc: object) -> None:
        if kind is None:
            self.close()
        else:
            self._file.discard()


# -- recording -------------------------------------------------------------------------------------------------


class Recorder:
    """Records one bus. All methods are for one thread; none of them waits for the disk but `close`.

    `chunks`, `octets`: what was given to it. `lost_octets`: how many of those are not in the file. `trouble`: what is
    wrong with the disk, in words, None while all is well.
    """

    def __init__(
        self, path: str | Path, session: Session, rotation: Rotation | None = None, keep: int | None = None
    ) -> None:
        """Create the first file. With a rotation it is NAME-0001.mcap, or the number after the highest that is there.

        `keep`: how many parts of this very recording stay, from 1 on; parts of an earlier one are left alone. Raises
        CaptureError when the file cannot be created or exists already; nothing is ever overwritten.
        """
        self.chunks = 0
        self.octets = 0
        self._batcher = Batcher()
        self._open_octets = 0
        self._now: int | None = None
        self._oldest: int | None = None  # time of the oldest thing that is not in the file
        self._unsynced: int | None = None
        self._sequences: dict[str, int] = {}
        self._sent = 0
        self._dropped_octets = 0
        self._closed = False
        self._stuck: str | None = None
        self._session = session
        self._keeper = Keeper(Path(path), session, rotation, keep)
        self._thread = threading.Thread(target=self._keeper.run, name="recorder", daemon=True)
        self._thread.start()

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
        self._note(chunk.time)
        self._step(chunk.time)

    def line(self, event: LineEvent) -> None:
        """Record what happened to the line."""
        if self._closed:
            return
        change = settings_change(event)
        if change is not None:  # what was heard before stays in the part that says so
            self._close_batch()
            self._session = changed(self._session, change)
            self._keeper.orders.put(self._session)
        self._batcher.add_event(event)
        self._note(event.time)
        self._step(event.time)

    def derived(
        self,
        topic: str,
        schema_name: str,
        log_time: int,
        publish_time: int,
        data: bytes,
        metadata: Mapping[str, str] | None = None,
    ) -> None:
        """Record a result of the engine, best effort. `schema_name`: one of `topics.SCHEMAS`; `metadata`: of the
        channel, taken when the topic is new in a file. /raw and /line are not for results."""
        if self._closed or topic in (RAW, LINE):
            return
        sequence = self._sequences.get(topic, 0)
        self._sequences[topic] = (sequence + 1) % (1 << 32)
        message = Message(topic, stamp(log_time), stamp(publish_time), sequence, data)
        self._send(Parcel([message], 0, self._batcher.first, schema_name, metadata))
        self._note(log_time if self._now is None else self._now)

    def tick(self, now_ns: int) -> None:
        """Say what time it is on the capture's clock, at least every 0.25 s: closes, flushes and syncs what is due."""
        if not self._closed:
            self._step(now_ns)

    def close(self) -> None:
        """Write everything, finish the file, wait for the disk (at most a minute). Never raises."""
        if self._closed:
            return
        self._close_batch()
        self._closed = True
        self._keeper.orders.put(CLOSE)
        self._thread.join(60)
        if self._thread.is_alive():
            self._stuck = f"{self.path}: the disk does not answer; the last seconds may be missing"

    # what it tells

    @property
    def path(self) -> Path:
        """The file that is being written."""
        return self._keeper.paths[-1]

    @property
    def paths(self) -> tuple[Path, ...]:
        """All files of this recording, oldest first; old ones may be removed already (`keep`)."""
        return tuple(self._keeper.paths)

    @property
    def size(self) -> int:
        """Octets of all files of this recording, as far as they are written."""
        return self._keeper.size

    @property
    def trouble(self) -> str | None:
        """What is wrong, in words; None while all is well."""
        return self._stuck or self._keeper.trouble

    @property
    def lost_octets(self) -> int:
        """Octets of the bus that are not in a file and never will be."""
        return self._dropped_octets + self._keeper.lost_octets

    # inside

    def _note(self, time: int) -> None:
        if self._oldest is None:
            self._oldest = time

    def _step(self, now: int) -> None:
        self._now = now
        if self._oldest is not None and _due(self._oldest, now, FLUSH_AFTER):
            self._oldest = None
            self._close_batch()
            self._keeper.orders.put(FLUSH)
            if self._unsynced is None:
                self._unsynced = now
        if self._unsynced is not None and _due(self._unsynced, now, SYNC_AFTER):
            self._unsynced = None
            self._keeper.orders.put(SYNC)

    def _close_batch(self) -> None:
        messages = self._batcher.close()
        if messages:
            self._send_raw(messages, self._batcher.first)

    def _send_raw(self, messages: list[Message], following: int) -> None:
        self._send(Parcel(messages, self._open_octets, following))
        self._open_octets = 0

    def _send(self, parcel: Parcel) -> None:
        if self._sent - self._keeper.taken > keeper.MOST_WAITING:
            self._dropped_octets += parcel.octets
            return
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
