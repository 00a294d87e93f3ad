"""Telegrams under other names: addresses renumbered, those in a diagnosis and in Set_Slave_Add too; ident numbers and
values are kept."""

from __future__ import annotations

from dissectors.frame import Frame
from dissectors.profibus.diagnosis import STANDARD
from dissectors.profibus.services import Service, service_of
from dissectors.profibus.telegram import BROADCAST, FIXED, SC, SD2, SD4, Telegram, parse
from dissectors.pseudonyms import Pseudonyms, inflicted

_MASTER = 3
"""Place in a diagnosis of the master that has parameterised the slave."""


class ProfibusRenamer:
    """Renames telegrams; each keeps its length, and its damage if it has one."""

    def __init__(self) -> None:
        self.stations = Pseudonyms(range(1, 127), kept=(BROADCAST,))

    def __call__(self, frame: Frame) -> bytes:
        """The frame under another name."""
        if frame.repair is None:
            return self._renamed(frame.octets, frame.ok)
        whole = frame.repair.octets
        return inflicted(frame.octets, whole, self._renamed(whole, sure=False))

    def _renamed(self, octets: bytes, sure: bool) -> bytes:
        """`sure`: every address in it is somebody's. The sum is moved by as much as the addresses are."""
        at, renamed = 4 if octets[0] == SD2 else 1, bytearray(octets)
        if octets[0] == SC:
            return octets
        name = self.stations.of if sure else self.stations.of_doubtful
        for place in range(at, min(at + 2, len(octets))):
            renamed[place] = renamed[place] & 0x80 | name(renamed[place] & 0x7F)
        if len(octets) < at + 2:
            return bytes(renamed)
        telegram = parse(octets)
        told = _address_in(telegram)
        if told is not None:
            place = at + 3 + telegram.extended + told
            renamed[place] = name(renamed[place])
        size = octets[1] + 6 if octets[0] == SD2 else FIXED.get(octets[0], 0)
        if octets[0] != SD4 and len(octets) == size:
            renamed[-2] = renamed[-2] + sum(renamed[at:-2]) - sum(octets[at:-2]) & 0xFF
        return bytes(renamed)


def _address_in(telegram: Telegram) -> int | None:
    """Where in the data of a telegram a station's address stands."""
    service, data = service_of(telegram), telegram.data
    if service is Service.DIAGNOSIS and not telegram.is_request and len(data) >= STANDARD:
        return _MASTER
    return 0 if service is Service.SET_ADDRESS and telegram.is_request and data else None
