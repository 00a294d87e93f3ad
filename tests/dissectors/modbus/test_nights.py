"""What was a fault of a quarter of an hour is told as one, whatever it is, in a night of 39 000 requests."""

from __future__ import annotations

from random import Random

import pytest

from dissectors.findings import Severity, Tally
from dissectors.line import LineSettings, Timing
from dissectors.modbus.bus_record import BusRecord
from dissectors.modbus.rules_bus import judge
from dissectors.modbus.station_record import StationRecord

S = 1_000_000_000
NIGHT = 13 * 3600 * S


def night(what: str, times: list[int]) -> BusRecord:
    """A night in which that befell one station of two, or its requests."""
    seen = BusRecord(Timing(LineSettings.parse("9600,8N1")), first=0, now=NIGHT, requests=78_000, answers=78_000)
    seen.stations = {unit: StationRecord(asked=39_000, answered=39_000) for unit in (1, 2)}
    seen.octets.update({"master": 624_000, "station 1": 624_000, "station 2": 624_000})
    tally = Tally()
    for time in times:
        tally.add(time)
    first = seen.stations[1]
    match what:
        case "MB009":
            seen.damaged_requests = tally
            for _ in times:
                seen.strikes.struck("master")
                seen.strikes.whole()
        case "MB022":
            seen.damaged_here = tally
        case "MB103":
            first.late = tally
        case "MB008":
            first.request(("read-holding-registers", 0)).tries = 39_000
            first.exceptions = {(("read-holding-registers", 0), 4): tally}
        case "MB020":
            first.missing = first.unheard = tally
            first.request(("read-holding-registers", 0)).turns = 39_000
    return seen


@pytest.mark.parametrize("code", ["MB008", "MB009", "MB020", "MB022", "MB103"])
def test_a_fault_of_a_quarter_of_an_hour_is_told(code):
    within = night(code, [33_000 * S + 3 * S * number for number in range(200)])
    dice = Random(code)
    anywhere = night(code, sorted(dice.randrange(NIGHT) for _ in range(200)))
    told, rare = (next(one for one in judge(seen, None) if one.code == code) for seen in (within, anywhere))
    assert told.severity >= Severity.WARNING
    assert "within a quarter of an hour" in told.seen
    assert "within a quarter of an hour" not in rare.seen
    assert rare.severity is Severity.NOTE or code == "MB008"  # what is refused is refused, however seldom
