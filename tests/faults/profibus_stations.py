"""Stations of PROFIBUS that do what others seldom do, rightly: they read along, are slow, or are switched off."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from dissectors.frame import Chunk
from dissectors.profibus.diagnosis import NOT_READY
from dissectors.profibus.simulated_master import Job
from dissectors.profibus.simulated_slave import Slave
from dissectors.profibus.telegram import parse, telegram, token
from dissectors.simulated import Send, Station
from sniff.engine.session import Item
from sniff.simulation.scenarios import Scenario, simulate
from sniff.simulation.tap import TapModel
from tests.faults.buses import MS
from tests.faults.case import Heard
from tests.faults.stations import Wrapped

S = 1_000 * MS
_READ_ALONG = (60, 56, 57, 59)
"""Access points of Slave_Diag, RD_Inp, RD_Outp and Get_Cfg."""


@dataclass(slots=True)
class ReadsAlong(Job):
    """What a master of class 2 asks a slave that belongs to another: diagnosis, inputs, outputs, configuration."""

    asked: int = 0

    def request(self, master: int, now: int, is_clear: bool = False) -> bytes:
        control = 0x4C | (0x20 if self.fcb else 0) | (0 if self.is_first else 0x10)
        return telegram(self.address, master, control, dsap=_READ_ALONG[self.asked % 4], ssap=62)

    def answered(self) -> None:
        Job.answered(self)
        self.asked += 1


class Uneven(Wrapped):
    """A slave that now takes 11 bit times and now nearly its 60."""

    def __init__(self, inner: Station, bit: int) -> None:
        super().__init__(inner)
        self.bit, self.count = bit, 0

    def change(self, now: int, octets: bytes, sends: tuple[Send, ...]) -> tuple[Send, ...]:
        self.count += 1
        return tuple(replace(send, at=now + (11 + self.count * 7 % 46) * self.bit) for send in sends)


@dataclass(slots=True)
class LooksOnce(Job):
    """A slave that a tool's live list looks for once, with the usual repeat."""

    def lost(self, now: int, pause: int) -> None:
        Job.lost(self, now, 1_000_000 * S)


class Off(Wrapped):
    """A station without supply from a time on."""

    def __init__(self, inner: Station, at: int) -> None:
        super().__init__(inner)
        self.at = at

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        return () if now >= self.at else super().hear(now, octets, quiet)

    def wake(self, now: int) -> tuple[Send, ...]:
        return () if now >= self.at else super().wake(now)

    def next_wake(self) -> int | None:
        due = super().next_wake()
        return None if due is None or due >= self.at else due


class NeverReady(Slave):
    """A slave that takes all it is given and waits for something of its own."""

    def _diagnosis(self, asker: int | None, now: int) -> bytes:
        first, *rest = super()._diagnosis(asker, now)
        return bytes((first | NOT_READY, *rest))


class KeepsToken(Wrapped):
    """A master that passes its token to nobody from a time on, and asks on."""

    def __init__(self, inner: Station, at: int) -> None:
        super().__init__(inner)
        self.at = at

    def wake(self, now: int) -> tuple[Send, ...]:
        sends = super().wake(now)
        passed = parse(sends[0].octets) if sends and now >= self.at else None
        if passed is None or not passed.is_token or passed.source is None:
            return sends
        self.inner.hear(now, token(passed.source, passed.source), True)
        return ()


def from_the_middle(plan: Scenario, seconds: float, tap: TapModel) -> Heard:
    """A capture that begins 7 s after the bus did, in the middle of a read."""
    session, items = simulate(plan, seconds + 7, tap)
    return session, _after(items, 7 * S)


def _after(items: Iterator[Item], begin: int) -> Iterator[Item]:
    is_first = True
    for item in items:
        if item.time < begin:
            continue
        if is_first and isinstance(item, Chunk):
            is_first = False
            octets = item.octets[len(item.octets) // 2 :]
            if octets:
                yield Chunk(item.time, octets)
            continue
        yield item
