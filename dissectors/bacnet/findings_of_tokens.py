"""Findings about tokens: lost ones, second ones, silences in which none is lost, and stations that the ring lost."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from dissectors.bacnet.findings_of_hearing import hasty, unheard_share
from dissectors.bacnet.limits import MAX_MASTER, T_ALL_SILENT
from dissectors.bacnet.ring import Ring
from dissectors.bacnet.ring_events import Happened, RingEventKind
from dissectors.bacnet.ring_remarks import Remark, listed, measured, of, plain
from dissectors.findings import Finding, Severity, counted, times

STRAYS_SHARE = 0.2
"""Of a second token is spoken where it shows itself so many times for each frame that the tap did not hear."""

TAKES_NONE_LEAST = 2

ALONE_POLLS = 2 * MAX_MASTER
"""A first search for a successor takes at most MAX_MASTER polls."""


def tokens(ring: Ring) -> Iterable[Remark]:
    """Lost tokens and second ones, stations that are gone, and one that is alone."""
    for (what, mac), happened in ring.happened.items():
        if what is RingEventKind.LOST_TOKEN and mac is not None:
            yield of("MS101", mac, _lost(happened, f"MAC {mac} had it"), happened)
        elif (
            what is RingEventKind.LEFT
            and mac is not None
            and ring.of(RingEventKind.REJOINED, mac).last <= happened.last
        ):
            node = ring.nodes.get(mac)
            if takes_none(ring, mac):
                continue
            gone = node is not None and node.last_token <= happened.last
            if node is None or not gone or _comes_back(ring, mac, happened.last):
                continue
            if node.last <= happened.last:
                seen = "did not use its token, was passed over, and has been silent since"
                yield of("MS106", mac, seen, happened)
            elif node.replies and not _passes_on(ring, mac, happened.last):
                yield _answers_alone(of("MS106", mac, "", happened, Severity.WARNING), ring)
    strays = [(mac, happened) for (what, mac), happened in ring.happened.items() if what is RingEventKind.TWO_TOKENS]
    strays += hasty(ring).items()
    together = Happened()
    for _, happened in strays:
        together = together.merge(happened)
    if together.count >= 2 and ring.shows_tokens and together.count > STRAYS_SHARE * unheard_share(ring) * ring.frames:
        who = sorted({mac for mac, _ in strays if mac is not None})
        seen = f"MAC {listed(who)} sent {times(together.count)} while another one had the token"
        yield Remark(who[0] if len(who) == 1 else None, of("MS104", None, seen, together).finding)
    for mac in ring.nodes:
        if takes_none(ring, mac):
            yield _takes_none(ring, mac)
    for mac, node in ring.nodes.items():
        if node.polls_sent > ALONE_POLLS and not node.tokens_sent and not node.tokens_received:
            yield _alone(ring, mac, node.polls_sent)


def takes_none(ring: Ring, mac: int | None) -> bool:
    """Whether a station answers polls, and has used none of the tokens that it was given up for."""
    node = ring.nodes.get(mac) if mac is not None else None
    if (
        node is None
        or node.poll_replies_sent < TAKES_NONE_LEAST
        or ring.of(RingEventKind.LEFT, mac).count < TAKES_NONE_LEAST
    ):
        return False
    return not (node.tokens_sent or node.polls_sent or node.requests_sent or node.use.count)


def _takes_none(ring: Ring, mac: int) -> Remark:
    left, node = ring.of(RingEventKind.LEFT, mac), ring.nodes[mac]
    seen = (
        f"answered {counted(node.poll_replies_sent, 'poll')} for masters, and never used the token that it got for it: "
        f"it was given up {times(left.count)}"
    )
    return of("MS113", mac, seen, left)


def _passes_on(ring: Ring, mac: int, since: int) -> bool:
    """Whether a station passed a token on after that time."""
    return any(edge.last > since for (by, _), edge in ring.edges.items() if by == mac)


def _answers_alone(left: Remark, ring: Ring) -> Remark:
    """A station out of the ring that is not off: it is heard, answers when it is asked, and passes no token on."""
    node = ring.nodes[left.mac] if left.mac is not None else None
    polled = node is not None and node.last_polled > left.finding.last
    seen = "did not use its token and was passed over; it is heard since, and passes no token on"
    seen += ", though it is polled" if polled else ""
    return Remark(
        left.mac,
        replace(
            left.finding,
            seen=seen,
            means="it is on and hears the bus, but takes no part in the ring: what it has to say by itself is not sent",
            next="whether it was made a slave, or its program hangs; its firmware and its Max_Master"
            + ("" if polled else "; whether the station before it polls for it at all"),
        ),
    )


def _alone(ring: Ring, mac: int, polls: int) -> Remark:
    """A master without others; where slaves answer it, both directions of its line are sound."""
    answers = sum(other.replies for one, other in ring.nodes.items() if one != mac)
    seen = f"{counted(polls, 'poll')} for masters and not one token"
    if not answers:
        return plain("MS109", ring, mac, seen)
    seen += f"; {counted(answers, 'answer')} to what it asked came from stations that are no masters"
    return plain("MS109", ring, mac, seen, severity=Severity.NOTE)


def silences(ring: Ring) -> Iterable[Remark]:
    """Silences that lose tokens, and for which no station is named."""
    lost, all_silent = ring.of(RingEventKind.LOST_TOKEN, None), ring.of(RingEventKind.ALL_SILENT, None)
    seen = []
    if lost.count:
        seen.append(_lost(lost, _unheld(lost)))
    if all_silent.count:
        seen.append(
            f"{times(all_silent.count)} nothing was sent for up to {measured(all_silent.most)}, and then the ring went "
            "on where it was, without a search for a successor: all stations were silent together, or only this tap "
            "heard nothing"
        )
    if seen:
        both = lost.merge(all_silent)
        remark = of("MS101", None, "; ".join(seen), both, Severity.WARNING if both.count > 1 else Severity.NOTE)
        yield remark if lost.count else remark._replace(finding=_of_all_silent(remark.finding))


def _of_all_silent(finding: Finding) -> Finding:
    """What is found of silences in which no token was lost: no holder is asked about."""
    return replace(
        finding,
        means="something stopped all stations at once: their supply, or a line that was held or interrupted; or only "
        "this tap heard nothing: its adapter, its computer",
        next="the supply of the stations at that time; what the computer and the adapter of this tap did then",
    )


def _lost(happened: Happened, whose: str) -> str:
    return (
        f"the token was lost {times(happened.count)}; {whose}; silence up to {measured(happened.most)}; begun anew by "
        f"MAC {listed(happened.parties)}"
    )


def _unheld(happened: Happened) -> str:
    """Why no station is named for lost tokens."""
    all_silent = (
        f"all stations were silent together, longer than {measured(T_ALL_SILENT)}, which no master that is alive "
        "leaves: their supply, the line or the tap"
    )
    disturbed = "who had it is not known, octets that are no good frame came first, or no other master began in time"
    if happened.least >= T_ALL_SILENT:
        return all_silent
    return f"{disturbed}; or {all_silent}" if happened.most >= T_ALL_SILENT else disturbed


def _comes_back(ring: Ring, mac: int, left: int) -> bool:
    """Whether a station that was away before has not been away clearly longer yet, at the end of what was heard."""
    leaves = [event.time for event in ring.of(RingEventKind.LEFT, mac).events]
    returns = [event.time for event in ring.of(RingEventKind.REJOINED, mac).events]
    away = [back - max(before) for back in returns if (before := [time for time in leaves if time < back])]
    return bool(away) and (ring.last or left) - left <= 2 * max(away)
