"""Two protocols on one bus: what the first calls noise, or a damaged frame, and the second makes good frames of. Pure.

A stretch of such octets, between two good frames of the first protocol, is read by the second on its own; so no frame
of it spans one of the first, and each octet stays in one row. Frames of the second take the numbers of the rows in
which they begin. They belong to no exchange: who asked whom cannot be told where others spoke between.

That there is a second protocol is told by the first octets that are left (`with_second`), whoever named the first: the
octets, the file or the user. On a bus with one protocol nothing that is left makes good frames of another.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import accumulate

import numpy as np

from dissectors import registry
from dissectors.frame import Chunk, Frame, Noise, Place, Reason
from dissectors.line import NS_PER_S, Timing
from dissectors.manifest import Dissector
from sniff.analysis.rest_evidence import second_in
from sniff.bus.offline import ReadSource, outputs
from sniff.bus.tables_ahead import TablesAhead
from sniff.engine.capture import CaptureError
from sniff.engine.engine import Engine, Output, Row
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import SECOND_NOTE, LineEvent, Session
from sniff.engine.table import Table, rows_at
from sniff.engine.verdict_join import JudgedRow, Wanted

MOST = 1 << 16
"""Octets of a stretch that are held."""

SAMPLE = 6000
"""Octets which the first protocol leaves that are asked for a second one."""

LOOKED_AT = 1 << 20
"""Octets of a capture, at least, among which they are looked for before any row is shown."""

Judged = tuple[JudgedRow, Dissector]


# -- whether there is one ----------------------------------------------------------------------------------------


def with_second(capture: ReadSource, session: Session, ahead: TablesAhead | None = None) -> Session:
    """The session with the second protocol of a bus by name (SECOND_NOTE), where octets that the first leaves prove
    one. Reads the begin of the capture: `ahead`, its tables; None: row by row, for comparison."""
    if SECOND_NOTE in session.notes:
        return session
    name = _second_in(_left_at_first(capture, session, ahead), session)
    return session if name is None else replace(session, notes={**session.notes, SECOND_NOTE: name})


def _second_in(left: Sequence[Row], session: Session) -> str | None:
    """The protocol that makes good frames of rows which the first one leaves."""
    if not left or session.unknown or session.protocol not in registry.names():  # a relative on networks has streams
        return None
    others = [one.name for one in registry.usable() if one.name != session.protocol]
    found = second_in([Chunk(row.event.end, row.event.octets[:SAMPLE]) for row in left], session, others)
    return None if found is None else found[0]


def _left_at_first(capture: ReadSource, session: Session, ahead: TablesAhead | None) -> list[Row]:
    """What the first protocol leaves of the begin of a capture."""
    left: list[Row] = []
    octets = seen = 0
    given = _left_by_reference(capture, session) if ahead is None else _left_of_tables(ahead)
    try:
        for passed, rows in given:
            seen += passed
            for row in rows:
                if octets >= SAMPLE:
                    return left
                left.append(row)
                octets += len(row.event.octets)
            if seen >= LOOKED_AT:
                break
    except CaptureError:
        pass  # whoever reads on is told
    return left


def _left_of_tables(ahead: TablesAhead) -> Iterator[tuple[int, Iterable[Row]]]:
    for table in ahead.look():
        if isinstance(table, Table):
            yield len(table.octets), _left_rows(table)


def _left_by_reference(capture: ReadSource, session: Session) -> Iterator[tuple[int, Iterable[Row]]]:
    for output in outputs(capture.items(), session):
        if isinstance(output, Output):
            yield sum(len(row.event.octets) for row in output.rows), filter(_is_left, output.rows)


def _left_rows(table: Table) -> list[Row]:
    return rows_at(table, np.flatnonzero(~table.good & table.heard).tolist())


# -- how many ----------------------------------------------------------------------------------------------------


class ForeignFrames:
    """An observer that counts the good frames of a second protocol, if what the first leaves proves one."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._name = session.notes.get(SECOND_NOTE)
        self._sample: list[Row] | None = [] if self._name is None else None  # until it is asked
        self._sampled = 0
        self._held: list[Row] = []
        self._octets = self._counted = 0

    def add(self, output: Output) -> None:
        """Take what an engine gave."""
        for row in filter(_is_left, output.rows):
            self._see(row)

    def add_table(self, table: Table) -> None:
        """Take the same as columns."""
        if self._sample is not None or self._name is not None:
            for row in _left_rows(table):
                self._see(row)

    def add_line_event(self, event: LineEvent) -> None:
        """It is no frame."""

    def told(self) -> tuple[Dissector, int] | None:
        """The protocol and how many frames of it, so far; None where the bus has one protocol."""
        self._ask()
        self._flush()
        return None if self._name not in registry.names() else (registry.get(self._name), self._counted)

    def _see(self, row: Row) -> None:
        if self._sample is None:
            self._count(row)
            return
        self._sample.append(row)
        self._sampled += len(row.event.octets)
        if self._sampled >= SAMPLE:
            self._ask()

    def _ask(self) -> None:
        sample, self._sample = self._sample, None
        if sample is not None:
            self._name = _second_in(sample, self._session)
            for row in sample:
                self._count(row)

    def _count(self, row: Row) -> None:
        if self._octets >= MOST or (self._held and row.no != self._held[-1].no + 1):
            self._flush()
        self._held.append(row)
        self._octets += len(row.event.octets)

    def _flush(self) -> None:
        if self._held and self._name in registry.names():
            self._counted += len(_frames(self._held, self._session, registry.get(self._name)))
        self._held, self._octets = [], 0


# -- which they are ----------------------------------------------------------------------------------------------


def of_both(
    items: Iterator[JudgedRow], session: Session, second: str, wanted: Wanted, of_second: Wanted | None
) -> Iterator[Judged]:
    """All rows with the dissector of each, as far as they are wanted; `of_second` None: none of the second protocol."""
    first, other = dissector_for(session), registry.get(second)
    for item, dissector in _rows(items, session, first, other):
        accepts = wanted if dissector is first else of_second
        if accepts is not None and accepts(item.row, item.transaction):
            yield item, dissector


def _rows(items: Iterator[JudgedRow], session: Session, first: Dissector, second: Dissector) -> Iterator[Judged]:
    held: list[JudgedRow] = []
    octets = 0
    for item in items:
        if _is_left(item.row):
            held.append(item)
            octets += len(item.row.event.octets)
            if octets < MOST:
                continue
            item_after = None
        else:
            item_after = item
        yield from _told(held, session, first, second)
        held, octets = [], 0
        if item_after is not None:
            yield item_after, first
    yield from _told(held, session, first, second)


def _is_left(row: Row) -> bool:
    """Whether the first protocol makes nothing good of a row."""
    return row.searched is None and (isinstance(row.event, Noise) or not row.event.ok)


def _told(held: list[JudgedRow], session: Session, first: Dissector, second: Dissector) -> Iterator[Judged]:
    """The rows of a stretch, good frames of the second protocol in place of what they cover."""
    frames = _frames([item.row for item in held], session, second) if held else []
    at = 0
    for begin, row in frames:
        yield from ((item, first) for item in _between(held, at, begin))
        number = next(item.row.no for item, end in zip(held, _ends(held), strict=True) if begin < end)
        yield JudgedRow(replace(row, no=number), None), second
        at = begin + len(row.event.octets)
    yield from ((item, first) for item in _between(held, at, 1 << 62))


def _frames(held: list[Row], session: Session, second: Dissector) -> list[tuple[int, Row]]:
    """Good frames of the second protocol, and where in the stretch each begins."""
    engine = Engine(second, Timing(session.line, session.adapter.latency), pairing=False)
    outputs = [engine.feed(Chunk(row.event.end, row.event.octets)) for row in held]
    outputs.append(engine.advance(held[-1].event.end + 10 * NS_PER_S))
    outputs.append(engine.close())
    rows = [row for output in outputs for row in output.rows]
    begins = accumulate((len(row.event.octets) for row in rows), initial=0)
    return [
        (begin, row) for begin, row in zip(begins, rows, strict=False) if isinstance(row.event, Frame) and row.event.ok
    ]


def _ends(held: list[JudgedRow]) -> Iterator[int]:
    """Where in the stretch each row ends."""
    return accumulate(len(item.row.event.octets) for item in held)


def _between(held: list[JudgedRow], begin: int, end: int) -> Iterator[JudgedRow]:
    """The rows of a part of the stretch; of one that is only partly in it what is left, as noise."""
    for item, upto in zip(held, _ends(held), strict=True):
        event = item.row.event
        since = upto - len(event.octets)
        low, high = max(begin, since), min(end, upto)
        if low >= high:
            continue
        if (low, high) == (since, upto):
            yield item
            continue
        octets = event.octets[low - since : high - since]
        place, reason = (event.place, event.reason) if isinstance(event, Noise) else (Place.BETWEEN, Reason.NO_FRAME)
        rest = Noise(octets, event.start, event.end, place, reason)
        yield JudgedRow(Row(item.row.no, rest), None)
