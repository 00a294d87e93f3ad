"""What a recording holds beside frames, of a capture that is written anew: /values, /bus, /nodes and /findings as live.

Windows are those of the capture's clock, a second each while something is said; a silence is one window. Findings are
told once, when all is read, at the time of their last evidence. Pure: messages out.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from dissectors.line import NS_PER_S
from dissectors.profiles import Devices
from sniff.bus.derived_topics import NODES_A_SECOND, NODES_AT_ONCE, WINDOW, BusChannels, DerivedMessage
from sniff.bus.model import BusModel
from sniff.bus.recorded_values import RecordedValues
from sniff.bus.thinning import Budget
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import LineEvent, Session
from sniff.engine.table import Table


class OfflineTopics:
    """Of one bus whose settings are known. Fed the tables of the whole capture in order."""

    def __init__(self, session: Session, devices: Devices, with_values: bool = True) -> None:
        """`with_values`: values of points too, as many as a recording has room for."""
        dissector = dissector_for(session)
        self._model = BusModel(session, dissector, devices, with_points=False)
        self._is_ring = dissector.ring is not None
        self._channels = BusChannels(self._model, judged_every=0)
        self._values = RecordedValues(session.bus, dissector, devices) if with_values else None
        self._nodes = Budget(NODES_A_SECOND, NODES_AT_ONCE)
        self._end: int | None = None  # of the window
        self._last = 0

    def add_line_event(self, event: LineEvent) -> None:
        """Take something that happened to the line."""
        self._model.add_line_event(event)

    def add_table(self, table: Table) -> Iterator[DerivedMessage]:
        """Take rows; what is to be written by then."""
        if not self._is_ring:  # numbers of a ring are compared window by window
            self._model.add_table(table)
        at = 0
        if len(table) and table.has_true_times:
            ends = np.maximum.accumulate(np.maximum(table.frames.end, self._last))
            self._last = int(ends[-1])
            while at < len(table):
                if self._end is None:
                    self._end = int(ends[at]) + WINDOW
                    self._due(int(ends[at]))
                stop = int(np.searchsorted(ends, self._end))
                if stop > at:
                    yield from self._part(table.part(at, stop))
                if stop < len(table):
                    yield from self._windows(int(ends[stop]))
                at = stop
        elif table:
            yield from self._part(table)

    def close(self) -> Iterator[DerivedMessage]:
        """What is left: the last window and the findings."""
        if self._end is not None:
            yield from self._due(self._end)
        yield from self._channels.findings()

    def _part(self, part: Table) -> Iterator[DerivedMessage]:
        """Rows of one window."""
        if self._is_ring:
            self._model.add_table(part)
        self._channels.add_table(part)
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
            silent = (following - self._end) // NS_PER_S * NS_PER_S
            if silent:
                self._end += silent
                yield from self._due(self._end)
            self._end += WINDOW

    def _due(self, now: int) -> list[DerivedMessage]:
        if self._values is not None:
            self._values.pass_time(now)
        return self._channels.due(now, self._nodes.take)
