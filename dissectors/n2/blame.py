"""Blame for damage: one sender's where it has far more than its share of the time on the line, else the bus's."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from dissectors.chances import at_least
from dissectors.findings import Tally, together
from dissectors.n2.record import Damages
from dissectors.strikes import Strikes

OUTSTANDING: Final = 4
"""So many times the damage that noise at the rate of all others would have done make it a sender's own."""

UNLIKELY: Final = 0.01
"""Chance below which it is no chance that noise struck any one sender so often."""

SELDOM_ALONE: Final = 0.05
"""Chance below which it is no chance that all strikes fell on one sender, whichever it is."""


def blamed(senders: Mapping[str, Damages], strikes: Strikes) -> dict[str, Tally]:
    """Subject → damaged frames. Noise falls on each sender as long as it sends; who has several times more than that
    is named, and so is the only one that has any, where chance would seldom have struck it alone. What is left is the
    bus's."""
    left = {name: sent for name, sent in senders.items() if sent.octets}
    named: dict[str, Tally] = {}
    while worst := _outstanding(left, strikes):
        named[worst] = left.pop(worst).bad
    struck = {name: sent.bad for name, sent in left.items() if sent.bad.count}
    if len(struck) == 1:
        ((name, _),) = struck.items()
        octets = sum(sent.octets for sent in left.values())  # who is named already has no part in what is left
        chance = (left[name].octets / octets) ** strikes.of(name, left[name].bad.count)
        if chance * len(left) <= SELDOM_ALONE:  # any of them might have been struck alone
            return named | struck
    return named | ({"bus": together(struck.values())} if struck else {})


def _outstanding(senders: Mapping[str, Damages], strikes: Strikes) -> str | None:
    """The sender with the most damage beyond what the others' rate explains, where that cannot be chance."""
    struck = {name: strikes.of(name, one.bad.count) for name, one in senders.items()}
    bad, octets = sum(struck.values()), sum(one.octets for one in senders.values())
    worst: tuple[float, str] | None = None
    for name, sent in senders.items():
        mine, rest = struck[name], octets - sent.octets
        if mine < 3 or not rest:
            continue
        due = (bad - mine + 0.5) / rest * sent.octets
        chance = at_least(mine, bad, sent.octets / octets)
        if mine > OUTSTANDING * due and chance * len(senders) < UNLIKELY:  # any of them might have been struck most
            worst = max(worst or (0.0, ""), (mine / due, name))
    return worst[1] if worst is not None else None
