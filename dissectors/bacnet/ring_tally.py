"""A ring while it is being counted: what `MstpRingObserver` adds to, and what becomes a `Ring` value at any time."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import MappingProxyType

from dissectors import busiest
from dissectors.bacnet.ring import SUMS, Edge, Ring, RingNode
from dissectors.bacnet.ring_events import Happened, RingEvent, RingEventKind
from dissectors.bacnet.ring_window import Happening, RingJournal
from dissectors.histogram import Histogram
from dissectors.line import Timing
from dissectors.wrong_checks import WrongChecks


@dataclass(slots=True)
class NodeTally:
    """One address; counts and distributions as in `RingNode`."""

    tokens_received: int = 0
    tokens_sent: int = 0
    polls_sent: int = 0
    polls_of_search: int = 0
    polls_unanswered: int = 0
    polls_waited: int = 0
    polls_received: int = 0
    poll_replies_sent: int = 0
    requests_sent: int = 0
    requests_received: int = 0
    data_sent: int = 0
    broadcasts_sent: int = 0
    postponed: int = 0
    replies: int = 0
    damaged: int = 0
    damaged_octets: int = 0
    cut_last: int = 0
    when_damaged: busiest.Quarters = field(default_factory=dict)
    octets: int = 0
    held: int = 0
    highest_polled: int = -1
    first: int = 0
    last: int = 0
    last_token: int = 0
    last_polled: int = 0
    got: int | None = None  # when it last got the token
    use: Histogram = field(default_factory=Histogram)
    loop: Histogram = field(default_factory=Histogram)
    reply: Histogram = field(default_factory=Histogram)
    service: Histogram = field(default_factory=Histogram)
    poll_reply: Histogram = field(default_factory=Histogram)
    poll_wait: Histogram = field(default_factory=Histogram)
    holds: dict[int, int] = field(default_factory=dict)
    devices: list[int] = field(default_factory=list)
    data_checks: WrongChecks = field(default_factory=WrongChecks)
    header_checks: WrongChecks = field(default_factory=WrongChecks)
    gone: bool = False  # it was passed over
    searches: bool = False  # its successor is lost, and it has passed the token to nobody since
    searching_since: int | None = None  # since when, after a loss
    after_search: int = 0  # tokens to come in which a poll still belongs to the search
    next: int | None = None  # to whom it passed the token last
    device: int | None = None  # the instance that it gave last

    def value(self) -> RingNode:
        """What was counted so far."""
        return RingNode(
            **{name: getattr(self, name) for name in SUMS},
            highest_polled=self.highest_polled,
            first=self.first,
            last=self.last,
            last_token=self.last_token,
            last_polled=self.last_polled,
            use=self.use.copy(),
            loop=self.loop.copy(),
            reply=self.reply.copy(),
            service=self.service.copy(),
            poll_reply=self.poll_reply.copy(),
            poll_wait=self.poll_wait.copy(),
            holds=MappingProxyType(dict(self.holds)),
            devices=tuple(self.devices),
            when_damaged=MappingProxyType(dict(self.when_damaged)),
            data_checks=self.data_checks.copy(),
            header_checks=self.header_checks.copy(),
        )


@dataclass(slots=True)
class EdgeTally:
    """Tokens from one station to another."""

    tokens: int = 0
    retries: int = 0
    last: int = 0
    since: int = 0
    streak: int = 0


@dataclass(slots=True)
class RingTally:
    """Counts as in `Ring`."""

    timing: Timing
    first: int | None = None
    last: int = 0
    frames: int = 0
    octets: int = 0
    noise: int = 0
    header_errors: int = 0
    data_errors: int = 0
    cut: int = 0
    when_damaged: busiest.Quarters = field(default_factory=dict)
    poll_waste: int = 0
    impossible: int = 0
    hole: int = 0
    unheard: int = 0
    nodes: dict[int, NodeTally] = field(default_factory=dict)
    edges: dict[tuple[int, int], EdgeTally] = field(default_factory=dict)
    happened: dict[tuple[RingEventKind, int | None], Happened] = field(default_factory=dict)
    quarters: dict[tuple[RingEventKind, int | None], busiest.Quarters] = field(default_factory=dict)  # of those
    polled: dict[tuple[int, int], int] = field(default_factory=dict)
    journal: RingJournal | None = None  # where somebody asks what is new

    def node(self, mac: int) -> NodeTally:
        """The node of an address, a new one when it was not known."""
        found = self.nodes.get(mac)
        if found is None:
            found = self.nodes[mac] = NodeTally()
        return found

    def edge(self, source: int, destination: int) -> EdgeTally:
        """The tokens between two addresses."""
        found = self.edges.get((source, destination))
        if found is None:
            found = self.edges[source, destination] = EdgeTally()
        return found

    def note(
        self,
        what: RingEventKind,
        time: int,
        no: int,
        mac: int | None,
        other: int | None = None,
        value: int | None = None,
    ) -> None:
        """Something happened: arguments as in `RingEvent`."""
        key = (what, mac)
        self.happened[key] = self.happened.get(key, Happened()).add(RingEvent(what, time, no, mac, other, value))
        busiest.count(self.quarters.setdefault(key, {}), time)
        if what is RingEventKind.LOST_TOKEN:
            self.enter(Happening.LOST, no, 0)

    def enter(self, what: Happening, no: int, mac: int, value: int = 0) -> None:
        """It happened in a row: into the journal, where there is one."""
        if self.journal is not None:
            self.journal.note(what, no, mac, value)

    def take_back(self, what: RingEventKind, no: int, mac: int | None, other: int | None) -> None:
        """What was noted of frame `no` turned out to be nothing."""
        happened = self.happened.get((what, mac))
        if happened is not None:
            self.happened[what, mac] = happened.without(no, other)
            busiest.take_back(self.quarters[what, mac])

    def value(self) -> Ring:
        """All that was counted so far."""
        return Ring(
            self.timing,
            self.first,
            None if self.first is None else self.last,
            self.frames,
            self.octets,
            self.noise,
            self.header_errors,
            self.data_errors,
            self.cut,
            self.poll_waste,
            self.impossible,
            self.hole,
            self.unheard,
            MappingProxyType({mac: node.value() for mac, node in sorted(self.nodes.items())}),
            MappingProxyType(
                {
                    pair: Edge(one.tokens, one.retries, one.last, one.since, one.streak)
                    for pair, one in self.edges.items()
                }
            ),
            MappingProxyType(
                {
                    key: replace(happened, quarters=MappingProxyType(dict(self.quarters[key])))
                    for key, happened in self.happened.items()
                    if happened.count
                }
            ),
            MappingProxyType(dict(self.polled)),
            MappingProxyType(dict(self.when_damaged)),
        )
