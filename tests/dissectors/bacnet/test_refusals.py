"""Error answers: of one station, or of each one that is asked."""

from __future__ import annotations

from dissectors.bacnet.findings_of_refusals import refusals
from dissectors.findings import Severity, Tally

UNKNOWN = "property unknown-property"


def found(asked: dict[int, int], refused: dict[int, int], words: str = UNKNOWN) -> list[tuple[str, Severity, int]]:
    tallies = {}
    for mac, count in refused.items():
        tally = tallies[mac, "read-property", words] = Tally()
        for no in range(count):
            tally.add(mac * 1000 + no, no)
    requests = {(mac, "read-property"): count for mac, count in asked.items()}
    return [(one.subject, one.severity, one.count) for one in refusals(requests, tallies)]


def test_what_no_station_has_is_looked_for_and_nobodys_fault():
    assert found({3: 8, 7: 8, 12: 8}, {3: 4, 7: 4, 12: 3}) == [("bus", Severity.NOTE, 11)]


def test_what_one_station_has_not_is_said_of_it():
    assert found({3: 8, 7: 8}, {7: 4}) == [("MAC 7", Severity.WARNING, 4)]
    assert found({7: 8}, {7: 4}) == [("MAC 7", Severity.WARNING, 4)]


def test_an_error_that_is_no_matter_of_what_there_is_stays_each_stations_own():
    busy = "device operational-problem"
    both = found({3: 8, 7: 8}, {3: 2, 7: 2}, busy)
    assert both == [("MAC 3", Severity.WARNING, 2), ("MAC 7", Severity.WARNING, 2)]
