"""Cases of the matrix: a station that answers when its master has given up, into what others send. Whoever is hit is
innocent: only the late one may be named."""

from __future__ import annotations

from functools import partial

from dissectors.line import LineSettings
from dissectors.modbus.simulated_master import read_holding
from dissectors.simulated_faults import LateResponse
from sniff.simulation.tap import CH340, FTDI, UART, TapModel
from tests.faults.case import Case, Said
from tests.faults.workbench import N2, Modbus, by_turns, follower, usual_requests, usual_stations

MS = 1_000_000

_FOUR = (1, 2, 3, 4)
_late = (Said(("station 2",), ("MB106", "N2014")),)
_impatient = (Said(("master",), ("MB107", "N2017")),)
_late_or_unasked = (Said(("station 2",), ("N2014", "N2011")),)


def _bus(delay: int, *, quantity: int = 24, retries: int = 1, pause: int = 25, is_ascii: bool = False) -> Modbus:
    """Station 2 answers after `delay` ms; the master waits 200 ms."""
    return Modbus(
        (*usual_requests(_FOUR, quantity), *usual_requests((1, 3, 4), 4)),
        usual_stations(_FOUR, is_ascii=is_ascii, unit_2=delay * MS),
        retries=retries,
        pause=pause * MS,
        is_ascii=is_ascii,
    )


def _n2(delay: int, pause: int) -> N2:
    """Drive 2 answers after `delay` ms; the master waits 200 ms."""
    return N2(
        partial(by_turns, 1, 2, 3, 4, count=2),
        {
            f"drive {unit}": partial(follower, unit, (delay if unit == 2 else 10 + unit) * MS, few=True)
            for unit in (1, 2, 3, 4)
        },
        pause=pause * MS,
        timeout=200 * MS,
    )


def _case(name: str, bus: Modbus | N2, tap: TapModel | None = None) -> Case:
    made = partial(Case, name, bus, _late, seeds=1, struck=("bus",))
    return made() if tap is None else made(tap=tap)


def _short_case(name: str, bus: Modbus | N2) -> Case:
    """Too little damage to prove whose doing it is: nobody is named for it, only who does not answer in time."""
    expect = (Said(("bus",), ("MB106", "N2014")),)
    return Case(name, bus, expect, seconds=8, seeds=1, struck=("station 2",))


_SELDOM = Modbus(
    tuple(read_holding(unit, start, 1) for unit in (40, 80, 126) for start in (0, 3)),
    usual_stations((40, 80, 126), unit_40=12 * MS, unit_80=8 * MS, unit_126=30 * MS),
    (LateResponse(0.06, 318 * MS, ("unit 80",)),),
    line=LineSettings.parse("9600,8N2"),
    timeout=317 * MS,
    retries=0,
    pause=10 * MS,
)
"""Most of what is sent comes within three times the master's patience of one of so many late answers."""

_ALL = Modbus(
    (*usual_requests(_FOUR, 24), *usual_requests((1, 3, 4), 4)),
    usual_stations(_FOUR),
    (LateResponse(0.08, 200 * MS, tuple(f"unit {unit}" for unit in _FOUR)),),
)
"""Every station is late now and then: it is the master that does not wait."""

_ALL_OF_N2 = N2(
    partial(by_turns, 1, 2, 3, 4, count=2),
    {f"drive {unit}": partial(follower, unit, (10 + unit) * MS, few=True) for unit in _FOUR},
    pause=15 * MS,
    timeout=200 * MS,
    faults=(LateResponse(0.2, 195 * MS, tuple(f"drive {unit}" for unit in _FOUR)),),
)

_BESIDE_DEAD = N2(
    partial(by_turns, 40, 5, 80, count=2),
    {"drive 40": partial(follower, 40, 18 * MS), "drive 5": partial(follower, 5, 4 * MS)},
    timeout=1000 * MS,
    retries=0,
    faults=(LateResponse(0.3, 1009 * MS, ("drive 40",)),),
)
"""What comes late from one falls into the wait for another that is dead: an N2 answer names nobody."""

LATE_CASES: tuple[Case, ...] = (
    _case("RTU answers into the next station, no repeats", _bus(240, retries=0)),
    _case("N2 answers into the next station", _n2(250, 15)),
    _short_case("RTU answers into the next station, heard for a short time", _bus(232)),
    _short_case("ASCII answers into the next station, heard for a short time", _bus(240, is_ascii=True, quantity=12)),
    _short_case("N2 answers into the next station, heard for a short time", _n2(250, 15)),
)

FURTHER_LATE_CASES: tuple[Case, ...] = (
    Case(
        "N2 slow station beside a dead one",
        _BESIDE_DEAD,
        (("N2005", "station 80"), Said(("station 40",), ("N2011", "N2014"))),
        seconds=160,
        seeds=3,
        never=("N2017",),
    ),
    Case(
        "RTU now and then answers into the next request, FTDI",
        _SELDOM,
        (Said(("station 80",), ("MB106",)),),
        FTDI,
        never=("LN203", "MB203"),
    ),
    _case("RTU answers into its own repeat", _bus(205, pause=5)),
    _case("RTU answers into the next station", _bus(232)),
    Case("N2 answers into the next station, FTDI", _n2(225, 30), _late_or_unasked, FTDI, seeds=1, struck=("bus",)),
    Case("RTU all answer late", _ALL, _impatient, seeds=1, struck=("bus",)),
    Case("N2 all answer late", _ALL_OF_N2, _impatient, seeds=1, struck=("bus",)),
    Case("RTU all answer late, FTDI", _ALL, _impatient, FTDI, seeds=1, struck=("bus",)),
    _case("RTU answers one request late", _bus(228, retries=2, pause=5)),
    _case("RTU answers into the next station, FTDI", _bus(236), FTDI),
    _case("RTU answers into the next station, CH340", _bus(232), CH340),
    _case("RTU answers into the next station, UART", _bus(232), UART),
    _case("RTU long answers into the next station", _bus(222, quantity=100)),
    _case("ASCII answers into the next station", _bus(240, is_ascii=True, quantity=12)),
)
