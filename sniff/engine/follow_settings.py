"""The engine of one session: it follows the settings that the capture names, and a search for them. Pure.

While settings are searched for, most octets are heard with wrong ones. They are octets of the capture, but say nothing
about the bus: each read becomes a row of its own with `Row.searched`. What was heard with one attempt is held until it
is known what became of it:

    settings  line=9600,8N1 searching                       the search begins
      octets                                                  held …
    settings  line=19200,8E1                                … rows that only say what was heard; the next attempt
      octets                                                  held …
    settings  line=19200,8E1 protocol=NAME found      … frames: they were heard with what was found
      octets                                                frames

So a search costs no frame that was heard right, and a saved capture gives the same rows as the live bus. Where settings
do not matter to what is heard (`Adapter.lineless`) all attempts are one.
"""

from __future__ import annotations

from dataclasses import replace

from dissectors import registry
from dissectors.frame import Chunk, Noise, Place, Reason
from dissectors.line import LineSettings, Timing
from dissectors.manifest import Dissector
from sniff.engine.engine import NOTHING, Engine, Output, Row, together
from sniff.engine.event_texts import SettingsChange, settings_change
from sniff.engine.session import Item, Session

MOST_HELD_OCTETS = 4 << 20
MOST_HELD_READS = 200_000
"""Of one attempt; beyond that they become rows of the search, although it may end well."""


class SessionEngine:
    """Items of a capture in, rows and transactions out. `session`: as it is known by now, after a search with what
    was found. `engine`: the one at work.

    Raises registry.UnknownProtocol.
    """

    def __init__(self, session: Session, pairing: bool = True, first: int = 1, before_tx: int = 0) -> None:
        """`first`, `before_tx`: of the rows and transactions to come, as `Engine` has them."""
        self.session = session
        self._pairing = pairing
        self.searching = bool(session.unknown)
        self._in_force = self._before = session.line
        self._since: int | None = None  # when the present attempt began, None before the first octet
        self._held: list[Item] = []  # reads, and the holes between them
        self._held_octets = 0
        self.engine = Engine(registry.get(session.protocol), session.timing, first, before_tx, pairing)

    @property
    def dissector(self) -> Dissector:
        """The protocol; a stand-in as long as nobody knows it."""
        return self.engine.dissector

    def take(self, item: Item) -> Output:
        """Take a read or what happened to the line."""
        if isinstance(item, Chunk):
            return self.feed(item)
        if item.kind.is_hole:  # what was asked before it and what is answered after it belong to nothing
            if not self.searching or self._counts_anyhow:
                return self._restart(self.engine.timing)
            if self._held and isinstance(self._held[-1], Chunk):
                self._held.append(item)
            return NOTHING
        change = settings_change(item)
        return NOTHING if change is None else self._change(change, item.time)

    def feed(self, chunk: Chunk) -> Output:
        """Take one read."""
        if not self.searching or self._counts_anyhow:
            return self.engine.feed(chunk)
        self._held.append(chunk)
        self._held_octets += len(chunk.octets)
        if self._held_octets > MOST_HELD_OCTETS or len(self._held) > MOST_HELD_READS:
            return self._only_heard(self._let_go(), self._in_force)
        return NOTHING

    def advance(self, now: int) -> Output:
        """Say that no read returned up to `now` (ns)."""
        return NOTHING if self.searching and not self._counts_anyhow else self.engine.advance(now)

    def close(self) -> Output:
        """End of capture."""
        return together((self.engine.close(), self._only_heard(self._let_go(), self._in_force)))

    def deadline(self) -> int | None:
        """When to call `advance` next (ns), or None."""
        return self.engine.deadline()

    @property
    def _counts_anyhow(self) -> bool:
        """Whether octets of this attempt are read although the search was in vain: the user has said the settings."""
        session = self.session
        return session.given and (session.adapter.lineless or self._in_force == session.line)

    def _change(self, change: SettingsChange, now: int) -> Output:
        line = change.line or self._in_force
        if change.protocol is not None and not registry.is_known(change.protocol):  # a file may say anything
            change = replace(change, protocol=None)
        if change.found and self.searching:
            return self._find(change)
        if self.searching or change.searching:
            if self.searching and (line == self._in_force or self.session.adapter.lineless):
                return NOTHING
            output = together((self._restart(self.session.timing), self._only_heard(self._let_go(), self._in_force)))
            self._since = now if self.searching else None
            self.searching, self._before, self._in_force = True, self._in_force, line
            return output
        if self.session.given:  # the user knows better
            return NOTHING
        protocol = change.protocol or self.engine.dissector.name
        if (line, protocol) == (self.engine.timing.line, self.engine.dissector.name):
            return NOTHING
        self._in_force = line
        timing = replace(self.session.timing, line=line)
        if change.line is not None:
            timing = replace(timing, has_rate=True)
        return self._restart(timing, protocol)

    def _find(self, change: SettingsChange) -> Output:
        """The search ends: what was heard with the last attempt is read."""
        if self.session.unknown:
            self.session = self.session.found(change.line, change.protocol)
        outputs = [] if self._counts_anyhow else [self._restart(self.session.timing, self.session.protocol)]
        self.searching, self._in_force = False, self.session.line
        held = self._let_go()
        if self._since is not None:  # what the adapter still held was heard with the settings before
            until = self._since + self.session.adapter.latency
            late = next((number for number, heard in enumerate(held) if heard.time > until), len(held))
            outputs.append(self._only_heard(held[:late], self._before))
            held = held[late:]
        for heard in held:
            again = self.engine.feed(heard) if isinstance(heard, Chunk) else self._restart(self.engine.timing)
            outputs.append(again)
        return together(outputs)

    def _restart(self, timing: Timing, protocol: str | None = None) -> Output:
        """Close the engine and go on with another, whose numbers follow."""
        before = self.engine
        output = before.close()
        dissector = before.dissector if protocol is None else registry.get(protocol)
        self.engine = Engine(dissector, timing, before.next, before.last_tx, self._pairing)
        return output

    def _let_go(self) -> list[Item]:
        held, self._held, self._held_octets = self._held, [], 0
        return held

    def _only_heard(self, heard: list[Item], line: LineSettings) -> Output:
        """Rows of a search: octets, when, and with which settings."""
        rows = []
        for chunk in heard:
            if not isinstance(chunk, Chunk):
                continue
            start = chunk.time - len(chunk.octets) * line.char
            noise = Noise(chunk.octets, start, chunk.time, Place.BETWEEN, Reason.NO_FRAME, chunk.marks)
            rows.append(Row(self.engine.next, noise, searched=line))
            self.engine.next += 1
        return Output(tuple(rows))


def dissector_for(session: Session) -> Dissector:
    """The protocol of a session. Raises registry.UnknownProtocol."""
    return registry.get(session.protocol)


def engine_for(session: Session) -> SessionEngine:
    """A new engine for a session. Raises registry.UnknownProtocol."""
    return SessionEngine(session)
