"""Metasys N2 stations that do one thing wrong, and profile faults in each protocol. Data."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

from dissectors.bacnet.application import Application, Poller
from dissectors.frame import Place
from dissectors.line import LineSettings
from dissectors.modbus.simulated_master import read_holding
from dissectors.n2.simulated import reading
from dissectors.simulated import Station
from dissectors.simulated_faults import BitFlips, LateResponse, LostResponse, NoiseInGaps
from sniff.simulation.tap import FTDI
from tests.faults.buses import n2
from tests.faults.case import Case, Said
from tests.faults.hearing import of_party, sent_otherwise
from tests.faults.misbehaving import OnTheTick, Trimmed, When
from tests.faults.ring_programs import controller, drive, fault_input
from tests.faults.stations import Dies, Of, Shows
from tests.faults.workbench import N2, Member, Modbus, Ring, by_turns, follower

MS, S = 1_000_000, 1_000_000_000

_turns = partial(by_turns, 1, 2)
_followers = {"drive 1": partial(follower, 1, 10 * MS), "drive 2": partial(follower, 2, 18 * MS)}
_few = {"drive 1": partial(follower, 1, 10 * MS, few=True), "drive 2": partial(follower, 2, 60 * MS, few=True)}
_others_values = {(1, number): 50.0 + number for number in (1, 2, 3, 4, 6)}
_LAST = r"\blast\b|too early|too soon|\bends?\b.*missing|lets go|cut (off|short)|carriage return|\bCR\b"
_LATE = r"\blate|after (the|its|another|it was) |next (turn|command)|nobody asked|gave up"
_TWO = r"two (stations|devices|drives)|second (station|device)|same (address|number)|answered twice"


def _is_short(octets: bytes) -> bool:
    """An answer that ends before that of the next drive begins."""
    return len(octets) < 30


def _status_by_turns() -> list[Any]:
    """Readings of the binary inputs of both drives, the status among them."""
    return [reading(address, 2, number) for number in (1, 2, 3) for address in (1, 2)]


def _twin(delay: int, *, seed: int) -> Station:
    """A second drive with number 2, whose measured values are others."""
    return follower(2, delay, values=_others_values, few=True)


def _e510(unit: int, is_ascii: bool, fault: int) -> Station:
    from dissectors.modbus.simulated_e510 import SimulatedE510

    made = SimulatedE510(unit, is_ascii=is_ascii, delay=6 * MS)
    made.drive.fault = fault
    return made


def _fault_drive(unit: int) -> Station:
    return _e510(unit, True, 17)


def _drive_asked(unit: int) -> tuple[bytes, ...]:
    return read_holding(unit, 0x2520, 4), read_holding(unit, 0x2524, 1)


def _faulted(mac: int) -> Application:
    return fault_input(drive(mac))


def _bit_reader() -> Application:
    return Poller([(mac, "binary-input,2", "present-value") for mac in (5, 9)])


_by_the_clock = N2(
    _turns, _few, change_master=partial(OnTheTick, tick=180 * MS), pause=20 * MS, timeout=120 * MS, retries=0
)

N2_CASES: tuple[Case, ...] = (
    # times that an adapter hides prove no answer that is too soon: that all pauses are longer does
    Case(
        "N2 two masters, FTDI",
        partial(n2, second_master=True),
        (("N2007", "bus"),),
        FTDI,
        struck=("station 1", "station 2"),
        also=("N2008",),
        seeds=1,
    ),
    # a master that goes on as after an answer, since it never waits for one
    Case(
        "N2 station dies, master by the clock",
        replace(_by_the_clock, followers={**_few, "drive 2": lambda: Dies(follower(2, 60 * MS, few=True), at=30 * S)}),
        (("N2005", "station 2"),),
        never=("N2015",),
        seeds=1,
    ),
    Case(
        "N2 answers lost, master by the clock",
        replace(_by_the_clock, faults=(LostResponse(0.08, ("drive 2",)),)),
        (("N2005", "station 2"),),
        never=("N2015",),
        seeds=2,
    ),
    Case(
        "N2 late answers into the next turn",
        N2(
            _turns,
            _few,
            (When(_is_short, LateResponse(0.15, 258 * MS, ("drive 1",))),),
            pause=150 * MS,
            retries=0,
        ),
        (Said(("station 1", "bus"), ("N2011",), _LATE),),
        never=("N2008", "N2005"),  # answered late is not lost
        seconds=120,
    ),
    Case(
        "N2 late answers into the next turn, FTDI",
        N2(
            _turns,
            _few,
            (When(_is_short, LateResponse(0.15, 258 * MS, ("drive 1",))),),
            pause=150 * MS,
            retries=0,
        ),
        (Said(("station 1", "bus"), ("N2011",), _LATE),),
        FTDI,
        never=("N2008", "N2005"),  # answered late is not lost
        seconds=120,
    ),
    Case(
        "N2 two drives with one address, other values",
        N2(_turns, _few, others={"twin": partial(_twin, 180 * MS)}, pause=300 * MS),
        (Said(("station 2",), ("N2008",), _TWO),),
        also=("N2008",),
        seeds=1,
    ),
    Case(
        "N2 junk before the answers of one",
        N2(_turns, _followers, (Of("drive 2", NoiseInGaps(0.3, places=(Place.BEFORE,))),)),
        (("LN201", "station 2"),),
    ),
    Case(
        "N2 junk before the answers of one, FTDI",
        N2(_turns, _followers, (Of("drive 2", NoiseInGaps(0.3, places=(Place.BEFORE,))),)),
        (Said(("station 2",), ("LN201",), r"stray|before"),),
        FTDI,
    ),
    Case(
        "N2 last character of one lost",
        N2(_turns, _followers, (Trimmed("drive 2", last=1, rate=0.3),)),
        (Said(("station 2",), ("N2004",), _LAST),),
    ),
    Case(
        "N2 first character of one lost",
        N2(_turns, _followers, (Trimmed("drive 2", first=1, rate=0.3),)),
        (Said(("station 2",), ("N2004",), r"\bfirst\b|too late|begin"),),
    ),
    Case(
        "N2 bit errors of the supervisor",
        N2(_turns, _followers, (BitFlips(6e-3, ("supervisor",)),)),
        (Said(("master", "bus"), ("N2004",), r"damag"),),
    ),
    Case(
        "N2 one drive at half the baud rate",
        N2(_turns, _followers),
        (("LN204", "station 2"), ("N2005", "station 2")),
        hear=partial(sent_otherwise, partial(of_party, "drive 2", LineSettings(4800, 8, "N", 1))),
        seeds=1,
    ),
    # what a device says of itself, in each protocol
    Case(
        "N2 drive reports a fault",
        N2(
            _status_by_turns,
            {"drive 1": partial(follower, 1), "drive 2": partial(follower, 2, 18 * MS, values={(2, 3): 1.0})},
            devices={1: "teco-f510", 2: "teco-f510"},
        ),
        (Said(("drive 2", "station 2"), ("PR004", "PR005")),),
        also=("PR004",),
        seeds=1,
    ),
    Case(
        "MS/TP drive reports a fault",
        Ring(
            (
                Member(1, _bit_reader),
                Member(2, partial(controller, 5)),
                Member(5, partial(drive, 5)),
                Member(9, partial(_faulted, 9)),
            ),
            devices={5: "teco-f510", 9: "teco-f510"},
        ),
        (Said(("drive 9", "MAC 9"), ("PR004", "PR005")),),
        also=("PR004",),
        seconds=20,
        seeds=1,
    ),
    Case(
        "ASCII drive reports a fault",
        Modbus(
            (*_drive_asked(1), *_drive_asked(2)),
            {1: partial(_e510, 1, True, 0), 2: partial(_fault_drive, 2)},
            is_ascii=True,
            devices={1: "teco-e510", 2: "teco-e510"},
        ),
        (Said(("drive 2", "station 2"), ("PR004", "PR005")),),
        also=("PR004",),
        seeds=1,
    ),
    Case(
        "RTU drive shows a fault bit only",
        Modbus(
            (*_drive_asked(1), read_holding(2, 0x2520, 1), read_holding(2, 0x2524, 1)),
            {1: partial(_e510, 1, False, 0), 2: partial(_e510, 2, False, 0)},
            change={2: partial(Shows, values={0x2520: 0x0008})},
            devices={1: "teco-e510", 2: "teco-e510"},
        ),
        (Said(("drive 2", "station 2"), ("PR004", "PR005")),),
        also=("PR004",),
        seeds=1,
    ),
)
