"""The token ring of a bus, and its slaves, as a value; what changed between two looks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from dissectors.histogram import Histogram
from dissectors.line import MS
from dissectors.profibus.slave_state import SlaveState

Numbers = Mapping[str, int | float]


@dataclass(frozen=True, slots=True)
class MasterView:
    """A master. `rotation`: ns from one token that it got to the next. `following`: whom it passes the token to.
    `polls`, `answered`: GAP polls. `repeats`: tokens sent again. `claims`: times it made a token of its own."""

    tokens: int = 0
    following: int | None = None
    repeats: int = 0
    claims: int = 0
    requests: int = 0
    polls: int = 0
    answered: int = 0
    rotation: Histogram = field(default_factory=Histogram)


@dataclass(frozen=True, slots=True)
class SlaveCounts:
    """What went otherwise than smoothly with a slave; `ring_words.SLAVE_HEADINGS` says what each is."""

    lost: int = 0
    syncs: int = 0
    repeats: int = 0
    longest: int = 0
    illegal: int = 0
    rejects: int = 0
    diagnoses: int = 0
    faults: int = 0


@dataclass(frozen=True, slots=True)
class SlaveRow:
    """A slave: its state and since when (ns), how often that changed, exchanges of data; `cycle`: ns from one exchange
    of data that its master began to the next."""

    state: SlaveState
    since: int
    changed: int
    exchanges: int
    changes: tuple[tuple[int, SlaveState], ...]
    counts: SlaveCounts = SlaveCounts()
    cycle: Histogram = field(default_factory=Histogram)


@dataclass(frozen=True, slots=True)
class Ring:
    """`first`, `last`: ns, of what was seen, but for `unheard` ns between. `wasted`: ns spent on polls that nobody
    answered. `has_times`: whether the capture says when anything came; else all times are those of octets laid one
    behind the other. `latency`: ns for which the adapter may hold octets back."""

    masters: Mapping[int, MasterView] = field(default_factory=dict)
    slaves: Mapping[int, SlaveRow] = field(default_factory=dict)
    first: int = 0
    last: int = 0
    wasted: int = 0
    has_times: bool = True
    unheard: int = 0
    latency: int = 0

    @property
    def wasted_share(self) -> float | None:
        """The share of the time, 0 … 1, that polls took which nobody answered; None where the capture cannot tell: the
        adapter may hold octets back for longer than such a poll takes."""
        unanswered = sum(view.polls - view.answered for view in self.masters.values())
        if not self.has_times or self.latency * unanswered > self.wasted:
            return None
        return self.wasted / self.span if self.span else 0.0

    @property
    def span(self) -> int:
        """ns that were watched."""
        return self.last - self.first - self.unheard

    @property
    def order(self) -> tuple[int, ...]:
        """Masters in the order of the token, from the lowest; empty where it does not come round."""
        if not self.masters:
            return ()
        begin = min((one for one, view in self.masters.items() if view.tokens), default=None)
        order: list[int] = []
        at = begin
        while at is not None and at not in order:
            order.append(at)
            view = self.masters.get(at)
            at = None if view is None else view.following
        return tuple(order) if at == begin and at is not None else ()


@dataclass(frozen=True, slots=True)
class RingWindow:
    """`bus`: of the whole ring. `nodes`: of each master. Named as every ring's are; names say the unit."""

    bus: Numbers = field(default_factory=dict)
    nodes: Mapping[int, Numbers] = field(default_factory=dict)

    def of(self, address: int) -> Numbers:
        """Of a master; empty for any other."""
        return self.nodes.get(address, {})


def ring_window(before: Ring, now: Ring) -> RingWindow:
    """What happened since `before`, an earlier look at the same bus."""
    nodes: dict[int, Numbers] = {}
    rotations = Histogram()
    for address, view in now.masters.items():
        earlier = before.masters.get(address, MasterView())
        rotation = view.rotation.since(earlier.rotation)
        rotations = rotations.merge(rotation)
        if view.tokens > earlier.tokens or view.polls > earlier.polls:
            nodes[address] = {
                "tokens": view.tokens - earlier.tokens,
                "token_retries": view.repeats - earlier.repeats,
                "polls_unanswered": (view.polls - view.answered) - (earlier.polls - earlier.answered),
                **_times(rotation),
            }
    span = now.span - before.span
    bus: Numbers = {
        "ring_masters": len(now.order),
        "tokens": sum(view.tokens for view in now.masters.values())
        - sum(view.tokens for view in before.masters.values()),
        "poll_waste": min(1.0, (now.wasted - before.wasted) / span) if span > 0 else 0.0,
        "slaves_in_exchange": sum(slave.state is SlaveState.EXCHANGE for slave in now.slaves.values()),
        **_times(rotations),
    }
    return RingWindow(bus, nodes)


def _times(rotation: Histogram) -> dict[str, int | float]:
    named = (("loop_p50_ms", rotation.quantile(0.5)), ("loop_max_ms", rotation.quantile(1)))
    return {key: value / MS for key, value in named if value is not None}
