"""The tracker contract: giving each frame its place in a transaction, and each transaction a verdict.

A tracker has memory of the whole bus, so one lost frame never inverts what follows. Direction is decided here,
once. It is fed every event of the bus in order, numbered by the caller (ascending, not necessarily dense), and is
total: any events, any times.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, StrEnum
from typing import Protocol

from dissectors.frame import Assembly, Event, Header, Role
from dissectors.line import Timing
from dissectors.quick_values import quickly_made


class Verdict(Enum):
    """How a transaction ended. Exclusive; the last word on it."""

    OPEN = "open"  # the capture ended, or an answer may still come
    ANSWERED = "answered"
    RETRY = "retry"  # answered, but only when the request was repeated
    EXCEPTION = "exception"  # answered with an exception, error or reject
    NO_RESPONSE = "no-response"
    LATE = "late"  # answered after the master had given up
    ECHO = "echo"  # an exact copy at once: adapter or repeater
    UNSOLICITED = "unsolicited"  # an answer that no request asked for
    ANSWERED_TWICE = "answered-twice"  # a second answer: duplicate address
    DAMAGED_ANSWER = "damaged-answer"  # something came in answer, but damaged
    DAMAGED_REQUEST = "damaged-request"  # the request itself was damaged: nobody need answer
    BROADCAST = "broadcast"  # no answer expected
    DATA = "data"  # passed without expecting an answer (tokens, unconfirmed data)
    UNDECIDED = "answered-or-repeated"  # a frame that is its answer or the request again: the bus does not tell

    @property
    def words(self) -> str:
        """What a person reads; the value is for programs and stays."""
        return _WORDS.get(self, self.value.replace("-", " "))


_WORDS = {Verdict.NO_RESPONSE: "no answer", Verdict.DATA: "one-way", Verdict.UNSOLICITED: "unasked"}


class Passing(StrEnum):
    """Kinds of transactions that pass on the right to send, or look for a station to pass it to: they ask for nothing.

    Protocols that pass a token use these for `Header.kind` and `Transaction.kind`, whatever their own standard says.
    """

    TOKEN = "token"
    POLL = "poll-for-master"
    STATUS = "fdl-status"


PASSING = frozenset(kind.value for kind in Passing)


@quickly_made
@dataclass(frozen=True, slots=True)
class Interval:
    """A duration that the adapter allows to be known only within bounds: low ≤ truth ≤ high, ns."""

    nominal: int
    low: int
    high: int


@quickly_made
@dataclass(frozen=True, slots=True)
class Placement:
    """Where a frame belongs: `no` is the caller's number of it, `tx` the transaction's."""

    no: int
    tx: int
    role: Role
    source: int | None = None
    destination: int | None = None


@quickly_made
@dataclass(frozen=True, slots=True)
class Transaction:
    """One exchange, closed: it does not change any more.

    `request`, `response`: numbers of the frames (None where not seen); of a message in several frames, of the last one,
    which holds the whole (`Frame.assembly`). `start`, `end`: ns, of the first and last
    octet that belong to it. `latency`: end of request to start of response. `attempt`: 1 for a first try, 2 and more
    for repeats. `of`: the transaction that this repeats, echoes or answers late.
    """

    id: int
    station: int | None
    kind: str
    request: int | None
    response: int | None
    verdict: Verdict
    start: int
    end: int
    latency: Interval | None = None
    attempt: int = 1
    of: int | None = None
    error: str | None = None

    @property
    def is_passing(self) -> bool:
        """Whether it is no request and no data, only the right to send on its way."""
        return self.kind in PASSING


@quickly_made
@dataclass(frozen=True, slots=True)
class Tracked:
    """What one event did: its own placement (None for noise), and the transactions that it closed, in order.

    `assembly`: the message in several frames that this one ends; whoever feeds the tracker keeps it with the frame.
    """

    placement: Placement | None = None
    closed: tuple[Transaction, ...] = ()
    assembly: Assembly | None = None


NOTHING_TRACKED = Tracked()


class Unpaired:
    """A tracker that pairs nothing: for those who only ask what was on the wire."""

    def track(self, no: int, event: Event, header: Header | None) -> Tracked:
        """No placement."""
        return NOTHING_TRACKED

    def advance(self, now: int) -> tuple[Transaction, ...]:
        """Nothing to close."""
        return ()

    def close(self) -> tuple[Transaction, ...]:
        """Nothing to close."""
        return ()


class Announcements:
    """A tracker for protocols whose frames are told to everybody and answered by nobody."""

    def __init__(self, timing: Timing) -> None:
        self._tx = 0

    def track(self, no: int, event: Event, header: Header | None) -> Tracked:
        """Each frame is a transaction of its own, and closed at once."""
        if header is None:
            return NOTHING_TRACKED
        self._tx += 1
        closed = Transaction(self._tx, header.source, header.kind, no, None, Verdict.DATA, event.start, event.end)
        return Tracked(Placement(no, self._tx, Role.DATA, header.source), (closed,))

    def advance(self, now: int) -> tuple[Transaction, ...]:
        """Nothing waits."""
        return ()

    def close(self) -> tuple[Transaction, ...]:
        """Nothing is open."""
        return ()


class Tracker(Protocol):
    """Pairs the frames of one bus. Transaction ids ascend from 1 in the order of opening."""

    def track(self, no: int, event: Event, header: Header | None) -> Tracked:
        """Take the next event; `header` is None exactly for noise."""
        ...

    def advance(self, now: int) -> tuple[Transaction, ...]:
        """Say that nothing came up to `now` (ns); give the transactions that this closes."""
        ...

    def close(self) -> tuple[Transaction, ...]:
        """End of capture: close what is open (verdict OPEN where it could still have been answered)."""
        ...
