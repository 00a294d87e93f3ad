"""Whether noise that falls on any octet of a sender's frames falls on the same one of them so often now and then. Pure.

Of a frame of eight octets one damage in eight is the last octet's, of whoever sends: three of six damaged answers that
are right but for it are no habit of the station, where noise is on the line.
"""

from __future__ import annotations

from dissectors.chances import is_by_chance
from dissectors.modbus.bus_record import BusRecord


def falls_there_by_chance(seen: BusRecord, sender: str, count: int, damaged: int) -> bool:
    """Whether `count` of so many damaged frames of a sender ("master", "station 3") may have the same octet wrong
    without a cause of their own, for any of the senders."""
    frames, octets = seen.frames[sender], seen.octets[sender]
    if not 0 < frames < octets:
        return False  # nothing is known of their length
    return is_by_chance(count, damaged, frames / octets, sum(sent > 0 for sent in seen.octets.values()))
