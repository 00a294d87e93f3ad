"""One task, done: captures read into what is known of their bus, day by day. Runs in a worker; loads no scapy."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import PurePath

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
from sniff.fleet.archive import NS_PER_DAY, Task
from sniff.fleet.bus_day import NO_DATE, BusDay
from sniff.formats import read
from sniff.formats.several_buses import buses_in
from sniff.recording.rotated import joined

NAMELESS = Session.__dataclass_fields__["bus"].default
"""What a session calls a bus that nobody named."""

FIRST_DATE = 365 * 86_400 * 1_000_000_000
"""ns; whoever recorded in 1970 had no clock."""


def read_task(task: Task) -> list[BusDay]:
    """What the captures of a task tell, a value a day. Raises CaptureError for what cannot be read at all."""
    opened = joined([(file.path, _bus_of(task, read(file.path))) for file in task.files])
    days: list[BusDay] = []
    for _, capture in opened:
        days += _read(task, capture)
    return days


def _bus_of(task: Task, capture: Capture) -> Capture:
    """The bus that a task is about."""
    return next(bus for bus in buses_in(capture) if task.bus in (None, bus.session.bus))


def _read(task: Task, capture: Capture) -> Iterator[BusDay]:
    session = capture.session
    notes = []
    by_day = ByDay(session)
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
    parts = by_day.parts or {_day(session.started): Part(session)}
    for day, part in parts.items():
        yield BusDay(
            task.site,
            _bus_name(session, sources[0]),
            session.port,
            session.protocol,
            day,
            str(session.line),
            _without_seconds(part.summary),
            part.summary.load.total.busy,
            max(0, (part.summary.load.last or 0) - (part.summary.load.first or 0)),
            part.summary.load.first,
            part.summary.load.last,
            part.judging.findings(),
            session.adapter.latency,
            sources,
            tuple(notes),
        )


class Part:
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
    """An observer that has others for each day. `parts`: by day of UTC, in the order of the capture."""

    def __init__(self, session: Session) -> None:
        self.parts: dict[str, Part] = {}
        self._session = session

    def add(self, output: Output) -> None:
        """Take rows one by one."""
        first = output.rows[0].no if output.rows else 0
        self.add_table(Table.of_outputs(self._session.protocol, first, [output]))

    def add_table(self, table: Table) -> None:
        """Take rows; each belongs to the day on which it began."""
        if not len(table):
            self._last_part(lambda part: part.add_table(table))
            return
        numbers = np.maximum.accumulate(table.frames.start // NS_PER_DAY)
        edges = np.flatnonzero(np.append(True, numbers[1:] != numbers[:-1])).tolist()
        for begin, end in zip(edges, [*edges[1:], len(table)], strict=True):
            self._part(int(numbers[begin]) * NS_PER_DAY).add_table(table.part(begin, end))

    def add_line_event(self, event: LineEvent) -> None:
        """Take what happened to the line."""
        self._part(event.time).add_line_event(event)

    def _part(self, time: int) -> Part:
        day = _day(time)
        if day not in self.parts:
            self.parts[day] = Part(self._session)
        return self.parts[day]

    def _last_part(self, step: Callable[[Part], None]) -> None:
        if self.parts:
            step(next(reversed(self.parts.values())))


def _bus_name(session: Session, path: str) -> str:
    """What a bus is called: as its recording says, else by its port, else by its file."""
    return session.bus if session.bus != NAMELESS else PurePath(session.port or path).name.split(".")[0] or NAMELESS


def _day(time: int) -> str:
    """The day of UTC; `NO_DATE` where times only count from the begin of a capture."""
    if time < FIRST_DATE:
        return NO_DATE
    seconds = min(time // 1_000_000_000, 253_402_300_799)
    return datetime.fromtimestamp(seconds, UTC).date().isoformat()


def _without_seconds(summary: Summary) -> Summary:
    summary.load.seconds.clear()
    return summary
