"""Shares of trouble: whether one sender is struck more often than its share of the line explains. Pure.

Noise that falls anywhere strikes everybody by the share of the time that he sends; only who is struck clearly more
often than the others is a case of its own. The rest is the bus's. A station is compared with other stations: what all
of them have and the master has not is common to them.
"""

from __future__ import annotations

from collections.abc import Mapping

from dissectors.chances import at_least

UNLIKELY = 1e-3
"""Chance below which a share is no chance: that any of those compared is struck so often by what falls anywhere."""

CLEARLY = 2.5
"""Times the rate of all others."""


SELDOM_ALONE = 0.05
"""The same where nobody else is struck, which speaks for itself."""


Struck = Mapping[str, tuple[int, float]]
"""For each sender how often he was struck, and his share: octets, frames … sent."""


def standing_out(struck: Struck, master: str = "") -> set[str]:
    """Who is struck more often than by chance. `master`: who is no station; it is compared with all of them."""
    stations = {name: pair for name, pair in struck.items() if name != master}
    if not 1 < len(stations) < len(struck):
        return _standing_out(struck)
    out = _standing_out(stations)
    counts = [sum(pair[at] for pair in stations.values()) for at in (0, 1)]
    all_of_them = {"": (int(counts[0]), counts[1]), master: struck[master]}
    return out | (_standing_out(all_of_them) & {master})


def only_struck(struck: Struck) -> set[str]:
    """The only one that is struck, where chance would seldom have struck one alone, whoever it is; else nobody."""
    shares = sum(share for _, share in struck.values())
    hit = [(name, count, share) for name, (count, share) in struck.items() if count]
    if len(hit) != 1 or not shares:
        return set()
    ((name, count, share),) = hit
    return {name} if len(struck) * (share / shares) ** count <= SELDOM_ALONE else set()


def _standing_out(struck: Struck) -> set[str]:
    out: set[str] = set()
    left = {name: pair for name, pair in struck.items() if pair[1] > 0}
    while len(left) > 1:
        name = max(left, key=lambda one: left[one][0] / left[one][1])
        count, share = left.pop(name)
        others = sum(pair[0] for pair in left.values())
        shares = sum(pair[1] for pair in left.values())
        is_clear = count * shares >= CLEARLY * others * share
        if not count or not is_clear:
            break
        chance = at_least(count, count + others, share / (share + shares))
        if chance * (len(left) + 1 if others else 1) > UNLIKELY:  # any of those struck might have been struck most
            break
        out.add(name)
    return out
