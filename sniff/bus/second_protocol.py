"""Two protocols on one bus: what the first calls noise, or a damaged frame, and the second makes good frames of. Pure.

A stretch of such octets, between two good frames of the first protocol, is read by the second on its own; so no frame
of it spans one of the first, and each octet stays in one row. Frames of the second take the numbers of the rows in
which they begin. They belong to no exchange: who asked whom cannot be told where others spoke between.

That there is a second protocol, and from which row on, is told by what is left (`second_proof.py`), whoever named the
first: the octets, the file or the user. On a bus with one protocol nothing that is left makes good frames of another.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import accumulate

from dissectors import registry
from dissectors.frame import Chunk, Frame, Noise, Place, Reason
from dissectors.line import NS_PER_S, Timing
from dissectors.manifest import Dissector
from sniff.bus.offline import outputs
from sniff.bus.second_proof import Proving, SecondProof, is_left, left_places
from sniff.engine.bulk import tables_of
from sniff.engine.capture import CaptureError
from sniff.engine.engine import Engine, Output, Row
from sniff.engine.follow_settings import dissector_for
from sniff.engine.read_source import ReadSource
from sniff.engine.session import LineEvent, Session
from sniff.engine.table import Table, rows_at
from sniff.engine.verdict_join import JudgedRow, Wanted

MOST = 1 << 16
"""Octets of a stretch that are held."""

FOREIGN, REST = -1, -2
"""What a part of a stretch is instead of a row of it: a frame of the second protocol, a piece of a row."""

Part = tuple[Row, int]
"""A row in place of those of a stretch, and the number of the row of the stretch that it is; FOREIGN, REST."""

Judged = tuple[JudgedRow, Dissector]


# -- stretches of what the first protocol leaves -------------------------------------------------------------------


class Stretch:
    """Rows that follow one another, of which the first protocol makes nothing good."""

    def __init__(self, session: Session, second: str) -> None:
        self.rows: list[Row] = []
        self._second = registry.get(second)
        self._timing = Timing(session.line, session.adapter.latency)
        self._octets = 0

    def add(self, row: Row) -> list[Part]:
        """Take the row that follows; of a stretch that grows too long give what is before its last frame's end."""
        self.rows.append(row)
        self._octets += len(row.event.octets)
        return self._given(False) if self._octets >= MOST else []

    def end(self) -> list[Part]:
        """Give all that is left; what follows is another stretch."""
        return self._given(True) if self.rows else []

    def _given(self, whole: bool) -> list[Part]:
        frames = self._frames()
        many = len(self.rows)
        if frames and not whole:
            ended = frames[-1][0] + len(frames[-1][1].event.octets)
            many = 1 + sum(end < ended for end in accumulate(len(row.event.octets) for row in self.rows))
            many = many if 2 * many > len(self.rows) else len(self.rows)
        given = list(_parts(self.rows[:many], frames))
        self.rows = self.rows[many:]
        self._octets = sum(len(row.event.octets) for row in self.rows)
        return given

    def _frames(self) -> list[tuple[int, Row]]:
        """Good frames of the second protocol, and where in the stretch each begins."""
        engine = Engine(self._second, self._timing, pairing=False)
        made = [engine.feed(Chunk(row.event.end, row.event.octets)) for row in self.rows]
        made.append(engine.advance(self.rows[-1].event.end + 10 * NS_PER_S))
        made.append(engine.close())
        rows = [row for output in made for row in output.rows]
        begins = accumulate((len(row.event.octets) for row in rows), initial=0)
        return [
            (begin, row)
            for begin, row in zip(begins, rows, strict=False)
            if isinstance(row.event, Frame) and row.event.ok
        ]


def _parts(rows: list[Row], frames: list[tuple[int, Row]]) -> Iterator[Part]:
    """The rows of a stretch, good frames of the second protocol in place of what they cover."""
    waiting = deque(frames)
    begin = taken = 0  # of the row; octets up to there are in a frame that was given
    for place, row in enumerate(rows):
        end = begin + len(row.event.octets)
        while waiting and waiting[0][0] < end:
            at, foreign = waiting.popleft()
            yield from _rest(row, place, max(begin, taken) - begin, at - begin)
            yield replace(foreign, no=row.no), FOREIGN
            taken = at + len(foreign.event.octets)
        yield from _rest(row, place, max(begin, taken) - begin, end - begin)
        begin = end


def _rest(row: Row, place: int, low: int, high: int) -> Iterator[Part]:
    """Octets `low` … `high` of a row: the row, or a part of it as noise."""
    event = row.event
    if low < high and (low, high) == (0, len(event.octets)):
        yield row, place
    elif low < high:
        where, reason = (event.place, event.reason) if isinstance(event, Noise) else (Place.BETWEEN, Reason.NO_FRAME)
        yield Row(row.no, Noise(event.octets[low:high], event.start, event.end, where, reason)), REST


# -- how many ----------------------------------------------------------------------------------------------------


class ForeignFrames:
    """An observer that counts the good frames of a second protocol, if what the first leaves proves one."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._proof = SecondProof(session)
        self._proving: Proving[Output | Table] = Proving(self._proof)
        self._stretch: Stretch | None = None
        self._counted = 0

    @property
    def since(self) -> int:
        """Number of the first row that may be one of them."""
        return self._proof.since

    def add(self, output: Output) -> None:
        """Take what an engine gave."""
        self._take(self._proving.add(output))

    def add_table(self, table: Table) -> None:
        """Take the same as columns."""
        self._take(self._proving.add(table))

    def add_line_event(self, event: LineEvent) -> None:
        """It is no frame."""

    def told(self) -> tuple[Dissector, int] | None:
        """The protocol and how many frames of it, so far; None where the bus has one protocol."""
        self._take(self._proving.close())
        if self._stretch is not None:
            self._count(self._stretch.end())
        name = self._proof.name
        return (registry.get(name), self._counted) if registry.is_of_lines(name) else None

    def _take(self, items: Iterable[Output | Table]) -> None:
        if not registry.is_of_lines(self._proof.name):
            return
        stretch = self._stretch = self._stretch or Stretch(self._session, self._proof.name)
        for row in (row for item in items for row in _left_rows(item)):
            if row.no < self._proof.since:
                continue
            if stretch.rows and stretch.rows[-1].no != row.no - 1:
                self._count(stretch.end())
            self._count(stretch.add(row))

    def _count(self, parts: list[Part]) -> None:
        self._counted += sum(kind == FOREIGN for _, kind in parts)


def _left_rows(item: Output | Table) -> Iterable[Row]:
    return filter(is_left, item.rows) if isinstance(item, Output) else rows_at(item, left_places(item).tolist())


def proven(capture: ReadSource, session: Session, reference: bool = False) -> SecondProof:
    """Whether a whole capture has a second protocol; for those who must know before any row is shown."""
    proof = SecondProof(session)
    given = outputs(capture.items(), session) if reference else tables_of(capture, session)
    try:
        for item in given:
            proof.see(item)
            if proof.name:
                return proof
    except CaptureError:
        pass  # whoever reads on is told
    proof.close()
    return proof


# -- which they are ----------------------------------------------------------------------------------------------


def of_both(
    items: Iterable[JudgedRow],
    session: Session,
    second: str,
    wanted: Wanted,
    of_second: Wanted | None,
    since: int = 0,
) -> Iterator[Judged]:
    """All rows with the dissector of each, as far as they are wanted; `of_second` None: none of the second protocol.
    `since`: the first row that may be one of its frames; none before is given."""
    first, other = dissector_for(session), registry.get(second)
    for item, dissector in _rows(items, session, first, other, since):
        accepts = wanted if dissector is first else of_second
        if accepts is not None and accepts(item.row, item.transaction) and item.row.no >= since:
            yield item, dissector


def _rows(
    items: Iterable[JudgedRow], session: Session, first: Dissector, second: Dissector, since: int
) -> Iterator[Judged]:
    stretch, held = Stretch(session, second.name), list[JudgedRow]()

    def judged(parts: list[Part]) -> Iterator[Judged]:
        for row, kind in parts:
            yield held[kind] if kind >= 0 else JudgedRow(row, None), second if kind == FOREIGN else first
        del held[: len(held) - len(stretch.rows)]

    for item in items:
        if is_left(item.row) and item.row.no >= since:
            held.append(item)
            yield from judged(stretch.add(item.row))
        else:
            yield from judged(stretch.end())
            yield item, first
    yield from judged(stretch.end())


def with_foreign(
    items: Iterable[Table | LineEvent], session: Session, proof: SecondProof
) -> Iterator[tuple[Table, Mapping[int, list[Row]]]]:
    """Tables, each with what stands in place of some of its rows: place in the table → rows of that number. `items` as
    `proving` gives them; raises what they raise, when all before it was given."""
    placing = _Placing(session)
    try:
        for item in items:
            if not isinstance(item, LineEvent):
                yield from placing.add(item, proof)
    except CaptureError:
        yield from placing.close()
        raise
    yield from placing.close()


class _Placing:
    """Tables that wait for the end of a stretch that is in several of them."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._stretch: Stretch | None = None
        self._last = 0  # number of the row that the stretch took last
        self._waiting: deque[tuple[Table, dict[int, list[Row]]]] = deque()

    def add(self, table: Table, proof: SecondProof) -> Iterator[tuple[Table, Mapping[int, list[Row]]]]:
        """Take the table that follows; give those that are known."""
        if not registry.is_of_lines(proof.name):
            yield table, {}
            return
        stretch = self._stretch = self._stretch or Stretch(self._session, proof.name)
        self._waiting.append((table, {}))
        for row in _left_rows(table):
            if row.no < proof.since:
                continue
            if stretch.rows and self._last != row.no - 1:
                self._put(stretch.end())
            self._last = row.no
            self._put(stretch.add(row))
        if self._last != table.first + len(table) - 1:
            self._put(stretch.end())
        while self._waiting and not (stretch.rows and stretch.rows[0].no < _end(self._waiting[0][0])):
            yield self._waiting.popleft()

    def close(self) -> Iterator[tuple[Table, Mapping[int, list[Row]]]]:
        """Give all that is left."""
        if self._stretch is not None:
            self._put(self._stretch.end())
        yield from self._waiting
        self._waiting.clear()

    def _put(self, parts: list[Part]) -> None:
        """Note what stands in place of the rows that a stretch gave."""
        if not parts or all(kind >= 0 for _, kind in parts):
            return
        rows = self._stretch.rows if self._stretch is not None else []
        placed: dict[int, list[Row]] = {no: [] for no in range(parts[0][0].no, rows[0].no if rows else self._last + 1)}
        for row, _ in parts:
            placed[row.no].append(row)
        changed = {row.no for row, kind in parts if kind < 0} | {no for no, given in placed.items() if not given}
        for table, replaced in self._waiting:
            replaced |= {no - table.first: placed[no] for no in changed if table.first <= no < _end(table)}


def _end(table: Table) -> int:
    """The number of the row behind a table."""
    return table.first + len(table)
