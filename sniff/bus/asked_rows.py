"""Rows with the points and findings of their frames, for a filter that asks for them."""

from __future__ import annotations

import contextlib
from collections import OrderedDict
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Generic, TypeVar

import numpy as np

from dissectors.columns import Masks, Times
from dissectors.frame import Frame
from dissectors.manifest import Dissector
from dissectors.meaning import Meaning
from dissectors.profiles import Devices
from sniff.analysis.point_reader import MOST_OPEN, PointReader
from sniff.analysis.table_points import samples_of
from sniff.analysis.wording import describe
from sniff.bus.offline import survey
from sniff.engine.capture import CaptureError
from sniff.engine.engine import Output, Row
from sniff.engine.follow_settings import dissector_for
from sniff.engine.observer import Observer
from sniff.engine.read_source import ReadSource
from sniff.engine.session import LineEvent, Session
from sniff.engine.table import Table
from sniff.filter.scope import ToldPoint
from sniff.filter.told import TYPES, told

Fields = Mapping[str, int | float | str]
Kept = TypeVar("Kept")


class PointsTold:
    """Values by the number of the row that carries them. `most`: rows that are remembered, the newest; None: all."""

    def __init__(self, reader: PointReader, names: Collection[str], most: int | None = None) -> None:
        self._reader = reader
        self._names = None if set(names) & TYPES.keys() else frozenset(names)
        self._most = most
        self._told: dict[int, list[ToldPoint]] = {}
        self._rows: Times | None = None

    def add_table(self, table: Table) -> None:
        """Take the table that follows."""
        samples = samples_of(self._reader, table)
        if self._names is not None:
            samples = samples.named(self._names.__contains__)
        for sample in samples.in_order():
            self._told.setdefault(sample.frame, []).append(told(sample.value))
        self._rows = None
        while self._most is not None and len(self._told) > self._most:
            del self._told[next(iter(self._told))]

    def add(self, output: Output) -> None:
        """Take what the engine gave of single rows."""
        for sample in self._reader.add(output):
            if self._names is None or sample.name in self._names:
                self._told.setdefault(sample.frame, []).append(told(sample.value))
        self._rows = None

    def add_line_event(self, event: LineEvent) -> None:
        """Says nothing of points."""

    def of(self, no: int) -> Sequence[ToldPoint]:
        """The values that a row carries."""
        return self._told.get(no, ())

    def telling(self, first: int, count: int) -> Masks:
        """Which of the rows from a number on carry any."""
        if self._rows is None:
            self._rows = np.array(sorted(self._told), np.int64)
        begin, end = np.searchsorted(self._rows, (first, first + count))
        masks: Masks = np.zeros(count, bool)
        masks[self._rows[begin:end] - first] = True
        return masks


def points_told(capture: ReadSource, session: Session, devices: Devices, names: Collection[str]) -> PointsTold:
    """Of a whole capture, the points of these names; of a damaged one as far as it can be read."""
    points = PointsTold(PointReader(dissector_for(session), devices), names)
    _survey(capture, session, points)
    return points


class Meant(Generic[Kept]):
    """Something of the frames whose exchanges have closed, by the number of the row: what `take` makes of a row and
    what is known of it beside its octets; None for nothing. `most`: of the newest that are remembered; None: all."""

    def __init__(
        self,
        dissector: Dissector,
        devices: Devices,
        take: Callable[[Row, Meaning], Kept | None],
        most: int | None = None,
    ) -> None:
        self._reader = PointReader(dissector, devices)
        self._take, self._most = take, most
        self._open: OrderedDict[int, Row] = OrderedDict()
        self._kept: OrderedDict[int, Kept] = OrderedDict()

    def add(self, output: Output) -> None:
        """Take rows and the exchanges that closed with them."""
        for one in output.one_by_one():
            self._take_one(one)

    def _take_one(self, output: Output) -> None:
        self._open.update((row.no, row) for row in output.rows if row.placement is not None)
        self._reader.remember(output)
        for transaction in output.transactions:
            for no in (transaction.request, transaction.response):
                row = self._open.pop(no, None) if no is not None else None
                meaning = self._reader.meaning(row) if row is not None else None
                made = self._take(row, meaning) if row is not None and meaning is not None else None
                if row is not None and made is not None:
                    self._kept[row.no] = made
        while len(self._open) > MOST_OPEN:
            self._open.popitem(last=False)
        while self._most is not None and len(self._kept) > self._most:
            self._kept.popitem(last=False)

    def add_line_event(self, event: LineEvent) -> None:
        """Says nothing of frames."""

    def of(self, row: Row) -> Kept | None:
        """What was made of a row."""
        return self._kept.get(row.no)


def lines_said(capture: ReadSource, session: Session, devices: Devices) -> Callable[[Row], str]:
    """The lines of a whole capture, with what frames mean to their devices; of a damaged one as far as it can be
    read."""
    dissector = dissector_for(session)

    def line(row: Row, meaning: Meaning) -> str | None:
        return None if meaning.profile is None else describe(dissector, row, meaning)

    said = Meant(dissector, devices, line)
    _survey(capture, session, said)
    return lambda row: said.of(row) or describe(dissector, row)


def answers_told(dissector: Dissector, names: Collection[str], most: int | None = None) -> Meant[Fields]:
    """Fields of answers that only their requests tell, those of these names."""

    def fields(row: Row, meaning: Meaning) -> Fields | None:
        if meaning.request is None or dissector.answer_fields is None or not isinstance(row.event, Frame):
            return None
        told = dissector.answer_fields(meaning.request, row.event)
        return {name: value for name, value in told.items() if name in names} or None

    return Meant(dissector, Devices(), fields, most)


def fields_answered(capture: ReadSource, session: Session, names: Collection[str]) -> Callable[[Row], Fields]:
    """The same of a whole capture."""
    told = answers_told(dissector_for(session), names)
    _survey(capture, session, told)
    return lambda row: told.of(row) or {}


def _survey(capture: ReadSource, session: Session, observer: Observer) -> None:
    with contextlib.suppress(CaptureError):  # who shows the rows says so
        survey(capture, session, observer)
