"""One task, done: captures read into what is known of their bus, day by day. Runs in a worker; loads no scapy."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import UTC, datetime

import numpy as np

from sniff.analysis.judging import Judging
from sniff.analysis.summary import Summary
from sniff.bus.offline import survey
from sniff.devices import noted_devices
from sniff.engine.capture import Capture, CaptureError
from sniff.engine.engine import Output
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import LineEvent, Session
from sniff.engine.table import Table
from sniff.fleet.archive import NS_PER_DAY, Task, Window
from sniff.fleet.bus_day import NO_DATE, BusDay, Judged, file_stem
from sniff.fleet.pieces import stretches

FAR = 1 << 62
"""ns; before and after everything."""

NAMELESS = Session.__dataclass_fields__["bus"].default
"""What a session calls a bus that nobody named."""

FIRST_DATE = 365 * 86_400 * 1_000_000_000
"""ns; whoever recorded in 1970 had no clock."""


def read_task(task: Task) -> list[BusDay]:
    """What the captures of a task tell, a value a day. Raises CaptureError for what cannot be read at all."""
    days: list[BusDay] = []
    for capture in stretches(task):
        days += _read(task, capture)
    return days


def _read(task: Task, capture: Capture) -> Iterator[BusDay]:
    session = capture.session
    notes = []
    by_day = ByDay(session, task.window)
    try:
        if session.unknown:
            notes.append(f"{' and '.join(session.unknown)} not known: nothing was found while it was recorded")
        survey(capture, session, by_day)
        complete = capture.completeness()
        if not complete.whole:
            notes.append(complete.text)
    except CaptureError as error:
        notes.append(str(error))
    sources = tuple(file.path for file in task.files)
    parts = by_day.parts
    if not parts and (task.window is None or notes):
        parts = {_day(session.started): DayObservers(session)}
    for day, part in parts.items():
        load = part.summary.load
        first, last = (load.first, load.last) if session.has_times else (None, None)
        yield BusDay(
            task.site,
            _bus_name(session, sources[0]),
            session.port,
            session.protocol,
            day,
            str(session.line),
            _without_seconds(part.summary),
            load.busy if session.has_times else 0,
            load.listened if session.has_times else 0,
            first,
            last,
            (Judged(load.first or 0, sources[0], part.judging.judgement()),),
            session.adapter.latency,
            sources,
            tuple(notes),
        )


class DayObservers:
    """The observers of one day."""

    def __init__(self, session: Session) -> None:
        self.summary = Summary(session.line, kept_seconds=0)
        self.judging = Judging(session, dissector_for(session), noted_devices(session))

    def add_table(self, table: Table) -> None:
        """Take rows of that day."""
        self.summary.add_table(table)
        self.judging.add_table(table)

    def add_line_event(self, event: LineEvent) -> None:
        """Take what happened to the line."""
        self.summary.add_line_event(event)
        self.judging.add_line_event(event)


class ByDay:
    """An observer that has others for each day. `parts`: by day of UTC, in the order of the capture. `window`: the rows
    that count are those that began in it; what closes without a row goes with the row before it."""

    def __init__(self, session: Session, window: Window | None = None) -> None:
        self.parts: dict[str, DayObservers] = {}
        self._session = session
        self._begin = window.begin if window is not None and window.begin is not None else -FAR
        self._end = window.end if window is not None and window.end is not None else FAR
        self._latest = -FAR

    def add(self, output: Output) -> None:
        """Take rows one by one."""
        first = output.rows[0].no if output.rows else 0
        self.add_table(Table.of_outputs(self._session.protocol, first, [output]))

    def add_table(self, table: Table) -> None:
        """Take rows; each belongs to the day on which it began."""
        if not len(table):
            if self._begin <= self._latest < self._end:
                self._last_part(lambda part: part.add_table(table))
            return
        starts = np.maximum(np.maximum.accumulate(table.frames.start), self._latest)
        self._latest = int(starts[-1])
        first, last = np.searchsorted(starts, (self._begin, self._end)).tolist()
        if first >= last:
            return
        numbers = starts[first:last] // NS_PER_DAY
        edges = (first + np.flatnonzero(np.append(True, numbers[1:] != numbers[:-1]))).tolist()
        for begin, end in zip(edges, [*edges[1:], last], strict=True):
            self._part(int(starts[begin])).add_table(table.part(begin, end))

    def add_line_event(self, event: LineEvent) -> None:
        """Take what happened to the line."""
        if self._begin <= event.time < self._end:
            self._part(event.time).add_line_event(event)

    def _part(self, time: int) -> DayObservers:
        day = _day(time)
        if day not in self.parts:
            self.parts[day] = DayObservers(self._session)
        return self.parts[day]

    def _last_part(self, step: Callable[[DayObservers], None]) -> None:
        if self.parts:
            step(next(reversed(self.parts.values())))


def _bus_name(session: Session, path: str) -> str:
    """What a bus is called: as its recording says, else by its port, else by its file."""
    return session.bus if session.bus != NAMELESS else file_stem(session.port or path) or NAMELESS


def _day(time: int) -> str:
    """The day of UTC; `NO_DATE` where times only count from the begin of a capture."""
    if time < FIRST_DATE:
        return NO_DATE
    seconds = min(time // 1_000_000_000, 253_402_300_799)
    return datetime.fromtimestamp(seconds, UTC).date().isoformat()


def _without_seconds(summary: Summary) -> Summary:
    summary.load.seconds.clear()
    return summary
