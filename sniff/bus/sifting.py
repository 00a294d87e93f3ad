"""A capture as far as a filter accepts it: for observers, and as a capture of its own.

An exchange counts where one of its frames is accepted. Nothing is judged by what a filter leaves: who looks for what
is wrong reads the whole, and shows the findings whose evidence is accepted.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, TypeVar

from dissectors.findings import Finding
from dissectors.frame import Chunk
from sniff.bus.offline import settled_columns
from sniff.engine.engine import Output, Row
from sniff.engine.observer import Observer
from sniff.engine.read_source import ReadSource, stored_tables
from sniff.engine.session import Item, LineEvent, Session
from sniff.filter import Filter
from sniff.filter.choosing import chosen

if TYPE_CHECKING:
    from sniff.engine.blocks import Block
    from sniff.engine.column_join import SettledRows
    from sniff.engine.table import Table

Given = TypeVar("Given")


class _Events:
    """A capture whose line events are kept aside as they pass."""

    def __init__(self, capture: ReadSource) -> None:
        self._capture = capture
        self.passed: list[LineEvent] = []

    def items(self) -> Iterator[Item]:
        """As the capture."""
        return self._noting(self._capture.items())

    def blocks(self) -> Iterator[Block | LineEvent]:
        """As the capture."""
        return self._noting(self._capture.blocks())

    def stored_tables(self, session: Session) -> Iterator[Table | LineEvent] | None:
        """As the capture."""
        held = stored_tables(self._capture, session)
        return None if held is None else self._noting(held)

    def _noting(self, items: Iterator[Given]) -> Iterator[Given]:
        for item in items:
            if isinstance(item, LineEvent):
                self.passed.append(item)
            yield item

    def take(self) -> list[LineEvent]:
        """Those that passed since."""
        passed, self.passed = self.passed, []
        return passed


def sift(capture: ReadSource, session: Session, wanted: Filter, *observers: Observer, every_row: bool = False) -> None:
    """Hand on what a filter accepts of a capture: rows, exchanges with an accepted row, all line events. `every_row`:
    all rows, for those who need both ends of an exchange, and only the exchanges that are accepted. Raises CaptureError
    as the capture does."""
    events, accepted = _Events(capture), _Exchanges()
    for some in settled_columns(events, session):
        for event in events.take():
            for observer in observers:
                observer.add_line_event(event)
        places: list[int] = chosen(some, wanted).tolist()
        closed = accepted.closed(some, places)
        for row in _rows(some, range(some.begin, some.end) if every_row else places):
            output = Output((row,), ())
            for observer in observers:
                observer.add(output)
        if closed:
            for observer in observers:
                observer.add(Output((), tuple(closed)))
    for event in events.take():
        for observer in observers:
            observer.add_line_event(event)


class _Exchanges:
    """Which exchanges have an accepted row; each is given once, when its last row came."""

    def __init__(self) -> None:
        self._waiting: dict[int, bool] = {}  # ids of those of which a row was seen and the last is to come

    def closed(self, some: SettledRows, places: list[int]) -> list:  # type: ignore[type-arg]
        """Those that end within these rows and are accepted."""
        inside = set(places)
        found = []
        for place in range(some.begin, some.end):
            at = int(some.which[place - some.begin])
            if at < 0:
                continue
            id, no = int(some.closed.id[at]), some.table.first + place
            seen = self._waiting.get(id, False) or place in inside
            last = max(int(some.closed.request[at]), int(some.closed.response[at]))
            if no < last:
                self._waiting[id] = seen
                continue
            self._waiting.pop(id, None)
            if seen and no == last:
                found.append(some.closed.transaction(at))
        return found


def _rows(some: SettledRows, places: Iterable[int]) -> Iterator[Row]:
    from sniff.engine.table import AT_ONCE, rows_at

    listed = list(places)
    for begin in range(0, len(listed), AT_ONCE):
        yield from rows_at(some.table, listed[begin : begin + AT_ONCE])


def accepted(capture: ReadSource, session: Session, wanted: Filter, among: Iterable[int]) -> set[int]:
    """Those of some row numbers that a filter accepts."""
    asked, found = set(among), set[int]()
    for some in settled_columns(capture, session) if asked else ():
        first = some.table.first
        found.update(no for place in chosen(some, wanted) if (no := place + first) in asked)
    return found


def shown_findings(
    capture: ReadSource, session: Session, wanted: Filter, findings: tuple[Finding, ...]
) -> tuple[Finding, ...]:
    """Findings with a row among their evidence that a filter accepts."""
    if wanted.root is None:
        return findings
    rows = accepted(capture, session, wanted, (no for finding in findings for no in finding.evidence))
    return tuple(finding for finding in findings if rows.intersection(finding.evidence))


class Sifted:
    """The octets of accepted rows as a capture: a read each, that ends when the row ended; line events as they are.

    What an adapter held back is not known of such a read any more: the times are those that were worked out.
    """

    def __init__(self, capture: ReadSource, session: Session, wanted: Filter) -> None:
        self._capture, self._session, self._wanted = capture, session, wanted

    def items(self) -> Iterator[Item]:
        """Rows in the order of the wire, events between them."""
        events, waiting = _Events(self._capture), list[LineEvent]()
        for some in settled_columns(events, self._session):
            waiting += events.take()
            for row in _rows(some, chosen(some, self._wanted)):
                event = row.event
                while waiting and waiting[0].time <= event.start:
                    yield waiting.pop(0)
                yield Chunk(event.end, event.octets, event.marks)
        yield from waiting
        yield from events.take()

    def blocks(self) -> Iterator[Block | LineEvent]:
        """The same as columns."""
        from sniff.engine.blocks import blocks_of

        return blocks_of(self.items())
