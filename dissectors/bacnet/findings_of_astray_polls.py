"""Polls where a station has no successor to find: it looks only between itself and the one that has its token next."""

from __future__ import annotations

from collections.abc import Iterable

from dissectors.bacnet.limits import MAX_MASTER
from dissectors.bacnet.ring import Ring, lies_between
from dissectors.bacnet.ring_events import RingEventKind
from dissectors.bacnet.ring_remarks import Remark, plain

LEAST = 3
"""Addresses; one may be polled for another reason."""

_SEARCHES = (RingEventKind.LEFT, RingEventKind.LOST_TOKEN, RingEventKind.POLLED_ON)
"""What makes a station look everywhere, and rightly, or is told of by itself."""


def astray(ring: Ring) -> Iterable[Remark]:
    """Stations that poll beyond their successor though they have lost nobody. Only of what came since they pass their
    token to it, and where none of it was missed."""
    searching = {who for what in _SEARCHES for who in _who(ring, what)}
    for mac in ring.masters:
        following = _successor(ring, mac)
        if mac in searching or following is None:
            continue
        since = max(ring.edges[mac, following].since, ring.hole)
        polled = sorted(to for (by, to), time in ring.polled.items() if by == mac and time > since and to <= MAX_MASTER)
        beyond = [to for to in polled if to not in (following, mac) and not lies_between(to, mac, following)]
        if len(beyond) >= LEAST:
            seen = (
                f"polls {_ranges(beyond)}, none of which lies between it and MAC {following}, to which it passes its "
                "token"
            )
            yield plain("MS206", ring, mac, seen, len(beyond))


def _who(ring: Ring, what: RingEventKind) -> Iterable[int | None]:
    """Who looks for somebody then: of a station that left, the one that passed the token to it."""
    for (kind, mac), happened in ring.happened.items():
        if kind is what:
            yield from (mac,) if what is RingEventKind.POLLED_ON else happened.others


def _successor(ring: Ring, mac: int) -> int | None:
    passed = [(edge.last, to) for (by, to), edge in ring.edges.items() if by == mac and to != mac]
    return max(passed)[1] if passed else None


def _ranges(addresses: list[int]) -> str:
    """`9 … 20, 25`."""
    ranges: list[list[int]] = []
    for address in addresses:
        if ranges and address == ranges[-1][1] + 1:
            ranges[-1][1] = address
        else:
            ranges.append([address, address])
    return ", ".join(str(first) if first == last else f"{first} … {last}" for first, last in ranges)
