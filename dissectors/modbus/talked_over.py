"""Answers that somebody talks over: a second station with their address, or somebody who talks whoever answers. Pure.

A second station answers where the first one does, so its own address is struck and no other. Somebody who hears nobody
(a device with another protocol, a master that does not listen) strikes each station as often as it is asked.
"""

from __future__ import annotations

from collections.abc import Sequence

from dissectors.findings import Finding, counted
from dissectors.modbus.bus_record import BusRecord
from dissectors.modbus.damage_shares import to_blame
from dissectors.modbus.rules import RULES
from dissectors.modbus.station_record import StationRecord, middle

_OTHERS = 2
"""Answers of others that are talked over, from which on somebody talks whoever answers: one is an accident."""

_EXCESS_SPREAD = 2  # octets


def second_voice(seen: BusRecord, unit: int, station: StationRecord) -> Finding | None:
    """What is found where a second station with this address talks."""
    if not _is_often(station) or _strikes_all(seen, unit, station):
        return None
    over = station.talked_over
    words = (
        f"{over.count} of {counted(station.asked, 'answer')} begin as they should and go on for "
        f"{counted(middle(station.excess), 'octet')} more than they can have, damaged: two talk at once"
    )
    return over.found(RULES["MB202"], f"station {unit}", words)


def _is_often(station: StationRecord) -> bool:
    """Whether enough of its answers are talked over, in one and the same way."""
    over = station.talked_over
    return over.count >= 3 and 4 * over.count >= station.asked and _is_steady(station.excess)


def _is_steady(values: Sequence[int]) -> bool:
    """Whether most of them lie close together, as they do when two always begin a little apart."""
    usual = middle(values) if values else 0
    return 3 * sum(abs(value - usual) <= _EXCESS_SPREAD for value in values) >= 2 * len(values) > 0


def _strikes_all(seen: BusRecord, unit: int, station: StationRecord) -> bool:
    """Whether others' answers are talked over, too, and this one's no more often than chance has it. Several addresses
    may be given twice: those struck as often are left aside, as long as somebody is left."""
    others = {other: one for other, one in seen.stations.items() if other != unit and one.asked}
    if sum(one.talked_over.count for one in others.values()) < _OTHERS:
        return False
    compared = {other: one for other, one in others.items() if not _is_often(one)}
    if not compared:
        return True
    compared[unit] = station
    struck = {str(other): one.talked_over.count for other, one in compared.items()}
    return str(unit) not in to_blame(struck, {str(other): one.asked for other, one in compared.items()})
