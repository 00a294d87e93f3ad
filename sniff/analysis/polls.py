"""The master's programme: every distinct request of a bus, how often it is asked and what becomes of it. Pure.

`Polls` is an observer. Row by row and by tables it comes to the same, and two parts of a capture merge to what the
whole would give: a request whose transaction closes in the part that follows is kept for it, and the other way round.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

from dissectors.frame import Frame, Role
from dissectors.manifest import Dissector
from dissectors.questions import Question
from dissectors.tracker import PASSING, Transaction, Verdict
from sniff.analysis.holes import Holes
from sniff.analysis.poll import UNASKED, Poll, PollKey
from sniff.engine.engine import Output, Row
from sniff.engine.session import LineEvent

if TYPE_CHECKING:
    from sniff.engine.table import Table

MOST_POLLS = 8192
MOST_OPEN = 4096
"""Requests remembered while their transaction is open, and transactions that closed without their request."""

MOST_MISSED = 512
"""Requests without answer that are remembered for answers that come late."""


class Closed(NamedTuple):
    """What counts of a transaction. Times are ns."""

    id: int
    station: int | None
    kind: str
    request: int
    verdict: Verdict
    start: int
    latency: int | None
    attempt: int
    of: int | None


class Asked(NamedTuple):
    """Who asked what."""

    source: int | None
    question: Question


class Polls:
    """Takes what the engine gives. `dropped`: requests of entries beyond the limit; `version` changes with each;
    `holes`: when nobody heard what was asked."""

    def __init__(self, dissector: Dissector) -> None:
        self.dissector = dissector
        self.dropped = 0
        self.version = 0
        self.holes = Holes()
        self.polls: dict[PollKey, Poll] = {}
        self.open: OrderedDict[int, Asked] = OrderedDict()  # by number of the row
        self._orphans: OrderedDict[int, Closed] = OrderedDict()  # by id; what closed and began before this part
        self._missed: OrderedDict[int, PollKey] = OrderedDict()  # by id; what got no answer

    def __iter__(self) -> Iterator[Poll]:
        """All entries, in the order in which they were first asked."""
        return iter(sorted(self.polls.values(), key=lambda poll: poll.first or 0))

    def __len__(self) -> int:
        return len(self.polls)

    def add(self, output: Output) -> None:
        """Take rows and the transactions that closed with them."""
        for row in output.rows:
            if row.searched is None:
                self.holes.see(row.event.start, row.event.end)
            if asks(row):
                assert isinstance(row.event, Frame)
                assert row.placement is not None
                self.remember(row.no, row.event, row.placement.source)
        for transaction in output.transactions:
            if counts(transaction.kind, transaction.verdict, transaction.request):
                self.take(closed_of(transaction))
            elif transaction.request is not None:
                self.open.pop(transaction.request, None)

    def add_table(self, table: Table) -> None:
        """Take many at once; the same as one after the other."""
        from sniff.analysis.poll_columns import add_table

        add_table(self, table)

    def add_line_event(self, event: LineEvent) -> None:
        """Take what happened to the line: over a hole nothing is known."""
        if event.kind.is_hole:
            self.holes.miss(event)

    def remember(self, no: int, frame: Frame, source: int | None) -> None:
        """Take a frame that may ask something and whose transaction is open."""
        self.open[no] = Asked(source, self.question(frame))
        if len(self.open) > MOST_OPEN:
            self.open.popitem(last=False)

    def question(self, frame: Frame) -> Question:
        """What a frame asks."""
        questions = self.dissector.questions
        return questions.of(frame) if questions is not None else Question()

    def take(self, closed: Closed) -> None:
        """Take a transaction that counts."""
        self.version += 1
        if closed.verdict is Verdict.LATE:
            key = self._missed.get(closed.of) if closed.of is not None else None
            if key is None:
                self._keep(closed)
            else:
                self.polls[key].late += 1
            return
        asked = self.open.pop(closed.request, None)
        if asked is None:
            self._keep(closed)
            return
        key = PollKey(asked.source, closed.station, closed.kind, asked.question)
        poll = self.of(key)
        if poll is None:
            self.dropped += 1
            return
        poll.add(closed.start, closed.attempt, closed.verdict, closed.latency, closed.request, self.holes)
        if closed.verdict is Verdict.NO_RESPONSE:
            self.miss(closed.id, key)

    def of(self, key: PollKey) -> Poll | None:
        """The entry of that key, a new one where there is none; None where there are too many."""
        poll = self.polls.get(key)
        if poll is None and len(self.polls) < MOST_POLLS:
            poll = self.polls[key] = Poll(key)
        return poll

    def miss(self, tx: int, key: PollKey) -> None:
        """Remember what got no answer."""
        self._missed[tx] = key
        if len(self._missed) > MOST_MISSED:
            self._missed.popitem(last=False)

    def _keep(self, closed: Closed) -> None:
        self._orphans[closed.id] = closed
        if len(self._orphans) > MOST_OPEN:
            self._orphans.popitem(last=False)

    def merge(self, later: Polls) -> Polls:
        """With the programme of a later stretch of the same bus, as a new value."""
        whole = Polls(self.dissector)
        whole.dropped = self.dropped + later.dropped
        whole.holes = self.holes.merge(later.holes)
        whole.polls = {key: poll.merge(Poll(key)) for key, poll in self.polls.items()}
        whole.open, whole._missed = self.open.copy(), self._missed.copy()
        whole._orphans = self._orphans.copy()
        late = [closed for closed in later._orphans.values() if closed.verdict is Verdict.LATE]
        for closed in later._orphans.values():
            if closed.verdict is not Verdict.LATE:
                whole.take(closed)
        for key, poll in later.polls.items():
            mine = whole.of(key)
            if mine is None:
                whole.dropped += poll.asked + poll.repeats
            else:
                whole.polls[key] = mine.merge(poll, whole.holes)
        for tx, key in later._missed.items():
            whole.miss(tx, key)
        for closed in late:
            whole.take(closed)
        for no, asked in later.open.items():
            whole.open[no] = asked
        while len(whole.open) > MOST_OPEN:
            whole.open.popitem(last=False)
        whole.version = self.version + later.version
        return whole


def asks(row: Row) -> bool:
    """Whether a row may be a request: a good frame with a place that answers nothing and passes no token."""
    placed, header = row.placement, row.header
    if placed is None or header is None or placed.role is Role.RESPONSE or header.kind in PASSING:
        return False
    return isinstance(row.event, Frame) and row.event.ok and row.searched is None


def counts(kind: str, verdict: Verdict, request: int | None) -> bool:
    """Whether a transaction says something of the programme."""
    if verdict is Verdict.LATE:
        return True
    return request is not None and kind not in PASSING and verdict not in UNASKED


def closed_of(one: Transaction) -> Closed:
    """What counts of it."""
    latency = None if one.latency is None else one.latency.nominal
    station = None if one.verdict is Verdict.BROADCAST else one.station
    return Closed(one.id, station, one.kind, one.request or 0, one.verdict, one.start, latency, one.attempt, one.of)
