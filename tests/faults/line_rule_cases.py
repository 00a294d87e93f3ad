"""What is wrong with a line or with the settings it is heard with, and what a technician should be told. Data."""

from __future__ import annotations

from functools import partial

from dissectors.frame import Place
from dissectors.line import LineSettings
from dissectors.modbus.simulated_master import write_register
from dissectors.simulated_faults import Break, MarkParity, NoiseInGaps
from sniff.simulation.tap import FTDI
from tests.faults.buses import modbus, mstp, n2
from tests.faults.case import Case
from tests.faults.hearing import unheard
from tests.faults.interference import Interference
from tests.faults.line_faults import (
    Anywhere,
    AtTimes,
    PutBehind,
    as_protocol,
    by_other_uart,
    masked,
    paused,
    with_settings,
)
from tests.faults.profibus_cases import profibus
from tests.faults.stations import Dies, Of, Pauses
from tests.faults.workbench import Modbus, usual_requests, usual_stations

MS = 1_000_000
S = 1_000_000_000

_five = partial(modbus, units=(1, 2, 3, 4, 5))
_quick = partial(modbus, line=LineSettings.parse("38400,8E1"))

_sparks = partial(Interference, 1_500 * MS, jitter=None, octets=(1, 3))

LINE_RULE_CASES: tuple[Case, ...] = (
    Case(
        "line, only the master heard, and sparks",
        Modbus(usual_requests((1, 2, 3)), usual_stations((1, 2, 3)), others={"sparks": _sparks}),
        (("MB020", "bus"),),
        hear=partial(unheard, ("unit 1", "unit 2", "unit 3"), 1.0),
        never=("MB001",),
        seeds=1,
    ),
    Case(
        "line, line ends behind requests that nobody answers",
        partial(modbus, (PutBehind("master", b"\r\n"),), units=(1, 2), absent=(1, 2)),
        (("LN207", "master"),),
        never=("LN203",),
        seconds=20,
        seeds=1,
    ),
    Case(
        "line, check made twice by one station",
        partial(modbus, (PutBehind("unit 2", b"\0\0"),)),
        (("LN207", "station 2"),),
        never=("LN202", "LN203"),
        seeds=1,
    ),
    Case("line, hum at 50 Hz", partial(_quick, (AtTimes(20 * MS, 2 * MS, 0.1),)), (("LN301", "bus"),)),
    Case("line, hum at 60 Hz, half waves", partial(_quick, (AtTimes(8_333_333, MS, 0.06),)), (("LN301", "bus"),)),
    Case("line, contactor", partial(_five, (AtTimes(7 * S, 150 * MS, 0.2),)), (("LN302", "bus"),)),
    Case(
        "line, another rate for a while",
        partial(modbus, line=LineSettings.parse("19200,8N1")),
        (("LN303", "bus"),),
        hear=partial(with_settings, "9600,8N1", ((20.0, 23.0),)),
        struck=("station 1", "station 2", "station 3"),
    ),
    Case("line, silent for a while", modbus, (("LN304", "bus"),), hear=partial(paused, ((20.0, 12.0),)), seconds=40),
    Case(
        "line, silent for a while, MS/TP", mstp, (("LN304", "bus"),), hear=partial(paused, ((3.0, 12.0),)), seconds=20
    ),
    Case(
        "line, silent for a moment, MS/TP", mstp, (("MS101", "bus"),), hear=partial(paused, ((3.0, 1.2),)), seconds=20
    ),
    Case("line, silent for a while, N2", n2, (("LN304", "bus"),), hear=partial(paused, ((20.0, 12.0),)), seconds=40),
    Case(
        "line, silent for a while, PROFIBUS",
        profibus,
        (("LN304", "bus"),),
        hear=partial(paused, ((0.6, 12.0),)),
        seconds=10,
    ),
    Case(
        "line, stations lost at one moment",
        partial(_five, change={2: partial(Dies, at=20 * S), 3: partial(Dies, at=20 * S), 5: partial(Dies, at=20 * S)}),
        (("LN305", "bus"),),
        struck=("station 2", "station 3", "station 5"),
    ),
    Case(
        "line, stations away for a while",
        partial(
            _five,
            change={
                2: partial(Dies, at=20 * S, until=26 * S),
                3: partial(Dies, at=20 * S, until=26 * S),
            },
        ),
        (("LN305", "bus"),),
        struck=("station 2", "station 3"),
    ),
    Case(
        "line, parity of one station through packets",
        partial(modbus, (MarkParity(0.01, ("unit 2",)),)),
        (("LN101", "station 2"),),
        FTDI,
    ),
    Case("line, breaks of one station", partial(modbus, (Of("unit 2", Break(0.1)),)), (("LN103", "station 2"),)),
    Case(
        "line, one station in pieces",
        partial(modbus, (Of("unit 2", Pauses(1.0, 40 * MS)),), pause=100 * MS),
        (("LN206", "station 2"),),
    ),
    Case("line, noise anywhere", partial(_five, (NoiseInGaps(0.1),)), (("LN203", "bus"),)),
    Case(
        "line, ringing after everybody",
        partial(_five, (NoiseInGaps(0.2, places=(Place.AFTER,), values=b"\xff", most=1),)),
        (("LN202", "bus"),),
    ),
    Case("line, read as another protocol", modbus, (("LN003", "bus"),), hear=partial(as_protocol, "n2"), seconds=5),
    Case("line, read as RTU", n2, (("LN003", "bus"),), hear=partial(as_protocol, "modbus-rtu"), seconds=10),
    Case(
        "line, a much faster bus",
        partial(modbus, line=LineSettings.parse("57600,8N1"), pause=200 * MS),
        (("LN003", "bus"),),
        hear=partial(by_other_uart, "9600,8N1"),
        seconds=20,
    ),
    Case("line, seven data bits", modbus, (("LN003", "bus"),), hear=partial(masked, 0x7F), seconds=5),
    Case(
        "line, near its limit",
        partial(modbus, is_ascii=True, pause=MS, delays={1: MS, 2: MS, 3: MS}),
        (("LN401", "bus"),),
        seconds=40,
    ),
    Case(
        "line, many broadcasts",
        partial(modbus, extra=(write_register(0, 3, 7),) * 24),
        (("LN402", "bus"),),
    ),
)

NO_PATTERN: tuple[Case, ...] = (
    Case("line, noise without pattern", partial(_five, (Anywhere(0.05),)), ()),
    Case("line, damage without pattern", partial(_quick, (AtTimes(3 * S, 200 * MS, 0.2, loose=S),)), ()),
)
"""Noise that has no rhythm: no LN3xx may be said."""
