"""Findings about polls for masters, and about who uses the line."""

from __future__ import annotations

from collections.abc import Iterable

from dissectors.bacnet.frame_types import HEADER
from dissectors.bacnet.limits import N_POLL, T_NO_TOKEN, T_REPLY_DELAY, T_REPLY_TIMEOUT, T_USAGE_DELAY
from dissectors.bacnet.ring import Ring, RingNode
from dissectors.bacnet.ring_events import RingEventKind
from dissectors.bacnet.ring_questions import T_GO_ON
from dissectors.bacnet.ring_remarks import Remark, listed, measured, of, plain, share_of_polls
from dissectors.bacnet.rules import RULES
from dissectors.findings import Severity, as_consequence, counted, times
from dissectors.line import NS_PER_S
from dissectors.words import percent

POLLS_SHARE = 0.1
LEAST_POLLS = 20
SLOW_POLLS_LEAST = 5
HASTY_LEAST = 3
NOT_TAKEN_LEAST = 3

SLOW_ROUND = 2 * NS_PER_S
LEAST_ROUNDS = 20
HOG_SHARE = 0.5
HOG_FRAMES = 8
LEAST_WATCHED = 10 * NS_PER_S
STORM_LEAST = 10 * NS_PER_S
"""A storm lasts at least so long: a search for all devices is over sooner."""

STORM_OF_ONE = 0.8
NEAR_LIMIT = 0.9
WAITS_SHARE = 0.5
STRETCHED = 5
"""So many times longer than an idle one is a round where data take nearly all of the time."""


def polls(ring: Ring) -> Iterable[Remark]:
    """Too many polls for masters, searches that stop the bus, and polls that wait too long or too short."""
    advice = {int(words.split()[1]): words for words in ring.advice()}
    together = _who_poll_alike(ring)
    whole = _of_all_who_poll(ring, together) if together else None
    if whole is not None:
        yield whole
    for mac, node in ring.nodes.items():
        seen, tokens, made = [], node.tokens_received, _polls_made(node)
        if _polls_too_often(ring, node):
            seen.append(
                f"{made} polls to {tokens} tokens (one in {N_POLL} is usual), {min(made, node.polls_unanswered)} "
                "of them "
                f"unanswered, up to address {node.highest_polled}{share_of_polls(ring)}"
            )
        stopped = ring.of(RingEventKind.STOPPED, mac)
        if stopped.count > 1:
            seen.append(
                f"{times(stopped.count)} it polled up to {node.highest_polled} for a successor after a loss, and "
                "the bus "
                f"stood still for up to {measured(stopped.most)}"
            )
        on = ring.of(RingEventKind.POLLED_ON, mac)
        if on.count > 1:
            seen.append(
                f"{times(on.count)} it polled one address after another with one token though it had lost nobody, up "
                f"to {node.highest_polled}, and the bus stood still for up to {measured(on.most)}; one poll is usual"
            )
        if seen:
            words = "; ".join(seen)
            remark = plain("MS201", ring, mac, f"{words}; {advice[mac]}" if mac in advice else words, made)
            if whole is not None and mac in together and stopped.count <= 1 and on.count <= 1:
                remark = Remark(mac, as_consequence(remark.finding, whole.finding, RULES))
            yield remark
    yield from _waits(ring)


def _polls_made(node: RingNode) -> int:
    """Polls for a new master; those of a search for a lost one are not counted."""
    return node.polls_sent - node.polls_of_search


def _polls_too_often(ring: Ring, node: RingNode) -> bool:
    tokens, made = node.tokens_received, _polls_made(node)
    unread = ring.header_errors + ring.cut + ring.noise // HEADER  # each of them may have been a token to it
    return made >= LEAST_POLLS and tokens > 0 and made > POLLS_SHARE * (tokens + unread)


def _who_poll_alike(ring: Ring) -> frozenset[int]:
    """Masters that poll too often, where they are several, and half of all: one setting or make, told once."""
    often = frozenset(mac for mac, node in ring.nodes.items() if _polls_too_often(ring, node))
    return often if len(often) > 1 and 2 * len(often) >= len(ring.masters) else frozenset()


def _of_all_who_poll(ring: Ring, who: frozenset[int]) -> Remark:
    nodes = [ring.nodes[mac] for mac in who]
    made, tokens = sum(map(_polls_made, nodes)), sum(node.tokens_received for node in nodes)
    seen = (
        f"MAC {listed(sorted(who))} poll alike: {made} polls to {tokens} tokens (one in {N_POLL} is usual)"
        f"{share_of_polls(ring)}"
    )
    return plain("MS201", ring, None, seen, made)


def _waits(ring: Ring) -> Iterable[Remark]:
    for (what, mac), happened in ring.happened.items():
        node = ring.nodes.get(mac) if mac is not None else None
        if node is None or mac is None:
            continue
        waited = node.poll_wait
        if what is RingEventKind.SLOW_SEARCH and happened.count >= max(SLOW_POLLS_LEAST, waited.count // 2):
            seen = (
                f"{happened.count} of {times(waited.count)} it went on later than {measured(T_GO_ON)} after a "
                "poll that "
                f"nobody answered (20 … 35 ms are usual); median {measured(waited.quantile(0.5))}, longest "
                f"{measured(waited.most)}"
            )
            yield of("MS203", mac, seen, happened)
        if what is RingEventKind.NOT_TAKEN:
            who = f"MAC {listed(happened.parties)}"
            seen = f"{times(happened.count)} {who} answered its poll in time, and it did not pass the token there"
            yield of("MS205", mac, seen, happened, Severity.NOTE if happened.count < NOT_TAKEN_LEAST else None)
        if (
            what is RingEventKind.TOO_SOON
            and happened.count >= HASTY_LEAST
            and not ring.coarse
            and not has_two_rhythms(ring, mac)
        ):
            seen = (
                f"{happened.count} of {counted(waited.count, 'time')} it went on before the station that it "
                "polled could "
                f"answer; median {measured(waited.quantile(0.5))}, 20 … 35 ms are usual"
            )
            yield of("MS204", mac, seen, happened)


def has_two_rhythms(ring: Ring, mac: int) -> bool:
    """Whether an address now waits for the answer to its polls, and now goes on before there can be one.

    No single station does both.
    """
    node = ring.nodes.get(mac)
    soon = ring.of(RingEventKind.TOO_SOON, mac).count
    return node is not None and not ring.coarse and soon >= HASTY_LEAST and node.polls_waited >= HASTY_LEAST


def use(ring: Ring) -> Iterable[Remark]:
    """Who uses the line: slow rounds, a station that takes most of the time, broadcasts in masses, nearly no
    time left. A log without times says nothing of that."""
    if not ring.timing.has_times:
        return
    yield from _slow_rounds(ring)
    if ring.span < LEAST_WATCHED:
        return
    masters = ring.masters
    for mac in masters:
        node = ring.nodes[mac]
        share = node.held / ring.span
        if len(masters) > 1 and share >= HOG_SHARE and node.most_in_a_hold >= HOG_FRAMES:
            seen = (
                f"has the token for {percent(share, 0)} of the time and sends up to {node.most_in_a_hold} frames with "
                "one (its Max_Info_Frames is at least that)"
            )
            yield plain("MS601", ring, mac, seen)
    yield from _storm(ring)
    yield from _near_limit(ring)


def _slow_rounds(ring: Ring) -> Iterable[Remark]:
    slow = {}
    for mac in ring.masters:
        loop = ring.nodes[mac].loop
        quantile = loop.quantile(0.95)
        if quantile is not None and loop.count >= LEAST_ROUNDS and quantile > SLOW_ROUND:
            slow[mac] = quantile
    if not slow:
        return
    users = sorted(ring.masters, key=lambda mac: -ring.nodes[mac].held)[:3]
    shares = ", ".join(
        f"MAC {mac} ({percent(ring.nodes[mac].held / max(1, ring.span), 0)} of the time, up to "
        f"{counted(ring.nodes[mac].most_in_a_hold, 'frame')} each)"
        for mac in users
    )
    seen = f"95% of the rounds took up to {measured(max(slow.values()))}; the token was longest with {shares}"
    yield plain("MS108", ring, None, seen, len(slow))


def _storm(ring: Ring) -> Iterable[Remark]:
    storms = {
        mac: happened
        for (what, mac), happened in ring.happened.items()
        if what is RingEventKind.STORM and mac is not None
    }
    if not storms:
        return
    together = None
    for happened in storms.values():
        together = happened if together is None else together.merge(happened)
    assert together is not None
    if together.most < STORM_LEAST:
        return
    sent = {mac: ring.nodes[mac].broadcasts_sent for mac in storms}
    total = sum(node.broadcasts_sent for node in ring.nodes.values())
    most = max(sent, key=lambda mac: sent[mac])
    alone = sent[most] >= STORM_OF_ONE * total
    who = f"{sent[most]} of them by MAC {most}" if alone else f"most by MAC {listed(sorted(sent))}"
    lasted = together.most / NS_PER_S
    seen = f"{counted(total, 'broadcast')}, {who}; over 20 a second for at least {lasted:.0f} s"
    yield of("MS602", most if alone else None, seen, together)


def _near_limit(ring: Ring) -> Iterable[Remark]:
    idle, at_most = ring.predicted_loop, ""
    if idle and not ring.measurable(T_USAGE_DELAY):
        idle, at_most = idle + len(ring.order) * T_USAGE_DELAY, "at most "  # how long they take is not known
    loops = [ring.nodes[mac].loop.quantile(0.5) for mac in ring.order if mac in ring.nodes]
    known = [loop for loop in loops if loop is not None]
    if not idle or not known or ring.span < LEAST_WATCHED:
        return
    loop = sorted(known)[len(known) // 2]
    rounds = max((ring.nodes[mac].loop.count for mac in ring.order if mac in ring.nodes), default=0)
    for_data = 1 - rounds * idle / ring.span - ring.poll_waste_share - _in_vain(ring) / ring.span
    if for_data >= NEAR_LIMIT and loop >= STRETCHED * idle:
        seen = (
            f"data take {percent(for_data, 0)} of the time{_of_them_waits(ring)}; a round takes {measured(loop)} where "
            f"an idle one would take {at_most}{measured(idle)}"
        )
        yield plain("MS603", ring, None, seen, severity=Severity.NOTE)


def _in_vain(ring: Ring) -> int:
    """How long the bus waited at least for answers that did not come, and for a token that was lost, ns."""
    waits = {
        RingEventKind.NO_REPLY: T_REPLY_TIMEOUT,
        RingEventKind.LOST_TOKEN: T_NO_TOKEN,
        RingEventKind.ALL_SILENT: T_NO_TOKEN,
    }
    return sum(happened.count * waits.get(what, 0) for (what, _), happened in ring.happened.items())


def _of_them_waits(ring: Ring) -> str:
    """How much of the time goes into waiting for answers, and for whose, where that is half of it and more."""
    waits = {mac: node.reply.total for mac, node in ring.nodes.items()}
    share = sum(waits.values()) / ring.span
    if share < WAITS_SHARE or not ring.measurable(T_REPLY_DELAY):
        return ""
    slowest = max(waits, key=lambda mac: waits[mac])
    median = ring.nodes[slowest].reply.quantile(0.5)
    return f", {percent(share, 0)} the wait for answers (longest for MAC {slowest}, median {measured(median or 0)})"
