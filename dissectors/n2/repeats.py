"""Answers that come again, of every station: what gives them back is the bus, not the stations."""

from __future__ import annotations

from collections.abc import Collection
from typing import Final

from dissectors.findings import Finding, counted, together
from dissectors.n2.record import N2StationRecord
from dissectors.n2.rules import RULES

_STATIONS_LEAST: Final = 2
_ANSWERS_LEAST: Final = 3


def is_repeated_by_all(stations: Collection[N2StationRecord]) -> bool:
    """Whether half of the answers of each station that is heard, and of several, come again."""
    heard = [one for one in stations if one.answered]
    return (
        len(heard) >= _STATIONS_LEAST
        and all(2 * one.repeated.count >= one.answered for one in heard)
        and sum(one.repeated.count for one in heard) >= _ANSWERS_LEAST * len(heard)
    )


def repeats_of_all(stations: Collection[N2StationRecord]) -> Finding:
    """One finding for all of them."""
    tally = together([one.repeated for one in stations])
    answered = sum(one.answered for one in stations)
    seen = f"the same answer came again to {tally.count} of {counted(answered, 'command')}, of each station alike"
    return tally.found(RULES["N2013"], "bus", seen)
