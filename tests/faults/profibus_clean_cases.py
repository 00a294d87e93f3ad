"""PROFIBUS buses on which nothing is wrong, though they are slow, read along with, or heard from the middle on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

from dissectors.profibus.f510 import drive
from dissectors.profibus.simulated_master import Master, RingBehaviour
from dissectors.profibus.simulated_slave import Slave
from dissectors.simulated import Station
from sniff.simulation.tap import CH340, EXACT, FTDI, FTDI_LOW_LATENCY, OCTETS, UART
from tests.faults.case import Case
from tests.faults.hearing import busy_host, hidden_latency
from tests.faults.profibus_cases import LINE, RING, profibus
from tests.faults.profibus_stations import LooksOnce, ReadsAlong, Uneven, from_the_middle

_TOOL = RingBehaviour(cycle=60_000_000, is_class_1=False)
_SYNC, _FREEZE, _UNSYNC, _UNFREEZE = 0x20, 0x08, 0x10, 0x04


def tool() -> Station:
    """A master of class 2 in the ring, which reads along at drive 5 and at the valve."""
    return Master(3, LINE, [ReadsAlong(5), ReadsAlong(12)], others=(1, 2), ring=_TOOL)


def live_list() -> Station:
    """A master of class 2 that looks for slaves at twenty addresses, from 4 s on, where none is."""
    return Master(3, LINE, [LooksOnce(address, due=4_000_000_000) for address in range(13, 33)], (1, 2), _TOOL)


def _uneven(station: Station) -> Station:
    return Uneven(Slave(6, LINE, process=drive), LINE.bits(1))


CLEAN = {
    "read along": partial(profibus, also={"tool": tool}, others=(3,)),
    "a live list": partial(profibus, also={"tool": live_list}, others=(3,)),
    "slow slave": partial(profibus, slave=partial(Slave, 6, LINE, process=drive, tsdr=59)),
    "uneven slave": partial(profibus, change={"drive 6": _uneven}),
    "sync and freeze": partial(
        profibus,
        ring=replace(RING, commands=((_SYNC, 0), (_FREEZE, 2), (_SYNC | _FREEZE, 0), (_UNSYNC | _UNFREEZE, 0))),
    ),
    "a wide GAP": partial(profibus, ring=replace(RING, highest=126, gap_every=1)),
}
"""How each bus is made."""


def profibus_clean_cases(seconds: float) -> Iterator[Case]:
    """Each bus with exact times and behind an adapter of 16 ms; the plain one heard badly, too."""
    for name, make in CLEAN.items():
        for tap in (EXACT, FTDI):
            yield Case(f"PROFIBUS clean, {name}, {tap.name}", make, (), tap, seconds)
    for tap in (EXACT, FTDI, OCTETS, FTDI_LOW_LATENCY, UART, CH340):
        yield Case(f"PROFIBUS clean, from the middle on, {tap.name}", profibus, (), tap, seconds, from_the_middle)
        yield Case(f"PROFIBUS clean, busy host, {tap.name}", profibus, (), tap, seconds, busy_host)
    for tap in (FTDI, FTDI_LOW_LATENCY, CH340):
        yield Case(f"PROFIBUS clean, hidden latency, {tap.name}", profibus, (), tap, seconds, hidden_latency)
