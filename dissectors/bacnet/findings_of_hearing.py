"""Findings about the tap: frames that must have been sent, and stations of which it hears nothing."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import replace

from dissectors.bacnet.findings_of_waiting import given_up_by, impatient
from dissectors.bacnet.ring import Ring
from dissectors.bacnet.ring_events import HASTY, Happened, RingEvent, RingEventKind
from dissectors.bacnet.ring_remarks import Remark, listed, of
from dissectors.findings import Severity, counted, times

UNHEARD_SHARE = 0.01
"""Share of frames that were not heard from which on the capture is a poor witness."""

MUTE_LEAST = 3
"""So often others must have gone on as after a frame of a station that was never heard."""

HASTY_LEAST = 5
HASTY_SHARE = 0.8
"""Of what a station sends as after tokens that were not heard: where so much comes too soon after a poll of the one
that should have passed it, it had one of its own."""


def hearing(ring: Ring) -> Iterable[Remark]:
    """What the tap did not hear: one station where it hears nothing of it alone, else the bus."""
    unheard = _unheard(ring)
    mute = {mac: happened for mac, happened in unheard.items() if _is_mute(ring, mac, happened)}
    others = {mac: happened for mac, happened in unheard.items() if mac not in mute}
    if mute:
        seen = f"nothing of it is heard, though others went on as after its frames {times(_total(mute))}"
        if len(mute) > 1:
            seen = f"nothing of MAC {listed(sorted(mute))} is heard, though others went on as after their frames "
            seen += times(_total(mute))
        yield of("MS406", next(iter(mute)) if len(mute) == 1 else None, seen, _together(mute))
    if others:
        total = _total(others)
        who = f"of MAC {listed(sorted(others))}"
        seen = f"at least {counted(total, 'frame')} {who} not heard, beside {ring.frames} that were"
        few = total < MUTE_LEAST or total < UNHEARD_SHARE * (ring.frames + total)
        yield of("MS406", None, seen, _together(others), Severity.NOTE if few else None)


def unheard_share(ring: Ring) -> float:
    """The share of frames that were not heard, of stations that are heard at all."""
    unheard = _unheard(ring)
    total = sum(happened.count for mac, happened in unheard.items() if not _is_mute(ring, mac, happened))
    return total / max(1, ring.frames + total)


def hasty(ring: Ring) -> dict[int, Happened]:
    """Who sent after polls of others, again and again sooner than a token can have come: those have a second one."""
    sent: dict[int, list[RingEvent]] = {}
    for (what, _), happened in ring.happened.items():
        if what is RingEventKind.UNHEARD:
            for event in happened.events:
                if event.other is not None:
                    sent.setdefault(event.other, []).append(event)
    found = {}
    for mac, events in sorted(sent.items()):
        soon = [event for event in events if event.value == HASTY]
        if len(soon) >= HASTY_LEAST and len(soon) >= HASTY_SHARE * len(events):
            found[mac] = Happened()
            for event in {event.no: event for event in soon}.values():
                found[mac] = found[mac].add(replace(event, mac=mac, other=event.mac))
    return found


def takes_unheard(ring: Ring, mac: int | None) -> bool:
    """Whether a station of which nothing is heard takes each token that seems to be repeated to it.

    A token is repeated once; then its sender polls for another station.
    """
    node = ring.nodes.get(mac) if mac is not None else None
    repeated = ring.of(RingEventKind.RETRY, mac).count
    silent = node is not None and not node.first and repeated >= MUTE_LEAST
    return silent and not ring.of(RingEventKind.LEFT, mac).count


def _unheard(ring: Ring) -> dict[int, Happened]:
    unheard: dict[int, Happened] = {}
    second, waits = hasty(ring), impatient(ring)
    for (what, mac), happened in sorted(ring.happened.items(), key=lambda one: one[0][1] or 0):
        counts = what is RingEventKind.UNHEARD or (what is RingEventKind.RETRY and takes_unheard(ring, mac))
        if second and what is RingEventKind.UNHEARD:
            happened = _without(happened, lambda event: event.other in second)
        if waits and what is RingEventKind.UNHEARD:
            happened = _without(happened, lambda event: given_up_by(waits, event))
        if counts and happened.count and mac is not None:
            unheard[mac] = unheard.get(mac, Happened()).merge(happened)
    return unheard


def _without(happened: Happened, is_otherwise: Callable[[RingEvent], bool]) -> Happened:
    """Without what was otherwise: sent by those that have a second token, or given up by those that wait too short."""
    events = tuple(event for event in happened.events if not is_otherwise(event))
    if len(events) == len(happened.events):
        return happened
    return replace(happened, count=len(events), events=events, others=Counter(event.other for event in events))


def _is_mute(ring: Ring, mac: int, happened: Happened) -> bool:
    node = ring.nodes.get(mac)
    return happened.count >= MUTE_LEAST and (node is None or not node.first)


def _total(unheard: dict[int, Happened]) -> int:
    return sum(happened.count for happened in unheard.values())


def _together(unheard: dict[int, Happened]) -> Happened:
    together = Happened()
    for happened in unheard.values():
        together = together.merge(happened)
    return together
