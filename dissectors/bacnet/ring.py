"""The token ring as a value: who passes to whom, how long each takes, what goes wrong. Two of them add up.

`MstpRingObserver` (ring_observer.py) makes it from the frames. Times in ns. Memory is bounded: distributions, counts
and the first EVENTS_MAX events of each kind. What the adapter's timing cannot tell is not judged: see
`Ring.measurable`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

from dissectors import busiest
from dissectors.bacnet.limits import MAX_MASTER, T_REPLY_DELAY, T_USAGE_DELAY, TURNAROUND_BITS
from dissectors.bacnet.ring_events import EVENTS_MAX, Happened, RingEventKind
from dissectors.histogram import Histogram
from dissectors.line import Timing
from dissectors.wrong_checks import WrongChecks

IMPOSSIBLE_SHARE = 0.01
COARSE_LIMIT = 100_000_000
"""Limits from here on can be judged with coarse times too (systems that stamp every 16 ms)."""


def lies_between(mac: int, first: int, last: int) -> bool:
    """Whether an address comes after `first` and before `last` in the order of the ring."""
    return 0 < (mac - first) % (MAX_MASTER + 1) < ((last - first) % (MAX_MASTER + 1) or MAX_MASTER + 1)


@dataclass(frozen=True, slots=True)
class RingNode:
    """One address. Counts of frames that it sent (`…_sent`) or was sent.

    `use`: end of a token to it … its first frame. `loop`: from token to token. `reply`: request to its answer.
    `service`: request to the answer after it had postponed. `poll_reply`: poll to its answer. `poll_wait`: from a poll
    of its own that nobody answered to its next frame. `holds`: data frames a token → how often. `held`: ns for which it
    had the token. `highest_polled`: highest address that it ever polled. `polls_of_search`: polls of searches for a
    successor, its first one or one that was lost, and shortly after: they are as they should be. `polls_waited`:
    unanswered polls after which it waited as long as it must. `damaged`: damaged frames that it sent, by their header
    or by whose turn it was; `when_damaged`: by quarters of an hour; `damaged_octets` of them; `cut_last`: those where
    the last octet, or two, alone is missing or wrong; `data_checks`, `header_checks`: how their checks are wrong.
    `last_token`, `last_polled`: ns, when it was sent a token or a poll last.
    """

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
    octets: int = 0
    held: int = 0
    highest_polled: int = -1
    first: int = 0
    last: int = 0
    last_token: int = 0
    last_polled: int = 0
    use: Histogram = field(default_factory=Histogram)
    loop: Histogram = field(default_factory=Histogram)
    reply: Histogram = field(default_factory=Histogram)
    service: Histogram = field(default_factory=Histogram)
    poll_reply: Histogram = field(default_factory=Histogram)
    poll_wait: Histogram = field(default_factory=Histogram)
    holds: Mapping[int, int] = field(default_factory=lambda: MappingProxyType({}))
    devices: tuple[int, ...] = ()
    when_damaged: Mapping[int, int] = field(default_factory=lambda: MappingProxyType({}))
    data_checks: WrongChecks = field(default_factory=WrongChecks)
    header_checks: WrongChecks = field(default_factory=WrongChecks)

    @property
    def is_master(self) -> bool:
        """Whether it ever passed a token, polled, or answered a poll."""
        return bool(self.tokens_sent or self.polls_sent or self.poll_replies_sent)

    @property
    def most_in_a_hold(self) -> int:
        """Most data frames on one token (its Max_Info_Frames is at least that)."""
        return max(self.holds, default=0)

    def merge(self, other: RingNode) -> RingNode:
        """Both together."""
        holds = dict(self.holds)
        for frames, count in other.holds.items():
            holds[frames] = holds.get(frames, 0) + count
        merged: dict[str, Any] = {name: getattr(self, name) + getattr(other, name) for name in SUMS}
        merged |= {name: getattr(self, name).merge(getattr(other, name)) for name in _DISTRIBUTIONS}
        return RingNode(
            **merged,
            highest_polled=max(self.highest_polled, other.highest_polled),
            first=min((one.first for one in (self, other) if one.first), default=0),  # 0: never heard
            last=max(self.last, other.last),
            last_token=max(self.last_token, other.last_token),
            last_polled=max(self.last_polled, other.last_polled),
            holds=MappingProxyType(holds),
            devices=tuple(dict.fromkeys(self.devices + other.devices))[:EVENTS_MAX],
            when_damaged=MappingProxyType(busiest.summed((self.when_damaged, other.when_damaged))),
            data_checks=self.data_checks.merge(other.data_checks),
            header_checks=self.header_checks.merge(other.header_checks),
        )


SUMS = (
    "tokens_received",
    "tokens_sent",
    "polls_sent",
    "polls_of_search",
    "polls_unanswered",
    "polls_waited",
    "polls_received",
    "poll_replies_sent",
    "requests_sent",
    "requests_received",
    "data_sent",
    "broadcasts_sent",
    "postponed",
    "replies",
    "damaged",
    "damaged_octets",
    "cut_last",
    "octets",
    "held",
)
_DISTRIBUTIONS = ("use", "loop", "reply", "service", "poll_reply", "poll_wait")


@dataclass(frozen=True, slots=True)
class Edge:
    """Tokens from one station to another, and how many of them were repeats.

    `streak`: how many of the newest ones since the sender passed to anybody else; `since`: ns, the first of these.
    """

    tokens: int = 0
    retries: int = 0
    last: int = 0
    since: int = 0
    streak: int = 0

    def merge(self, other: Edge) -> Edge:
        """Both together."""
        newer = other if other.last >= self.last else self
        return Edge(
            self.tokens + other.tokens,
            self.retries + other.retries,
            max(self.last, other.last),
            newer.since,
            newer.streak,
        )


@dataclass(frozen=True, slots=True)
class Ring:
    """What a stretch of MS/TP bus showed.

    `frames`, `octets`, `noise` (octets), `header_errors`, `data_errors`, `cut`: counts; `when_damaged`: those three by
    quarters of an hour.
    `poll_waste`: time spent on polls that nobody answered, waiting included. `impossible`: frames that followed the one
    before sooner than any driver can (Tturnaround). `hole`: ns, when octets may have been missed last; `unheard`: for
    how long nobody listened in all. `polled`: when one station polled another last, ns. `happened`: events by kind and
    station.
    """

    timing: Timing = field(default_factory=Timing)
    first: int | None = None
    last: int | None = None
    frames: int = 0
    octets: int = 0
    noise: int = 0
    header_errors: int = 0
    data_errors: int = 0
    cut: int = 0
    poll_waste: int = 0
    impossible: int = 0
    hole: int = 0
    unheard: int = 0
    nodes: Mapping[int, RingNode] = field(default_factory=lambda: MappingProxyType({}))
    edges: Mapping[tuple[int, int], Edge] = field(default_factory=lambda: MappingProxyType({}))
    happened: Mapping[tuple[RingEventKind, int | None], Happened] = field(default_factory=lambda: MappingProxyType({}))
    polled: Mapping[tuple[int, int], int] = field(default_factory=lambda: MappingProxyType({}))
    when_damaged: Mapping[int, int] = field(default_factory=lambda: MappingProxyType({}))

    @property
    def shows_tokens(self) -> bool:
        """Whether tokens are in the capture at all: some programs save it without them."""
        return bool(self.edges)

    @property
    def span(self) -> int:
        """From the first octet to the last, without what nobody heard, ns."""
        return 0 if self.first is None or self.last is None else max(0, self.last - self.first - self.unheard)

    @property
    def busy(self) -> int:
        """Line time of all octets, ns."""
        return (self.octets + self.noise) * self.timing.char

    @property
    def load(self) -> float:
        """Share of the time that octets were on the line, 0 … 1."""
        return min(1.0, self.busy / self.span) if self.span else 0.0

    @property
    def poll_waste_share(self) -> float:
        """Share of the time that unanswered polls took, 0 … 1."""
        return min(1.0, self.poll_waste / self.span) if self.span else 0.0

    def measurable(self, limit: int) -> bool:
        """Whether the capture's times can judge a limit of that many ns."""
        return 2 * self.timing.latency <= limit and not (self.coarse and limit < COARSE_LIMIT)

    @property
    def coarse(self) -> bool:
        """Whether the times are coarser than the adapter's latency says: too many impossible gaps."""
        return self.impossible > IMPOSSIBLE_SHARE * self.frames

    @property
    def limits(self) -> Mapping[str, bool]:
        """Which of the standard's limits this capture can judge."""
        return {
            "token use": self.measurable(T_USAGE_DELAY),
            "reply": self.measurable(T_REPLY_DELAY),
            "poll reply": self.measurable(T_USAGE_DELAY),
        }

    @property
    def masters(self) -> tuple[int, ...]:
        """Addresses that take part in the ring, ascending."""
        return tuple(sorted(mac for mac, node in self.nodes.items() if node.tokens_sent))

    @property
    def order(self) -> tuple[int, ...]:
        """The ring in the order of the token, from its lowest address on; what the newest tokens show."""
        newest: dict[int, tuple[int, int]] = {}
        for (source, destination), edge in self.edges.items():
            if source not in newest or edge.last > newest[source][0]:
                newest[source] = (edge.last, destination)
        return order_of({source: destination for source, (_, destination) in newest.items()})

    @property
    def predicted_loop(self) -> int | None:
        """How long an idle round takes: a token and the median use time of each station, ns.

        Where the adapter's times cannot tell use times, a station counts with the turnaround, which is the least.
        """
        order = self.order
        if not order:
            return None
        token = 8 * self.timing.char
        least = self.timing.line.bits(TURNAROUND_BITS)
        known = self.measurable(T_USAGE_DELAY)
        uses = [self.nodes[mac].use.quantile(0.5) if known else None for mac in order if mac in self.nodes]
        return sum(token + max(least, use or 0) for use in uses)

    @property
    def needed_max_master(self) -> int | None:
        """The lowest Max_Master that still reaches every master seen."""
        masters = [mac for mac, node in self.nodes.items() if node.is_master]
        return max(masters, default=None)

    def advice(self) -> tuple[str, ...]:
        """What could be set better, in words; empty when nothing is wasted."""
        needed, words = self.needed_max_master, []
        for mac in self.masters:
            node = self.nodes[mac]
            if needed is not None and node.polls_unanswered and needed < node.highest_polled <= MAX_MASTER:
                words.append(f"MAC {mac} polls up to {node.highest_polled}: Max_Master {needed} would do")
        return tuple(words)

    def of(self, what: RingEventKind, mac: int | None = None) -> Happened:
        """Events of a kind about a station."""
        return self.happened.get((what, mac), Happened())

    def merge(self, other: Ring) -> Ring:
        """Both stretches together; either may be empty. The timing is the first one's unless the second is worse."""
        nodes = dict(self.nodes)
        for mac, node in other.nodes.items():
            nodes[mac] = nodes[mac].merge(node) if mac in nodes else node
        edges = dict(self.edges)
        for pair, edge in other.edges.items():
            edges[pair] = edges[pair].merge(edge) if pair in edges else edge
        happened = dict(self.happened)
        for key, events in other.happened.items():
            happened[key] = happened[key].merge(events) if key in happened else events
        firsts = [v for v in (self.first, other.first) if v is not None]
        lasts = [v for v in (self.last, other.last) if v is not None]
        worse = other.timing if not self.frames or other.timing.latency > self.timing.latency else self.timing
        return Ring(
            self.timing if not other.frames else worse,
            min(firsts, default=None),
            max(lasts, default=None),
            self.frames + other.frames,
            self.octets + other.octets,
            self.noise + other.noise,
            self.header_errors + other.header_errors,
            self.data_errors + other.data_errors,
            self.cut + other.cut,
            self.poll_waste + other.poll_waste,
            self.impossible + other.impossible,
            max(self.hole, other.hole, *firsts, 0) if self.frames and other.frames else max(self.hole, other.hole),
            self.unheard + other.unheard,
            MappingProxyType(nodes),
            MappingProxyType(edges),
            MappingProxyType(happened),
            MappingProxyType(
                {pair: max(one.polled.get(pair, 0) for one in (self, other)) for pair in {*self.polled, *other.polled}}
            ),
            MappingProxyType(busiest.summed((self.when_damaged, other.when_damaged))),
        )


def order_of(newest: Mapping[int, int]) -> tuple[int, ...]:
    """The longest ring that the newest tokens close, from its lowest address on. `newest`: to whom each station passed
    the token last."""
    best: list[int] = []
    walked: dict[int, int] = {}  # from which address each was reached first
    for start in sorted(newest):
        walk: list[int] = []
        at = start
        while at in newest and at not in walked:
            walked[at] = start
            walk.append(at)
            at = newest[at]
        if walked.get(at) == start:
            ring = walk[walk.index(at) :]
            lowest = ring.index(min(ring))
            ring = ring[lowest:] + ring[:lowest]
            if len(ring) > len(best) or (len(ring) == len(best) and ring < best):
                best = ring
    return tuple(best)
