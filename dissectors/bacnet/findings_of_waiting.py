"""Findings about those who ask and do not wait for the answer as long as they must.

One that goes on sooner than it may give up has its answer, as a rule, and the tap did not hear it. But where it always
goes on after the same wait, and the answer is heard behind that, or never came so soon to anybody, the wait is its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from dissectors.bacnet.limits import MS
from dissectors.bacnet.ring import Ring
from dissectors.bacnet.ring_events import Happened, RingEvent, RingEventKind
from dissectors.bacnet.ring_remarks import Remark, listed, measured, of
from dissectors.bacnet.unheard import TRUSTED
from dissectors.findings import times

OVERTAKEN_LEAST = 3
"""So many answers must have come behind a wait, and clearly more than frames were not heard: each may be the answer to
a second question, where that one and the first answer were not."""

GIVEN_UP_LEAST = 5
"""So many waits alike are a timeout even where no answer is heard behind them."""

SOONEST = 0.05
"""An answer that was not heard took as long as those that are heard: sooner than all but this share is too soon."""

ALIKE, ALIKE_SHARE = 3 * MS, 0.1
"""By how much waits may differ that are one timeout of a program, and by which share of it."""

MOST_ALIKE = 0.8
"""Of the waits of a station."""


def impatient(ring: Ring) -> Mapping[int, Happened]:
    """Who goes on after a wait of its own, too short: by station, the events of such waits."""
    waits: dict[int, list[RingEvent]] = {}
    for (what, mac), happened in ring.happened.items():
        if mac is None or what not in (RingEventKind.OVERTAKEN, RingEventKind.UNHEARD):
            continue
        for event in happened.events:
            if what is RingEventKind.OVERTAKEN:
                waits.setdefault(mac, []).append(event)
            elif event.is_wait and event.other is not None:
                waits.setdefault(event.other, []).append(replace(event, mac=event.other, other=mac))
    found = {}
    for mac, events in sorted(waits.items()):
        alike = _alike(ring, events)
        if alike and len(alike) >= MOST_ALIKE * len(events) and _is_own(ring, mac, alike):
            found[mac] = Happened()
            for event in sorted(alike, key=lambda event: event.no):
                found[mac] = found[mac].add(event)
    return found


def given_up_by(waits: Mapping[int, Happened], event: RingEvent) -> bool:
    """Whether an answer that seems unheard is one for which a station did not wait."""
    wait = waits.get(event.other) if event.other is not None and event.is_wait else None
    return wait is not None and wait.least <= (event.value or 0) <= wait.most


def waiting(waits: Mapping[int, Happened]) -> list[Remark]:
    """Those who do not wait for what they asked."""
    found = []
    for mac, happened in waits.items():
        first, last = measured(happened.least), measured(happened.most)
        wait = first if first == last else f"{first} to {last}"
        seen = (
            f"asked MAC {listed(happened.parties)} and went on after {wait} without the answer {times(happened.count)}"
        )
        found.append(of("MS307", mac, seen, happened))
    return found


def _alike(ring: Ring, events: Sequence[RingEvent]) -> list[RingEvent]:
    """Those whose wait is about as long as that of most of them."""
    middle = _usual(events)
    play = 2 * ring.timing.latency + max(ALIKE, round(ALIKE_SHARE * middle))
    return [event for event in events if 2 * abs((event.value or 0) - middle) <= play]


def _usual(events: Sequence[RingEvent]) -> int:
    return sorted(event.value or 0 for event in events)[len(events) // 2]


def _is_own(ring: Ring, client: int, alike: Sequence[RingEvent]) -> bool:
    """Whether waits that are alike are no answers that were not heard."""
    overtaken = sum(event.what is RingEventKind.OVERTAKEN for event in alike)
    unheard = sum(one.count for (what, _), one in ring.happened.items() if what is RingEventKind.UNHEARD)
    others = max(0, unheard - (len(alike) - overtaken))
    requests = ring.nodes[client].requests_sent if client in ring.nodes else 0
    by_chance = TRUSTED * requests * others / max(1, ring.frames + others)
    if overtaken >= OVERTAKEN_LEAST and overtaken > by_chance:
        return True
    asked = {event.other for event in alike if event.other is not None}
    return len(alike) >= GIVEN_UP_LEAST and all(_is_too_soon(ring, _usual(alike), mac) for mac in asked)


def _is_too_soon(ring: Ring, wait: int, mac: int) -> bool:
    """Whether a station hardly ever answers so soon."""
    node = ring.nodes.get(mac)
    soonest = None if node is None or node.reply.count < GIVEN_UP_LEAST else node.reply.quantile(SOONEST)
    return soonest is not None and wait < soonest
