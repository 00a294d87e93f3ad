"""The feeds of the terminal UI: a live capture, a file, or memory. No UI in here."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from sniff.bus.rows import Store
from sniff.engine.session import LineEvent, LineEventKind


@dataclass(frozen=True, slots=True)
class FeedStatus:
    """What the header says of a feed.

    `port`: as the user named it, or the file. `line`: settings as a token ("19200,8E1"). `protocol`: a registry name.
    `recording`: path of the file written, None when nothing is recorded. `file_size`: octets, of the file written or
    read. `dropped`: octets or rows that were lost on the way here. `live`: whether rows still come from a port.
    `ended`: why nothing more comes ("unplugged", "file ends inside a record"), empty while all is well.
    `priority`: what the system allowed the capture process, in words ("real-time", "normal"), empty when unknown.
    `trouble`: why nothing is written any more although the capture goes on ("no space left on the disk …").
    `behind`: seconds by which the disk is late with the recording, 0 while it keeps up.
    `reading`: whether the file is still being read, `read`: how much of it has been, 0 … 1, or None where that was
    all, and rows of it are still to come. `judged`: how many of its rows the rules have seen, 0 … 1.
    `follows`: the recording that rows are read from while another process writes it; "": they are from a port.
    `searching`: with which settings a search listens at the moment, empty when there is none.
    `second`: a second protocol on the bus, by its registry name, where the whole file was read; `foreign`: how many
    frames of it, in rows from `since` on. `now`: ns, up to when a live bus was listened to; None for others.
    """

    port: str
    line: str
    protocol: str
    recording: str | None = None
    file_size: int = 0
    dropped: int = 0
    live: bool = False
    ended: str = ""
    priority: str = ""
    searching: str = ""
    trouble: str = ""
    behind: float = 0.0
    reading: bool = False
    read: float | None = 1.0
    judged: float = 1.0
    follows: str = ""
    second: str = ""
    foreign: int = 0
    since: int = 0
    now: int | None = None

    @property
    def in_file(self) -> bool:
        """Whether what leaves memory can be found in a file: read from one, or recorded."""
        return not self.live or bool(self.follows) or (self.recording is not None and not self.trouble)


class Feed(Protocol):
    """Fills a store. The app calls `poll` ten times a second, and `work` while there is some, from its own thread;
    both must return quickly."""

    @property
    def store(self) -> Store:
        """The rows so far; always the same object."""
        ...

    def poll(self) -> bool:
        """Move what has come into the store; whether anything changed."""
        ...

    def work(self) -> bool:
        """Do a small piece of what can wait (some ms); whether more is left."""
        ...

    def status(self) -> FeedStatus:
        """How things stand now."""
        ...

    def mark(self, time: int, text: str | None) -> str:
        """Keep what a person wrote about a moment (ns), None to take it away; where it is kept, in words. It comes back
        as an event of the store. Raises OSError."""
        ...

    def close(self) -> None:
        """Stop; called once, when the UI has ended."""
        ...


class StoreFeed:
    """A feed from memory: a store that somebody else has filled, or still fills in the same thread."""

    def __init__(self, store: Store, status: FeedStatus | None = None) -> None:
        self._store = store
        self._version = -1
        self.current = status or FeedStatus(store.session.port, str(store.session.line), store.session.protocol)
        self.closed = False

    @property
    def store(self) -> Store:
        """The store given at the start."""
        return self._store

    def poll(self) -> bool:
        """Whether the store changed since the last call."""
        changed = self._store.version != self._version
        self._version = self._store.version
        return changed

    def work(self) -> bool:
        """There is none."""
        return False

    def status(self) -> FeedStatus:
        """What `current` was set to."""
        return self.current

    def mark(self, time: int, text: str | None) -> str:
        """Only here."""
        kind = LineEventKind.UNMARK if text is None else LineEventKind.MARK
        self._store.add_mark(LineEvent(time, kind, text or ""))
        return "until this view ends"

    def close(self) -> None:
        """Remember that it was closed."""
        self.closed = True
