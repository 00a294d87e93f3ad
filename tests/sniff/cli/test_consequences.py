"""What one rule says of several stations under one cause is told once, and of nobody else."""

from __future__ import annotations

from dissectors.findings import Finding, Rule, Severity, found
from dissectors.subject import BUS, Subject, station
from sniff.cli.consequences import folded


def of(who: Subject, code: str = "XX005", count: int = 1) -> Finding:
    return found(Rule(code, Severity.NOTE, "", "", "", ""), who, "damaged", first=0, last=0, count=count)


def test_stations_of_one_rule_are_one_line() -> None:
    given = [
        of(BUS),
        *(of(station(at), count=at) for at in (2, 9, 4)),
        of(station(2), "XX104"),
        of(station(9), "XX104"),
    ]
    told = [(who, one.count) for who, one in folded(given)]
    assert told == [("bus", 1), ("3 stations (2, 4, 9)", 9), ("station 2", 1), ("station 9", 1)]


def test_things_in_a_station_and_other_nouns_stand_for_themselves() -> None:
    given = [of(station(1, part=f"AI {at}")) for at in range(4)] + [
        of(station(1)),
        of(station(2)),
        of(station(3, "MAC")),
    ]
    assert [who for who, _ in folded(given)] == [one.subject for one in given]


def test_of_many_stations_some_are_named() -> None:
    ((who, _),) = folded([of(station(at, "MAC")) for at in range(100)])
    assert who.startswith("100 MAC (0, 1, ")
    assert who.endswith("15 …)")
