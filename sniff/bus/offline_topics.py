"""The topics beside frames of a capture that is written anew: /values, /bus, /nodes and /findings as live.

Windows are those of the capture's clock, a second each while something is said; a silence is one window. Findings are
told once, when all is read, at the time of their last evidence. Pure: messages out.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from dissectors.columns import Times
from dissectors.profiles import Devices
from sniff.analysis.summaries import summaries
from sniff.bus.derived_topics import NODES_A_SECOND, NODES_AT_ONCE, WINDOW, BusChannels
from sniff.bus.model import BusModel
from sniff.bus.recorded_values import RecordedValues
from sniff.bus.thinning import Budget
from sniff.bus.watched_ring import WatchedRing
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import LineEvent, Session
from sniff.engine.table import Table
from sniff.recording.derived_message import DerivedMessage


class _Stretch(NamedTuple):
    """Rows `begin` to before `stop` of a table; `over`: when the windows end that are over then, ns."""

    begin: int
    stop: int
    over: tuple[int, ...]


class OfflineTopics:
    """Of one bus whose settings are known. Fed the tables of the whole capture in order."""

    def __init__(self, session: Session, devices: Devices, with_values: bool = True) -> None:
        """`with_values`: values of points too, as many as a recording has room for."""
        dissector = dissector_for(session)
        self._model = BusModel(session, dissector, devices, with_points=False)
        self._line = session.line
        ring = dissector.ring
        self._ring = WatchedRing(ring.observer(session.timing)) if ring is not None else None
        window = self._ring.window if self._ring is not None else None
        self._channels = BusChannels(self._model, judged_every=0, ring_window=window)
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
            before = self._last
            ends = np.maximum.accumulate(np.maximum(table.frames.end, before))
            self._last = int(ends[-1])
            if self._end is None:
                self._end = int(ends[0]) + WINDOW
                self._due(int(ends[0]))
            yield from self._stretch_by_stretch(table, self._stretches(ends), np.append(before, ends))
        elif table:
            self._channels.add_table(table)
            if self._ring is not None:
                self._ring.add_table(table)
                if len(table):
                    self._ring.window()  # times that are none belong to no second
            if self._values is not None:
                self._values.hear(int(table.frames.length.sum()), len(table))
                yield from self._values.of_rows(table)

    def _stretches(self, ends: Times) -> list[_Stretch]:
        """Of rows that end by `ends`: those of a window each, the last of which is still open."""
        assert self._end is not None
        made: list[_Stretch] = []
        begin = 0
        while True:
            stop = int(np.searchsorted(ends, self._end))
            if stop == len(ends):
                return [*made, _Stretch(begin, stop, ())]
            over = _windows_over(self._end, int(ends[stop]))
            made.append(_Stretch(begin, stop, over))
            begin, self._end = stop, over[-1] + WINDOW

    def _stretch_by_stretch(self, table: Table, stretches: list[_Stretch], ends: Times) -> Iterator[DerivedMessage]:
        """`ends`: of all before each row."""
        stops = [stretch.stop for stretch in stretches]
        values, ring, parts = self._values, self._ring, None
        lengths = np.cumsum(np.append(0, table.frames.length)).tolist()
        telling = None if values is None else values.of_table(table)
        if ring is not None:
            told = [(table.first + one.stop, int(ends[one.stop])) for one in stretches for _ in one.over]
            parts = None if ring.add_ahead(table, told) else table.parts([0, *stops])
        for stretch, summary in zip(stretches, summaries(self._line, table, stops), strict=True):
            begin, stop = stretch.begin, stretch.stop
            if ring is not None and parts is not None:
                ring.add_table(next(parts))
            if stop > begin:
                self._channels.add_summary(summary)
                if values is not None and telling is not None:
                    values.hear(lengths[stop] - lengths[begin], stop - begin)
                    yield from telling.until(stop)
            for now in stretch.over:
                yield from self._due(now)
        if telling is not None:
            yield from telling.rest()

    def close(self) -> Iterator[DerivedMessage]:
        """What is left: the last window and the findings."""
        if self._end is not None:
            yield from self._due(self._end)
        yield from self._channels.findings()

    def _due(self, now: int) -> list[DerivedMessage]:
        if self._values is not None:
            self._values.pass_time(now)
        return self._channels.due(now, self._nodes.take)


def _windows_over(end: int, following: int) -> tuple[int, ...]:
    """When windows are over before the next row ends, where one is over at `end`; a silence is one window."""
    last = end + (following - end) // WINDOW * WINDOW
    return tuple(sorted({end, min(end + WINDOW, last), last}))
