"""Stations whose response times vary: evenly, or in two groups."""

from __future__ import annotations

from dataclasses import replace
from random import Random

from dissectors.modbus.envelope import seal_ascii, seal_rtu, unseal
from dissectors.simulated import Send, Station
from tests.faults.stations import Wrapped


class Waits(Wrapped):
    """Answers later by up to `spread` ns, evenly; or, with `groups`, either at once or after all of it."""

    def __init__(self, inner: Station, spread: int, groups: bool = False, share: float = 0.4) -> None:
        super().__init__(inner)
        self.spread, self.groups, self.share = spread, groups, share
        self.dice = Random(spread)

    def change(self, now: int, octets: bytes, sends: tuple[Send, ...]) -> tuple[Send, ...]:
        draw = self.dice.random()
        more = self.spread * (draw < self.share) if self.groups else int(self.spread * draw)
        return tuple(replace(send, at=send.at + more) for send in sends)


class TakesTurns(Wrapped):
    """Two devices with one address, of which each misses some requests; the other one answers `later` and `value`."""

    def __init__(self, inner: Station, later: int, value: int, is_ascii: bool = False) -> None:
        super().__init__(inner)
        self.later, self.value, self.is_ascii = later, value, is_ascii
        self.dice = Random(later)

    def change(self, now: int, octets: bytes, sends: tuple[Send, ...]) -> tuple[Send, ...]:
        if self.dice.random() < 0.6:
            return sends
        return tuple(replace(send, at=send.at + self.later, octets=self._other(send.octets)) for send in sends)

    def _other(self, octets: bytes) -> bytes:
        answer = unseal(octets, self.is_ascii)
        if answer is None or answer[1] != 3 or len(answer) < 5:
            return octets
        seal = seal_ascii if self.is_ascii else seal_rtu
        return seal(answer[:3] + self.value.to_bytes(2, "big") + answer[5:])
