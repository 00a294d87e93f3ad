"""Findings about stations past which the token goes, and about who passes it past them."""

from __future__ import annotations

from collections.abc import Container, Iterable

from dissectors.bacnet.limits import MAX_MASTER, N_POLL
from dissectors.bacnet.ring import Ring, RingNode, lies_between
from dissectors.bacnet.ring_remarks import Remark, listed, plain
from dissectors.bacnet.rules import RULES
from dissectors.findings import as_consequence
from dissectors.words import elapsed

SKIPPED_ROUNDS = 20
"""So many tokens past a station that is in the ring, and not one poll to it, are no accident."""


def skipped(ring: Ring) -> Iterable[Remark]:
    """Each station that is shut out; where one and the same shuts out several, that one, and they under it."""
    past: dict[tuple[int, int], list[Remark]] = {}
    for mac, node in ring.nodes.items():
        skipping = _skipped_by(ring, mac, node)
        if skipping is not None:
            by, following, rounds = skipping
            past.setdefault((by, following), []).append(_shut_out(ring, mac, node, by, following, rounds))
    for (by, following), remarks in past.items():
        if len(remarks) == 1:
            yield from remarks
            continue
        macs = sorted(one.mac for one in remarks if one.mac is not None)
        seen = f"passes the token on to MAC {following}, past MAC {listed(macs)}, which were in the ring before"
        polled = sorted(address for source, address in ring.polled if source == by)
        beyond = [address for address in polled if not lies_between(address, by, macs[0])]
        if beyond and polled[-1] < by:
            seen += f"; it polls {listed(polled)} and none above its own address"
        cause = plain("MS112", ring, by, seen, len(macs))
        yield cause
        for one in remarks:
            yield Remark(one.mac, as_consequence(one.finding, cause.finding, RULES))


def _shut_out(ring: Ring, mac: int, node: RingNode, by: int, following: int, rounds: int) -> Remark:
    polled = sorted(
        address for (source, address), time in ring.polled.items() if source == by and time > node.last_token
    )
    first = "" if ring.first is None else f" {elapsed(node.last_token - ring.first, 2)} into the capture"
    seen = (
        f"got its last token{first}; since then {rounds} rounds without a token or a poll for it: "
        f"MAC {by} passes the token on to MAC {following} and polls "
        f"{f'only {listed(polled)}' if polled else 'nobody'}, never {_unpolled(by, following, polled)}"
    )
    return plain("MS110", ring, mac, seen, rounds)


def _skipped_by(ring: Ring, mac: int, node: RingNode) -> tuple[int, int, int] | None:
    """Who passes the token past a station that was in the ring: (who, to whom, how often).

    It missed no token, or is heard while the token goes past it and nobody polls it.
    """
    used = node.tokens_sent and node.tokens_received and node.last > node.last_token > ring.hole
    if not used or node.last_polled > node.last_token or mac > MAX_MASTER:
        return None
    has_noise = ring.noise + ring.header_errors + ring.data_errors + ring.cut > 0
    for (by, following), edge in ring.edges.items():
        past = lies_between(mac, by, following) and edge.since > node.last_token and edge.streak >= SKIPPED_ROUNDS
        if not past or any(source == by and other.last > edge.last for (source, _), other in ring.edges.items()):
            continue
        beyond = any(
            source == by and time > node.last_token and (lies_between(address, mac, following) or address == following)
            for (source, address), time in ring.polled.items()
        )
        alive = node.last > edge.since  # heard, while the token goes past it
        polled = sum(source == by and time > node.last_token for (source, _), time in ring.polled.items())
        went_round = edge.streak >= N_POLL * (polled + 2)  # by now it has polled all that it ever polls, this one not
        # else it looked for a successor, and may have lost this one before: under noise that may have gone unheard
        if (alive and went_round) or (not beyond and (went_round or not has_noise)):
            return by, following, edge.streak
    return None


def _unpolled(by: int, following: int, polled: Container[int]) -> str:
    """The addresses between the two that are not polled, as stretches: "42 … 127, 0 … 5"."""
    stretches: list[list[int]] = []
    for step in range(1, (following - by) % (MAX_MASTER + 1) or MAX_MASTER + 1):
        address = (by + step) % (MAX_MASTER + 1)
        if address in polled:
            continue
        if stretches and address == stretches[-1][-1] + 1:
            stretches[-1][1:] = [address]
        else:
            stretches.append([address])
    return ", ".join(" … ".join(map(str, stretch)) for stretch in stretches)
