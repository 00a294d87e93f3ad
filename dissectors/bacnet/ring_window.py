"""A ring between two looks at it, as flat numbers: for a line a second in a recording."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from dissectors.bacnet.ring import Ring, RingEventKind, RingNode
from dissectors.histogram import Histogram
from dissectors.line import MS

Numbers = Mapping[str, int | float]


@dataclass(frozen=True, slots=True)
class MstpRingWindow:
    """`bus`: of the whole ring. `nodes`: of each station that got the token or polled. Names say the unit."""

    bus: Numbers
    nodes: Mapping[int, Numbers]


def ring_window(before: Ring, now: Ring) -> MstpRingWindow:
    """What happened since `before`, an earlier look at the same bus; times that nothing is known of are absent."""
    loops = Histogram()
    nodes: dict[int, Numbers] = {}
    for mac, node in now.nodes.items():
        earlier = before.nodes.get(mac, RingNode())
        tokens = node.tokens_received - earlier.tokens_received
        unanswered = node.polls_unanswered - earlier.polls_unanswered
        loop = node.loop.since(earlier.loop)
        loops = loops.merge(loop)
        if tokens or unanswered:
            nodes[mac] = {
                "tokens": tokens,
                "token_retries": _retries(now, mac) - _retries(before, mac),
                "polls_unanswered": unanswered,
                "postponed": node.postponed - earlier.postponed,
                **_times("loop", loop),
                **_times("token_use", node.use.since(earlier.use)),
            }
    span = now.span - before.span
    bus: Numbers = {
        "ring_masters": len(now.order),
        "tokens": sum(edge.tokens for edge in now.edges.values()) - sum(edge.tokens for edge in before.edges.values()),
        "token_retries": _retries(now) - _retries(before),
        "tokens_lost": _happened(now, RingEventKind.LOST_TOKEN) - _happened(before, RingEventKind.LOST_TOKEN),
        "poll_waste": min(1.0, (now.poll_waste - before.poll_waste) / span) if span > 0 else 0.0,
        **_times("loop", loops),
    }
    return MstpRingWindow(bus, nodes)


def _retries(ring: Ring, source: int | None = None) -> int:
    return sum(edge.retries for (mac, _), edge in ring.edges.items() if source is None or mac == source)


def _happened(ring: Ring, what: RingEventKind) -> int:
    return sum(events.count for (kind, _), events in ring.happened.items() if kind is what)


def _times(name: str, histogram: Histogram) -> dict[str, int | float]:
    named = ((f"{name}_p50_ms", histogram.quantile(0.5)), (f"{name}_max_ms", histogram.most))
    return {key: value / MS for key, value in named if value is not None}
