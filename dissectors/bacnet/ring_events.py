"""What happens on a token ring: the kinds of it, one event, and all events of one kind about one station."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import Enum

from dissectors.busiest import summed

EVENTS_MAX = 32

HASTY = 1
"""`RingEvent.value` of a token that was passed on sooner than times as they are read allow."""


class RingEventKind(Enum):
    """Kinds of events on a ring."""

    LOST_TOKEN = "lost token"  # silence of 500 ms and more, then somebody began anew
    ALL_SILENT = "all silent"  # the same silence, then the ring went on where it was
    RETRY = "token repeated"
    TWO_TOKENS = "sent without having the token"
    REJOINED = "answered a poll though already in the ring"
    LEFT = "gave no sign when given the token"
    OTHER_DEVICE = "another device instance under the same address"
    SECOND_DEVICE = "two device instances in turns under the same address"
    OTHER_ECHO = "a test of the own address answered with other octets"
    DAMAGED_REPLY = "damaged octets in place of an answer"
    TOO_SOON = "sent again before its own poll could be answered"
    FOR_ANOTHER = "answered what another station was asked"
    ASTRAY = "answered to another address than the one that asked"
    UNASKED = "sent without being asked, and never has the token"
    LATE_USE = "late to use the token"
    LATE_ASKING = "late to use the token, and asked with it"
    GIVEN_UP = "used the token after it was given up"
    USED_BOTH = "used the token and its repeat"
    SLOW_SEARCH = "late to go on after a poll that nobody answered"
    STOPPED = "searched for a successor for over a second"
    POLLED_ON = "polled one address after another for over a second, though it had lost nobody"
    STORM = "one of many broadcasts in a short time"
    LATE_REPLY = "late to answer"
    NO_REPLY = "no answer"
    NOT_TAKEN = "did not take the answer to its poll"
    LATE_POLL_REPLY = "late to answer a poll"
    ILLEGAL = "an address or length that the standard forbids"
    BROADCAST_REQUEST = "a broadcast that asks for a reply"
    UNHEARD = "sent what was not heard here"
    OVERDUE = "damage while an answer is overdue"  # of whose it is, with who asked; of nobody, with who sent the frame
    OVERTAKEN = "went on before its answer came"
    SELF_TOKEN = "passed the token to itself"


@dataclass(frozen=True, slots=True)
class RingEvent:
    """What happened at `time`, in frame `no`, about `mac`; `other` is a second party, `value` ns or a number."""

    what: RingEventKind
    time: int
    no: int
    mac: int | None
    other: int | None = None
    value: int | None = None

    @property
    def is_wait(self) -> bool:
        """Whether it is of an answer, and known how long the station that asked waited for it."""
        return self.value is not None and self.value > HASTY


@dataclass(frozen=True, slots=True)
class Happened:
    """All events of one kind about one station: how many, when, and the first EVENTS_MAX of them.

    Of all, not of those that are kept: `least`, `most` of their values (no value is 0), and who the second party was
    how often; `quarters`: how many came in each quarter of an hour (`dissectors.busiest`).
    """

    count: int = 0
    first: int = 0
    last: int = 0
    events: tuple[RingEvent, ...] = ()
    least: int = 0
    most: int = 0
    others: Mapping[int | None, int] = field(default_factory=dict)
    quarters: Mapping[int, int] = field(default_factory=dict)

    def add(self, event: RingEvent) -> Happened:
        """One more."""
        value = event.value or 0
        return self.merge(Happened(1, event.time, event.time, (event,), value, value, {event.other: 1}))

    def merge(self, later: Happened) -> Happened:
        """Both together."""
        if not self.count or not later.count:
            return self if self.count else later
        events = self.events if len(self.events) >= EVENTS_MAX else (self.events + later.events)[:EVENTS_MAX]
        others = dict(self.others)
        for other, count in later.others.items():
            others[other] = others.get(other, 0) + count
        return Happened(
            self.count + later.count,
            min(self.first, later.first),
            max(self.last, later.last),
            events,
            min(self.least, later.least),
            max(self.most, later.most),
            others,
            summed((self.quarters, later.quarters)),
        )

    def without(self, no: int, other: int | None) -> Happened:
        """All but the one of frame `no`, with that second party."""
        events = tuple(event for event in self.events if event.no != no)
        left = {one: count - (one == other) for one, count in self.others.items()}
        others = {one: count for one, count in left.items() if count > 0}
        return replace(self, count=max(0, self.count - 1), events=events, others=others)

    @property
    def parties(self) -> tuple[int, ...]:
        """Who the second parties were."""
        return tuple(sorted(other for other in self.others if other is not None))
