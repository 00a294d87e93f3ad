"""A bus being captured: what the capture process sends, through the engine, for whoever shows it.

Reads are gathered and looked at together, all that has come at once: a frame is shown as soon as it is known to be one,
and a busy bus costs little more than a quiet one. The engine may be behind what comes, without harm to the recording.
It is never let run for long at a time, so that whoever shows it can draw, and once the capture is over, or was asked to
end, what is left gets a second, of all buses together: octets beyond that are counted as `unseen`.
"""

from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Protocol

from dissectors.findings import Finding
from dissectors.line import NS_PER_S
from dissectors.manifest import Dissector
from dissectors.profiles import Devices
from sniff.analysis.autodetect import Detecting
from sniff.analysis.point_reader import PointReader, Sample
from sniff.analysis.site_ear import SiteEar
from sniff.bus.autodetect import Search, SearchProgress
from sniff.bus.derived_topics import NODES_A_SECOND, NODES_AT_ONCE, BusChannels
from sniff.bus.model import BusModel
from sniff.bus.recorded_values import RecordedValues
from sniff.bus.router import Router, octets_of, reads_in
from sniff.bus.thinning import Budget
from sniff.capture.ipc import Batch, Ended, HeardOctets, ReceivedMessage, Status, Tick, one_by_one
from sniff.capture.link import CaptureLink
from sniff.engine.blocks import Block, Gathering, blocks_of
from sniff.engine.bulk import BulkEngine
from sniff.engine.engine import Output
from sniff.engine.session import LineEvent, Session
from sniff.engine.table import Table
from sniff.recording.derived_message import DerivedMessage

AT_ONCE = 0.2
"""Seconds that one `poll` may spend with the engine."""

TO_THE_END = 1.0
"""Seconds that the engines get for what had come when the capture ended, or was asked to."""

LATE_MOST = 16 << 10
"""Octets that are looked at all the same after that: the last ones of a capture that took its time to end."""

PIECE = 8192
"""Octets that are not gathered any further: so many are given to the engine at a time."""

UNWATCHED = NS_PER_S // 2
"""ns that reads are gathered for where nobody looks at single rows: so much at once costs a tenth a frame."""

LISTENED = 60 * NS_PER_S
"""ns before which silence says nothing of a bus."""

LiveItem = Output | LineEvent | Status | Ended
LiveTables = Table | Output | LineEvent | Status | Ended
"""Few rows come as objects, many as a table."""


class BusListener(Protocol):
    """Somebody who is told what becomes known of running buses. Called by whoever polls: must not wait for anything."""

    def on_samples(self, live: LiveBus, samples: Sequence[Sample]) -> None:
        """Values were read."""

    def on_derived(self, live: LiveBus, messages: list[DerivedMessage]) -> None:
        """A second is over; its statistics, and findings every few seconds, as they go into a recording."""

    def on_event(self, live: LiveBus, event: LineEvent) -> None:
        """Something happened to the line."""

    def on_time(self, live: LiveBus, now: int) -> None:
        """It is `now` (ns) on the capture's clock; comes some times a second."""

    def on_end(self, live: LiveBus) -> None:
        """The capture is over."""


class LiveBus:
    """One bus of a running capture. Not thread-safe; nothing here can hold up the recording.

    `session`: of the bus; `status`: the newest report; `ended`: why it is over, None while it runs. `model`: what is
    known of the bus; its values and findings go back into the recording. `ear`: what is kept to hold it against the
    other buses of the capture, where there are any (`beside_others`). `search`: finds what `session.unknown` names,
    None when everything is given; its octets are recorded like all others. When it ends, `session`, `dissector` and
    the model's become others, before the event and the outputs that this gives are handed out. `unseen`: octets that
    came here, or were on their way, and were never looked at. `now`: ns, up to when all that was heard has come here,
    None before anything was said of it.
    """

    def __init__(
        self,
        link: CaptureLink,
        bus: int = 0,
        devices: Devices | None = None,
        detecting: Detecting | None = None,
        router: Router | None = None,
        watched: bool = True,
    ) -> None:
        """`router`: shared by all buses of the link; a bus that is shown alone has its own. `watched`: whether somebody
        looks at rows and values as they come; else rows may be half a second late, and `model.points` stays empty.
        """
        self.link = link
        self._router = router or Router(link)
        self._router.open(bus)
        self.bus = bus
        self.engine = BulkEngine(link.session(bus))
        self.search = None
        if detecting is not None:
            self.search = Search(link, detecting, "line" not in self.session.unknown, bus)
        self.status = Status(bus, path=link.paths[bus] if bus < len(link.paths) else "", priority=link.priority)
        self.ended: Ended | None = None
        self.devices = devices or Devices()
        self._pending: deque[Batch] = deque()
        self.beside_others = False
        self._gathering = Gathering()  # reads that wait for the engine
        self._gathered_since = 0  # when the first of them came, ns
        self._now: int | None = None  # up to when all that was heard has come here, and silence was not told yet
        self.now: int | None = None
        self._patience = 0 if watched else UNWATCHED
        self._late = 0  # octets looked at although their time is over
        self._skipped = 0
        self._values = RecordedValues(self.session.bus, self.dissector, self.devices) if link.paths else None
        self._nodes_budget = Budget(NODES_A_SECOND, NODES_AT_ONCE)
        self._listener: BusListener | None = None
        self.model = BusModel(self.session, self.dissector, self.devices, with_points=watched)
        self.model.is_early, self.model.listened_until = self._is_early, self._listened_until
        self.ear = SiteEar()
        self._settle()

    def tell(self, listener: BusListener) -> None:
        """From now on tell somebody what becomes known, values too; call it before the first `poll`."""
        self._listener = listener
        self.model.read_points()
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

    def findings(self) -> tuple[Finding, ...]:
        """What the rules found so far; that nothing is heard only once it was listened for a while."""
        return self.model.findings()

    def _is_early(self) -> bool:
        return self.link.clock.now() - self.session.started < LISTENED

    def _listened_until(self) -> int | None:
        return self.now if self.ended is None else None

    @property
    def searching(self) -> SearchProgress | None:
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
        """What has come, in order, row by row; waits up to `timeout` seconds. The end closes the engine and comes last.

        What takes longer than some tenths of a second waits for the next call.
        """
        return list(_row_by_row(self.poll_tables(timeout)))

    def poll_tables(self, timeout: float = 0.0) -> list[LiveTables]:
        """The same, many rows at a time."""
        items: list[LiveTables] = []
        if self._pending:
            self.link.look()
        else:
            self._pending.extend(self._router.receive(self.bus, timeout))
        self._router.insist()
        until = time.monotonic() + AT_ONCE
        while self._pending:
            if not self._is_late and time.monotonic() >= until:
                break
            items += self._next()
            if not self._pending and self.link.over_since is not None:  # the end is near: go there
                self._pending.extend(self._router.receive(self.bus))
        return items if self.ended is not None else [*items, *self._up_to_now()]

    @property
    def _is_late(self) -> bool:
        """Whether what is pending has had its time."""
        since = self.link.over_since
        return since is not None and time.monotonic() >= since + TO_THE_END

    def _next(self) -> list[LiveTables]:
        """Take the next message; once the time is over, reads are only counted."""
        message = self._pending.popleft()
        came, octets = reads_in(message), octets_of(message)
        if isinstance(message, Ended) or came is None or not octets:
            return self._take(message)
        if message.bus != self.bus:
            return []
        if self._is_late:
            self._late += octets
            if self._late > LATE_MOST:
                self._skipped += octets
                return []
        if self._values is not None:
            self._values.hear(octets, len(came) if isinstance(came, Block) else 1)
        if self.engine.searching:
            return self._search_on(message)
        if not self._gathering.count:
            self._gathered_since = int(came.reads.times[0]) if isinstance(came, Block) else came.time
        self._gathering.add(came)
        return self._look() if self._gathering.octets >= PIECE else []

    def _search_on(self, message: Batch) -> list[LiveTables]:
        """Take reads while settings are searched for."""
        items: list[LiveTables] = []
        for one in one_by_one([message]):
            if self.search is not None:
                self.search.take(one)
            if isinstance(one, ReceivedMessage):
                items += self._some(self.engine.take(block) for block in blocks_of([one.item]))
        return items

    def _look(self) -> list[LiveTables]:
        """Give the engine what was gathered."""
        return self._some(self.engine.take_some(self._gathering.take())) if self._gathering.count else []

    def _up_to_now(self) -> list[LiveTables]:
        """All that has come goes to the engine, unless more may be waited for; then what silence completes."""
        items: list[LiveTables] = []
        now = self._now
        if self._gathering.count:
            waited = None if now is None else now - self._gathered_since
            if self._patience and (waited is None or 0 <= waited < self._patience):
                return []
            items = self._look()
        return [*items, *self._advance()]

    def _advance(self) -> list[LiveTables]:
        """What silence completes."""
        now, self._now = self._now, None
        deadline = self.engine.deadline()
        due = now is not None and (deadline is None or now >= deadline)
        return self._some(self.engine.advance(now)) if due and now is not None else []

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
        told = (self.link.paths or self._listener is not None) and not self.engine.searching
        self._bus_channels = BusChannels(self.model) if told else None

    def _take(self, message: Batch) -> list[LiveTables]:
        """Take anything but reads."""
        if self.search is not None and self.engine.searching and not isinstance(message, HeardOctets):
            self.search.take(message)
        if isinstance(message, Ended):
            items = self._look()
            self.ended = message
            self.link.let_go()
            items += self._some([self.engine.close()])
            if self._listener is not None:
                self._listener.on_end(self)
            return [*items, message]
        if message.bus != self.bus:
            return []
        if isinstance(message, Status):
            self.status = message
            return [message]
        if isinstance(message, Tick):
            return self._pass_time(message.now)
        if isinstance(message, ReceivedMessage) and isinstance(message.item, LineEvent):
            return self._happen(message.item)
        return []

    def _pass_time(self, now: int) -> list[LiveTables]:
        """All that was heard up to `now` (ns) has come here."""
        self._now = self.now = now
        if self._values is not None:
            self._values.pass_time(now)
        items: list[LiveTables] = []
        if self._bus_channels is not None:
            items = [*self._look(), *self._advance()] if self._bus_channels.is_due(now) else []
            messages = self._bus_channels.due(now, self._nodes_budget.take)
            if messages:
                self._send(messages)
        if self._listener is not None:
            self._listener.on_time(self, now)
        return items

    def _happen(self, event: LineEvent) -> list[LiveTables]:
        """Take what happened to the line."""
        items = self._look()
        was_searching = self.engine.searching
        table = self.engine.take(event)
        if was_searching and not self.engine.searching:
            self.model.settle(self.session, self.dissector)
            if self._values is not None:
                self._values.settle(self.dissector)
            self._settle()
        self.model.add_line_event(event)
        self.ear.add_line_event(event)
        if self._listener is not None:
            self._listener.on_event(self, event)
        return [*items, event, *self._some([table])]

    def _some(self, made: Iterable[Output | Table]) -> list[LiveTables]:
        items: list[LiveTables] = []
        for one in made:
            if not one:
                continue
            items.append(one)
            for observer in (self.model, self._bus_channels, self.ear if self.beside_others else None):
                if observer is not None and isinstance(one, Table):
                    observer.add_table(one)
                elif observer is not None and isinstance(one, Output):
                    observer.add(one)
            if self._values is not None:
                read = self.model.reads_points
                for value in self._values.of_samples(self.model.samples) if read else self._values.of_rows(one):
                    self.link.derived(self.bus, value)
            if self._listener is not None and self.model.samples:
                self._listener.on_samples(self, self.model.samples)
        return items

    def _send(self, messages: list[DerivedMessage]) -> None:
        """Send statistics and findings back into the file, best effort; tell them to whoever listens."""
        if self._listener is not None:
            self._listener.on_derived(self, messages)
        for one in messages if self.link.paths else ():
            self.link.derived(self.bus, one)


def _row_by_row(items: list[LiveTables]) -> Iterator[LiveItem]:
    for item in items:
        if isinstance(item, Table):
            yield from item.outputs()
        else:
            yield item
