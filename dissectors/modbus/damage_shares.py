"""Shares of the damage: a sender's own, or the bus's, that falls on whoever sends. Pure.

Damage is counted in strikes (`dissectors.strikes`): what a master repeats into one disturbance is one observation.

Noise that falls anywhere strikes each sender as often as it sends octets. So a sender is blamed only where so great a
part of all damage as it has would seldom come about by its share of the octets, for any of the senders: of many one is
always struck most. The worst one is told first, then the others among themselves.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from dissectors.chances import at_least, is_by_chance
from dissectors.modbus.bus_record import BusRecord


@dataclass(frozen=True, slots=True)
class DamageShare:
    """Senders ("master", "station 3") that have more damage than their share; how much the others have."""

    blamed: frozenset[str]
    common: dict[str, int]


def shares_of_damage(seen: BusRecord) -> DamageShare:
    """Sort all senders into those that are to blame and those that are not.

    Stations are compared with each other, and the master with all: what strikes all answers is no station's fault.
    """
    frames = {
        name: max(0, one.damaged.count - one.explained - seen.ended_oddly(name))
        for name, one in ((f"station {unit}", one) for unit, one in seen.stations.items())
    }
    hits = {sender: seen.strikes.of(sender, count) for sender, count in frames.items()}
    octets = {sender: max(1, seen.octets[sender]) for sender in (*hits, "master")}
    miscounted = seen.miscounted_requests
    own = miscounted.count if miscounted is not None else 0
    frames["master"] = max(0, seen.damaged_requests.count - own - seen.ended_oddly("master"))
    requests = seen.strikes.of("master", frames["master"])
    if len(hits) == 1:
        hits["master"] = requests
    blamed = to_blame(hits, octets)
    hits["master"] = requests
    if requests and "master" not in blamed:
        share = octets["master"] / sum(octets.values())
        if not is_by_chance(requests, sum(hits.values()), share, _any_of(octets, octets)):
            blamed.add("master")
    common = {sender: count for sender, count in frames.items() if count > 0 and sender not in blamed}
    return DamageShare(frozenset(blamed), common)


def to_blame(hits: dict[str, int], octets: dict[str, int]) -> set[str]:
    """Those with more than their share, the worst one first, then the others among themselves."""
    left, blamed = dict(hits), set[str]()
    while len(left) > 1:
        damaged, sent = sum(left.values()), sum(octets[sender] for sender in left)
        chances = {
            sender: at_least(count, damaged, octets[sender] / sent) for sender, count in left.items() if count > 0
        }
        if not chances:
            break
        worst = min(chances, key=lambda sender: chances[sender])
        if is_by_chance(left[worst], damaged, octets[worst] / sent, _any_of(left, octets)):
            break
        blamed.add(worst)
        del left[worst]
    return blamed


def _any_of(senders: Iterable[str], octets: dict[str, int]) -> int:
    """How many of them have sent anything: any of those might have been struck most."""
    return sum(octets[sender] > 1 for sender in senders)
