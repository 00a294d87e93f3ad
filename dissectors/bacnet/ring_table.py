"""The MS/TP ring in words and table rows, one row a master."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dissectors.findings import counted
from dissectors.histogram import Histogram
from dissectors.line import MS
from dissectors.token_ring import Cell
from dissectors.words import duration, milliseconds, percent

if TYPE_CHECKING:
    from dissectors.bacnet.ring import Ring
    from dissectors.bacnet.ring_events import RingEventKind

HEADINGS = (
    "MAC",
    "next",
    "tokens",
    "retries",
    "lost",
    "loop p50 ms",
    "loop max ms",
    "use p50 ms",
    "use p95 ms",
    "use max ms",
    "reply p50 ms",
    "reply p95 ms",
    "reply max ms",
    "postponed",
    "frames/hold",
    "polls unanswered",
    "polled to",
    "damaged",
)


_SHARES = (0.5, 0.95, 1)


def rows(ring: Ring) -> list[tuple[Cell, ...]]:
    """One row a master, in the order of the ring, then those outside it by address."""
    order = ring.order
    outside = tuple(mac for mac in ring.masters if mac not in order)
    following = dict(zip(order, order[1:] + order[:1], strict=True))
    return [_row(ring, mac, following.get(mac)) for mac in order + outside if mac in ring.nodes]


def _row(ring: Ring, mac: int, following: int | None) -> tuple[Cell, ...]:
    from dissectors.bacnet.ring_events import RingEventKind  # a bus of which nobody asks for the ring has none

    node = ring.nodes[mac]
    times = (
        _ms(node.loop, 0.5),
        _ms(node.loop, 1),
        *(_ms(which, share) for which in (node.use, node.reply) for share in _SHARES),
    )
    return (
        mac,
        following,
        node.tokens_sent,
        sum(edge.retries for (source, _), edge in ring.edges.items() if source == mac),
        ring.of(RingEventKind.LOST_TOKEN, mac).count,
        *(times if ring.timing.has_times else (None,) * len(times)),
        node.postponed,
        node.most_in_a_hold,
        node.polls_unanswered,
        node.highest_polled if node.highest_polled >= 0 else None,
        node.damaged,
    )


def sentences(ring: Ring) -> list[str]:
    """The ring as a whole: order, loop time, waste, what cannot be judged, what happened, advice."""
    order = ring.order
    said = [f"ring of {len(order)}: {' → '.join(map(str, (*order, order[0])))}" if order else "no closed ring seen"]
    untimed = [f"{counted(ring.frames, 'frame')}; when they came is not known"]
    said += _of_time(ring) if ring.timing.has_times else untimed
    bound = milliseconds(ring.timing.latency)
    said += [
        f"{name} against the standard's limit: not measurable, this adapter may hold octets back up to {bound}"
        for name, possible in ring.limits.items()
        if not possible and ring.timing.has_times
    ]
    return said + _happened(ring) + list(ring.advice())


def _happened(ring: Ring) -> list[str]:
    counts: dict[RingEventKind, int] = {}
    for (what, _), happened in ring.happened.items():
        counts[what] = counts.get(what, 0) + happened.count
    return [f"{count} × {what.value}" for what, count in counts.items() if count]


def _of_time(ring: Ring) -> list[str]:
    """How the time is used."""
    said = [
        f"{counted(ring.frames, 'frame')} in {duration(ring.span)}; bus load {percent(ring.load)}",
        f"unanswered polls for masters take {percent(ring.poll_waste_share)} of the time",
        *_users(ring),
    ]
    predicted = ring.predicted_loop
    if predicted is not None:
        least = "" if ring.limits["token use"] else "at least "
        said.append(f"an idle round should take {least}{milliseconds(predicted)}")
    return said


def _users(ring: Ring) -> list[str]:
    """Who has the token for how much of the time, and how many broadcasts there are."""
    held = sorted(((node.held, mac) for mac, node in ring.nodes.items() if node.held), reverse=True)
    said = []
    if held and ring.span:
        shares = ", ".join(
            f"MAC {mac} {percent(time / ring.span, 0)} "
            f"(up to {counted(ring.nodes[mac].most_in_a_hold, 'frame')} a token)"
            for time, mac in held[:3]
        )
        said.append(f"the token is longest with {shares}")
    broadcasts = sum(node.broadcasts_sent for node in ring.nodes.values())
    if broadcasts and ring.span:
        said.append(f"{counted(broadcasts, 'broadcast')}, {broadcasts / (ring.span / 1e9):.1f} a second")
    return said


def _ms(durations: Histogram, share: float) -> float | None:
    value = durations.most if share == 1 else durations.quantile(share)
    return None if value is None else value / MS
