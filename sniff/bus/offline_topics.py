"""The topics beside frames of a capture that is written anew: /values, /bus, /nodes and /findings as live.

Windows are those of the capture's clock, a second each while something is said; a silence is one window. Findings are
told once, when all is read, at the time of their last evidence. Pure: messages out.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from dissectors.columns import Times
from dissectors.profiles import Devices
from sniff.analysis.summaries import summaries
from sniff.bus.derived_topics import NODES_A_SECOND, NODES_AT_ONCE, WINDOW, BusChannels, DerivedMessage
from sniff.bus.model import BusModel
from sniff.bus.recorded_values import RecordedValues
from sniff.bus.thinning import Budget
from sniff.bus.watched_ring import WatchedRing
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import LineEvent, Session
from sniff.engine.table import Table


class OfflineTopics:
    """Of one bus whose settings are known. Fed the tables of the whole capture in order."""

    def __init__(self, session: Session, devices: Devices, with_values: bool = True) -> None:
        """`with_values`: values of points too, as many as a recording has room for."""
        dissector = dissector_for(session)
        self._model = BusModel(session, dissector, devices, with_points=False)
        self._line = session.line
        ring = dissector.ring
        self._ring = WatchedRing(ring.observer(session.timing)) if ring is not None else None
        ring_of = self._ring.observer.ring if self._ring is not None else None
        self._channels = BusChannels(self._model, judged_every=0, ring_of=ring_of)
        self._values = RecordedValues(session.bus, dissector, devices) if with_values else None
        self._nodes = Budget(NODES_A_SECOND, NODES_AT_ONCE)
        self._end: int | None = None  # of the window
        self._last = 0

    def add_line_event(self, event: LineEvent) -> None:
        """Take something that happened to the line."""
        self._model.add_line_event(event)
        if self._ring is not None:
            self._ring.add_line_event(event)

    def add_table(self, table: Table) -> Iterator[DerivedMessage]:
        """Take rows; what is to be written by then."""
        self._model.add_table(table)
        if len(table) and table.has_true_times:
            ends = np.maximum.accumulate(np.maximum(table.frames.end, self._last))
            self._last = int(ends[-1])
            if self._end is None:
                self._end = int(ends[0]) + WINDOW
                self._due(int(ends[0]))
            yield from self._window_by_window(table, ends, self._stops(ends, self._end))
        elif table:
            self._channels.add_table(table)
            yield from self._part(table)

    def _window_by_window(self, table: Table, ends: Times, stops: list[int]) -> Iterator[DerivedMessage]:
        """Rows that end by `ends`; those before each of `stops` belong to one window."""
        at = 0
        for stop, summary in zip(stops, summaries(self._line, table, stops), strict=True):
            if stop > at:
                self._channels.add_summary(summary)
                yield from self._part(table.part(at, stop))
            if stop < len(table):
                yield from self._windows(int(ends[stop]))
            at = stop

    @staticmethod
    def _stops(ends: Times, end: int) -> list[int]:
        """Places in front of which a window is over, and that of the table's end. `end`: of the window that is open."""
        stops: list[int] = []
        while not stops or stops[-1] < len(ends):
            stops.append(int(np.searchsorted(ends, end)))
            if stops[-1] < len(ends):
                end = _last_due(end, int(ends[stops[-1]])) + WINDOW
        return stops

    def close(self) -> Iterator[DerivedMessage]:
        """What is left: the last window and the findings."""
        if self._end is not None:
            yield from self._due(self._end)
        yield from self._channels.findings()

    def _part(self, part: Table) -> Iterator[DerivedMessage]:
        """Rows of one window."""
        if self._ring is not None:
            self._ring.add_table(part)
        if self._values is None:
            return
        self._values.hear(int(part.frames.length.sum()), len(part))
        for value in self._values.of_rows(part):
            yield DerivedMessage(value.topic, value.schema, value.time, value.time, value.data, value.metadata)

    def _windows(self, following: int) -> Iterator[DerivedMessage]:
        """Windows that end before the next row does."""
        assert self._end is not None
        yield from self._due(self._end)
        self._end += WINDOW
        if following >= self._end:  # nothing was said in that one
            yield from self._due(self._end)
            last = _last_due(self._end - WINDOW, following)
            if last > self._end:
                self._end = last
                yield from self._due(self._end)
            self._end += WINDOW

    def _due(self, now: int) -> list[DerivedMessage]:
        if self._values is not None:
            self._values.pass_time(now)
        return self._channels.due(now, self._nodes.take)


def _last_due(end: int, following: int) -> int:
    """When the last window is over that ends before the next row does, where one ends at `end`: silence is one."""
    return end + max(0, following - end) // WINDOW * WINDOW
