"""Who talks over answers: a second station with one address, or somebody who talks whoever answers."""

from __future__ import annotations

import pytest

from dissectors.line import LineSettings, Timing
from dissectors.modbus.bus_record import BusRecord
from dissectors.modbus.rules_station import of_station
from dissectors.modbus.station_record import StationRecord
from dissectors.modbus.talked_over import second_voice


def second_voices(*stations: tuple[int, int], excess: int = 4) -> set[int]:
    """Units, from 1 on, that seem to be two; of each how often it was asked, and how many answers were talked over."""
    seen = BusRecord(Timing(LineSettings()))
    for unit, (asked, struck) in enumerate(stations, 1):
        seen.stations[unit] = station = StationRecord(asked=asked, excess=[excess] * struck)
        for no in range(struck):
            station.talked_over.add(no, no)
    return {unit for unit, station in seen.stations.items() if second_voice(seen, unit, station)}


@pytest.mark.parametrize(
    ("stations", "who"),
    [
        (((4, 4), (4, 0)), {1}),
        (((4, 4), (4, 1)), {1}),  # an accident beside it
        (((9, 4), (8, 0), (8, 1), (7, 1)), set()),  # a device that speaks another protocol
        (((24, 7), (19, 4), (17, 2), (18, 4)), set()),
        (((20, 12), (20, 11), (20, 1), (20, 0)), {1, 2}),  # two addresses given twice
        (((20, 14), (20, 2)), {1}),
        (((20, 8), (20, 8), (20, 7)), set()),  # whoever is asked
    ],
)
def test_who_has_a_second_station(stations: tuple[tuple[int, int], ...], who: set[int]) -> None:
    assert second_voices(*stations) == who


@pytest.mark.parametrize(("longer", "is_of_two"), [(2, True), (3, True), (1, False), (0, False)])
def test_damage_with_octets_too_many_is_not_put_down_to_noise_alone(longer: int, is_of_two: bool) -> None:
    seen = BusRecord(Timing(LineSettings()))
    seen.stations[17] = station = StationRecord(asked=91, answered=80, excess=[4] * longer)
    for no in range(3):
        station.damaged.add(no, no)
        if no < longer:
            station.talked_over.add(no, no)
    (told,) = (one for one in of_station(seen, 17, station, None, is_common=False) if one.code == "MB005")
    assert ("two at once" in told.means) is is_of_two
    assert (f"{longer} have more octets" in told.seen) is is_of_two
