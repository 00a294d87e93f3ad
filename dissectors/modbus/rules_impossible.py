"""Requests that nobody can carry out, in words: the master's mistake, or a maker's own protocol. Pure."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from dissectors.findings import Finding, Severity, counted, times
from dissectors.modbus.bus_record import BusRecord
from dissectors.modbus.impossible import all_of
from dissectors.modbus.rules import RULES
from dissectors.modbus.station_record import StationRecord

_OWN: Final = (
    "a maker's own protocol in frames of Modbus, as some drives have it: function, address and count are not what they "
    "say in Modbus"
)
_OWN_NEXT: Final = "the maker's manual; whether the master is meant to speak so. What is shown here as values is none"


def of_impossible(seen: BusRecord) -> Iterator[Finding]:
    """One finding of the master; a note of each station that answers such requests in kind."""
    own = {unit: one for unit, one in seen.stations.items() if one.has_own_protocol}
    every = all_of(one.impossible for unit, one in seen.stations.items() if unit not in own)
    if every.tally.count:
        why, _ = every.words.most_common(1)[0] if every.words else ("", 0)
        words = f"{counted(every.tally.count, 'request')} that cannot be carried out: {why}"
        refused = sum(every.codes.values())
        words += f"; refused {times(refused)}, rightly" if refused else ""
        words += f"; not answered {times(every.unanswered)}" if every.unanswered else ""
        words += f"; answered {times(every.in_kind.count)} by what does not fit" if every.in_kind.count else ""
        yield every.tally.found(RULES["MB016"], "master", words)
    for unit, station in sorted(own.items()):
        yield _own_protocol(f"station {unit}", station)


def _own_protocol(name: str, station: StationRecord) -> Finding:
    in_kind = station.impossible.in_kind
    words = f"{counted(in_kind.count, 'request')} that contradict themselves, answered each time by what does the same"
    return replace(in_kind.found(RULES["MB016"], name, words, Severity.NOTE), means=_OWN, next=_OWN_NEXT)
