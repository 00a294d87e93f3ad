"""The stations that a master is known to ask, and which of them a command with a spoilt address was for."""

from __future__ import annotations

from dissectors.checksums import sum8
from dissectors.frame import Check
from dissectors.n2.envelope import judge

_SHORTEST = 7  # octets of a command with its checksum: > A A C K K CR


class KnownStations:
    """Addresses by their sum and by each of their two characters, so that a look-up asks few of them."""

    __slots__ = ("_by_character", "_by_sum", "_known")

    def __init__(self) -> None:
        self._known: set[int] = set()
        self._by_sum: dict[int, list[int]] = {}
        self._by_character: dict[tuple[int, int], list[int]] = {}

    def __contains__(self, station: int) -> bool:
        return station in self._known

    def __len__(self) -> int:
        return len(self._known)

    def add(self, station: int) -> None:
        """Take a station that a good command named, 0 … 255."""
        if station in self._known:
            return
        self._known.add(station)
        name = b"%02X" % station
        self._by_sum.setdefault(sum8(name), []).append(station)
        for place in (0, 1):
            self._by_character.setdefault((place, name[place]), []).append(station)

    def most_like(self, octets: bytes) -> int | None:
        """The one station whose address in a damaged command makes its checksum right, the most alike of several; else
        the one that has a character in common with what was sent; None where none or several do."""
        if len(self._known) == 1:
            return next(iter(self._known))
        sent = octets[1:3]
        fitting = self._fitting(octets)
        if fitting:
            alike = [sum(one == other for one, other in zip(b"%02X" % s, sent, strict=False)) for s in fitting]
            return fitting[alike.index(max(alike))] if alike.count(max(alike)) == 1 else None
        near = [station for at, octet in enumerate(sent) for station in self._by_character.get((at, octet), ())]
        return near[0] if len(near) == 1 else None

    def _fitting(self, octets: bytes) -> list[int]:
        """Stations whose address makes the checksum right."""
        if len(octets) < _SHORTEST or not octets.endswith(b"\r"):
            return []
        try:
            due = (int(octets[-3:-1], 16) - sum8(octets[3:-3])) & 0xFF
        except ValueError:
            return []
        able = self._by_sum.get(due, [])
        return able if able and judge(b">%02X" % able[0] + octets[3:]) == (Check.GOOD, None) else []
