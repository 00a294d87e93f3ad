"""A bus being captured: what the capture process sends, through the engine, for whoever shows it.

The engine may be behind what comes, without harm to the recording. It is never let run for long at a time, so that
whoever shows it can draw, and once the capture is over what is left gets a second: its octets are counted as `unseen`.
"""

from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Callable

from dissectors.frame import Chunk, Mark
from dissectors.manifest import Dissector
from dissectors.profiles import Devices
from sniff.analysis.autodetect import Detecting
from sniff.analysis.points import PointReader, Sample
from sniff.bus.autodetect import Progress, Search
from sniff.bus.derived_topics import BusChannels, DerivedMessage
from sniff.bus.model import BusModel
from sniff.bus.router import Router
from sniff.bus.thinning import Budget, Room
from sniff.bus.value_topics import ValueChannels
from sniff.capture.link import CaptureLink
from sniff.capture.wire import Ended, Message, Received, Status, Tick
from sniff.engine.engine import Output
from sniff.engine.follow_settings import engine_for
from sniff.engine.session import LineEvent, Session

AT_ONCE = 0.2
"""Seconds that one `poll` may spend with the engine."""

TO_THE_END = 1.0
"""Seconds that the engine gets for what had come when the capture ended."""

PIECE = 2048
"""Octets given to the engine at a time."""

VALUES_AT_ONCE = 4000
NODES_A_SECOND, NODES_AT_ONCE = 0.5, 600
"""What goes back into the recording of the values of points and of the numbers of stations: `sniff/bus/thinning.py`."""

NODES = "/nodes/"

LiveItem = Output | LineEvent | Status | Ended


class LiveBus:
    """One bus of a running capture. Not thread-safe; nothing here can hold up the recording.

    `session`: of the bus; `status`: the newest report; `ended`: why it is over, None while it runs. `model`: what is
    known of the bus; its values and findings go back into the recording. `search`: finds what `session.unknown` names,
    None when everything is given; its octets are recorded like all others. When it ends, `session`, `dissector` and
    the model's become others, before the event and the outputs that this gives are handed out. `unseen`: octets that
    came here, or were on their way, and were never looked at.
    """

    def __init__(
        self,
        link: CaptureLink,
        bus: int = 0,
        devices: Devices | None = None,
        detecting: Detecting | None = None,
        router: Router | None = None,
    ) -> None:
        """`router`: shared by all buses of the link; a bus that is shown alone has its own."""
        self.link = link
        self._router = router or Router(link)
        self._router.open(bus)
        self.bus = bus
        self.engine = engine_for(link.session(bus))
        self.search = None
        if detecting is not None:
            self.search = Search(link, detecting, "line" not in self.session.unknown, bus)
        self.status = Status(bus, path=link.paths[bus] if bus < len(link.paths) else "", priority=link.priority)
        self.ended: Ended | None = None
        self.devices = devices or Devices()
        self._pending: deque[Message] = deque()
        self._leave_at: float | None = None  # when what is pending is not looked at any more
        self._skipped = 0
        self._channels = ValueChannels(self.session.bus, self.devices) if link.paths else None
        self._room = Room()
        self._values_budget = Budget(Room.LEAST, VALUES_AT_ONCE)
        self._nodes_budget = Budget(NODES_A_SECOND, NODES_AT_ONCE)
        self.model = BusModel(self.session, self.dissector, self.devices)
        self._settle()

    @property
    def points(self) -> PointReader:
        """Takes values out of what was heard."""
        return self.model.reader

    @property
    def session(self) -> Session:
        """The bus; during a search with what it began with."""
        return self.engine.session

    @property
    def dissector(self) -> Dissector:
        """The protocol; during a search for it a stand-in."""
        return self.engine.dissector

    @property
    def searching(self) -> Progress | None:
        """What a search is at; None when there is none (any more)."""
        return self.search.progress if self.search is not None and self.engine.searching else None

    @property
    def unseen(self) -> int:
        """Octets of the line that were not looked at, because this side did not keep up."""
        return self.status.dropped + self.link.dropped.get(self.bus, 0) + self._router.dropped[self.bus] + self._skipped

    @property
    def file_is_gone(self) -> bool:
        """Whether there is no file where the recording ought to be."""
        return bool(self.link.paths) and (not self.status.path or not os.path.exists(self.status.path))

    def poll(self, timeout: float = 0.0) -> list[LiveItem]:
        """What has come, in order; waits up to `timeout` seconds. The end closes the engine and comes last.

        What takes longer than some tenths of a second waits for the next call.
        """
        items: list[LiveItem] = []
        if self._pending:
            self.link.look()
        else:
            self._pending.extend(self._router.receive(self.bus, timeout))
        self._router.insist()
        until = time.monotonic() + AT_ONCE
        while self._pending:
            if self.link.closing and self._leave_at is None:
                self._leave_at = time.monotonic() + TO_THE_END
            if self._leave_at is None and time.monotonic() >= until:
                break
            items += self._next()
            if not self._pending and self._leave_at is not None:  # the end is near: go there
                self._pending.extend(self._router.receive(self.bus))
        return items

    def _next(self) -> list[LiveItem]:
        """Take the next message, of a long read a piece; once the time is over, reads are only counted."""
        message = self._pending.popleft()
        if not isinstance(message, Received) or not isinstance(message.item, Chunk):
            return self._take(message)
        if self._leave_at is not None and time.monotonic() >= self._leave_at:
            self._skipped += len(message.item.octets) if message.bus == self.bus else 0
            return []
        if len(message.item.octets) > PIECE:
            piece, rest = cut(message.item, PIECE, self.session.line.char)
            self._pending.appendleft(Received(message.bus, rest))
            return self._take(Received(message.bus, piece))
        return self._take(message)

    def end(self) -> None:
        """Have the capture end; `poll` gives the rest, and Ended last. Again: without waiting for a slow disk."""
        self.link.ask_to_stop()

    def stop(self, more: Callable[[], None] = lambda: None) -> list[LiveItem]:
        """End the capture; what was still to come, and the end. `more` is called a few times a second meanwhile."""
        items: list[LiveItem] = []
        if self.ended is None:
            self.end()
        while self.ended is None:
            items += self.poll(0.1)
            more()
        return items

    def _settle(self) -> None:
        """What depends on the settings, anew."""
        recorded = self.link.paths and not self.engine.searching
        self._bus_channels = BusChannels(self.model) if recorded else None

    def _take(self, message: Received | Tick | Status | Ended) -> list[LiveItem]:
        if self.search is not None and self.engine.searching:
            self.search.take(message)
        if isinstance(message, Ended):
            self.ended = message
            self.link.let_go()
            return [*self._some(self.engine.close()), message]
        if message.bus != self.bus:
            return []
        if isinstance(message, Status):
            self.status = message
            return [message]
        if isinstance(message, Tick):
            self._values_budget.rate = self._room.rate(message.now)
            if self._bus_channels is not None and (messages := self._bus_channels.due(message.now)):
                self._send(messages)
            deadline = self.engine.deadline()
            due = deadline is not None and message.now >= deadline
            return self._some(self.engine.advance(message.now)) if due or deadline is None else []
        if isinstance(message.item, Chunk):
            self._room.add(len(message.item.octets))
        was_searching = self.engine.searching
        output = self.engine.take(message.item)
        if was_searching and not self.engine.searching:
            self.model.settle(self.session, self.dissector)
            self._settle()
        if not isinstance(message.item, LineEvent):
            return self._some(output)
        self.model.add_line_event(message.item)
        return [message.item, *self._some(output)]

    def _some(self, output: Output) -> list[LiveItem]:
        if not output:
            return []
        self.model.add(output)
        if self._bus_channels is not None:
            self._bus_channels.add(output)
        if self._channels is not None:
            for sample in self.model.samples:
                self._record(sample)
        return [output]

    def _record(self, sample: Sample) -> None:
        """Send a value back into the file, best effort."""
        message = self._channels.message(sample) if self._channels is not None else None
        if message is not None and self._values_budget.take(message.topic, message.time):
            self.link.derived(
                self.bus, message.topic, message.schema, message.time, message.time, message.data, message.metadata
            )

    def _send(self, messages: list[DerivedMessage]) -> None:
        """Send statistics and findings back into the file, best effort."""
        for one in messages:
            if one.topic.startswith(NODES) and not self._nodes_budget.take(one.topic, one.log_time):
                continue
            self.link.derived(self.bus, one.topic, one.schema, one.log_time, one.publish_time, one.data, one.metadata)


def cut(chunk: Chunk, at: int, char: int) -> tuple[Chunk, Chunk]:
    """A read as two, of octets that followed each other at the speed of the line (`char`: ns an octet)."""
    marks = tuple(mark for mark in chunk.marks if mark.offset < at)
    rest = tuple(Mark(mark.offset - at, mark.error) for mark in chunk.marks if mark.offset >= at)
    late = len(chunk.octets) - at
    return Chunk(chunk.time - late * char, chunk.octets[:at], marks), Chunk(chunk.time, chunk.octets[at:], rest)
