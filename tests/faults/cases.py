"""The matrix: what is wrong with each bus, and what a technician should be told. Data."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from dissectors.frame import Place
from dissectors.modbus.simulated_master import read_holding, write_register
from dissectors.simulated_faults import (
    BitFlips,
    Break,
    CutShort,
    DuplicateAddress,
    EarlyRelease,
    LateResponse,
    LostResponse,
    MarkParity,
    NoiseInGaps,
)
from sniff.simulation.tap import EXACT, FTDI
from tests.faults.buses import modbus, n2
from tests.faults.case import Case, Said
from tests.faults.check_cases import CHECK_CASES
from tests.faults.drive_cases import DRIVE_CASES
from tests.faults.hearing import (
    counting,
    echoing,
    losing,
    other_settings,
    overrunning,
    silent,
    stepping,
    swapped,
)
from tests.faults.late_cases import FURTHER_LATE_CASES, LATE_CASES
from tests.faults.line_cases import LINE_CASES
from tests.faults.line_rule_cases import LINE_RULE_CASES
from tests.faults.modbus_cases import MODBUS_CASES
from tests.faults.mstp_cases import MSTP_CASES
from tests.faults.n2_cases import N2_CASES
from tests.faults.n2_rule_cases import N2_RULE_CASES
from tests.faults.profibus_cases import PROFIBUS_CASES
from tests.faults.ring_cases import RING_CASES
from tests.faults.stations import (
    AnswersAs,
    AnswersBroadcasts,
    Dies,
    Drifts,
    Ignores,
    Of,
    Pauses,
    Resets,
)
from tests.faults.uneven_stations import TakesTurns, Waits
from tests.faults.workbench import Modbus, usual_requests, usual_stations

MS = 1_000_000
S = 1_000_000_000


# ---- the table

_ascii = partial(modbus, is_ascii=True)
_wrong_place = {2: partial(AnswersAs, unit=7)}
_FOUR = (1, 2, 3, 4)
_some_lost = LostResponse(0.04, ("unit 3",))
_short_answers = {2: partial(AnswersAs, drop=2)}

CASES: tuple[Case, ...] = (  # of each a capture is kept in captures/findings
    # Modbus RTU: who fails
    Case("RTU station absent", partial(modbus, absent=(4,)), (("MB001", "station 4"), ("MB105", "bus"))),
    Case("RTU station with wrong address", partial(modbus, absent=(3,), units=(1, 2, 7)), (("MB001", "station 3"),)),
    Case("RTU answers lost", partial(modbus, (LostResponse(0.08, ("unit 2",)),)), (("MB002", "station 2"),)),
    Case("RTU repeats cost time", partial(modbus, (LostResponse(0.25, ("unit 2",)),)), (("MB104", "station 2"),)),
    Case("RTU station dies", partial(modbus, change={2: partial(Dies, at=30 * S)}), (("MB003", "station 2"),)),
    Case(
        "RTU station away for a while",
        partial(modbus, change={2: partial(Dies, at=20 * S, until=26 * S)}),
        (("MB003", "station 2"),),
    ),
    Case("RTU function ignored", partial(modbus, change={2: partial(Ignores, function=4)}), (("MB004", "station 2"),)),
    Case("RTU exception 2", partial(modbus, extra=(read_holding(1, 100, 2),)), (("MB008", "station 1"),)),
    Case("RTU exception 1", partial(modbus, extra=(b"\x03\x14\x07\x06\0\1\0\0\0\1",)), (("MB008", "station 3"),)),
    Case("RTU answers do not fit", partial(modbus, change=_short_answers), (("MB010", "station 2"),)),
    # Modbus RTU: damage
    Case("RTU bit errors of one station", partial(modbus, (BitFlips(6e-3, ("unit 2",)),)), (("MB005", "station 2"),)),
    Case("RTU bit errors everywhere", partial(modbus, (BitFlips(4e-3),)), (("MB007", "bus"),)),
    Case("RTU bit errors of the master", partial(modbus, (BitFlips(8e-3, ("master",)),)), (("MB009", "master"),)),
    Case("RTU early release", partial(modbus, (EarlyRelease(0.3, ("unit 3",)),)), (("MB006", "station 3"),)),
    Case("RTU answers cut short", partial(modbus, (CutShort(0.1, ("unit 3",)),)), (("MB005", "station 3"),)),
    Case("RTU parity errors", partial(modbus, (MarkParity(0.01, ("unit 2",)),)), (("LN101", "station 2"),)),
    Case("RTU breaks", partial(modbus, (Break(0.02),)), (("LN103", "bus"),)),
    Case(
        "RTU noise before a station",
        partial(modbus, (Of("unit 2", NoiseInGaps(0.1, places=(Place.BEFORE,))),)),
        (("LN201", "station 2"),),
    ),
    Case(
        "RTU noise after a station",
        partial(modbus, (Of("unit 2", NoiseInGaps(0.1, places=(Place.AFTER,), values=b"\xff\xfe\xf8")),)),
        (("LN202", "station 2"),),
    ),
    Case(
        "RTU noise in silence",
        partial(modbus, (Of("unit 3", NoiseInGaps(0.2, places=(Place.BETWEEN,), spread=30)),)),
        (("LN203", "bus"),),
        struck=("station 3",),
    ),
    # Modbus RTU: time
    Case("RTU slow station", partial(modbus, (_some_lost,), delays={3: 160 * MS}), (("MB101", "station 3"),)),
    Case(
        "RTU drifting station",
        partial(modbus, change={3: partial(Drifts, per_second=MS)}),
        (("MB102", "station 3"),),
    ),
    Case(
        "RTU late answers",
        partial(modbus, (LateResponse(0.06, 230 * MS, ("unit 1",)),), pause=60 * MS),
        (("MB103", "station 1"),),
    ),
    Case("RTU too quick", partial(modbus, delays={2: MS // 2}), (("MB301", "station 2"),)),
    Case(
        "RTU pauses inside frames",
        partial(modbus, (Of("unit 2", Pauses(0.1, 1_500_000)),)),
        (("MB302", "station 2"),),
    ),
    # Modbus RTU: addresses and masters
    Case("RTU answered twice", partial(modbus, (DuplicateAddress("unit 2", 19 * MS),)), (("MB201", "station 2"),)),
    Case("RTU two stations collide", partial(modbus, (DuplicateAddress("unit 2", 3 * MS),)), (("MB202", "station 2"),)),
    Case(
        "RTU two response times",
        partial(modbus, change={2: partial(Waits, spread=12 * MS, groups=True)}),
        (("MB208", "station 2"),),
        never=("MB102",),
    ),
    Case(
        "RTU two devices in turns",
        partial(modbus, change={2: partial(TakesTurns, later=9 * MS, value=77)}),
        (("MB208", "station 2"),),
        never=("MB102",),
    ),
    Case(
        "ASCII two response times",
        partial(_ascii, change={2: partial(Waits, spread=12 * MS, groups=True)}),
        (("MB208", "station 2"),),
    ),
    Case("RTU two masters", partial(modbus, second_master=True), (("MB203", "bus"),)),
    Case(
        "RTU answer to a broadcast",
        partial(modbus, extra=(write_register(0, 3, 7),), change={2: partial(AnswersBroadcasts, unit=2)}),
        (("MB204", "bus"),),
    ),
    Case(
        "RTU answer to a broadcast, as 0",
        partial(modbus, extra=(write_register(0, 3, 7),), change={2: partial(AnswersBroadcasts, unit=0)}),
        (("MB204", "bus"),),
    ),
    Case("RTU address 250", partial(modbus, units=(1, 2, 250), delays={250: 9 * MS}), (("MB205", "station 250"),)),
    Case("RTU answers as another", partial(modbus, change=_wrong_place), (("MB206", "station 2"),)),
    Case("RTU echo", modbus, (("LN205", "bus"),), hear=partial(echoing, 0)),
    # the sniffer and its settings
    Case("wrong baud rate", modbus, (("LN003", "bus"),), hear=partial(other_settings, "9600,8E1")),
    Case("wrong baud rate, too high", modbus, (("LN003", "bus"),), hear=partial(other_settings, "38400,8E1")),
    Case("wrong parity", modbus, (("LN004", "bus"),), hear=partial(other_settings, "19200,8O1")),
    Case("A and B swapped", modbus, (("LN003", "bus"),), hear=swapped),
    Case("octets lost by the computer", modbus, (("LN005", "adapter"),), hear=losing),
    Case("octets lost in the adapter", modbus, (("LN104", "adapter"),), hear=overrunning),
    Case("adapter unplugged", modbus, (("LN006", "adapter"),), replace(EXACT, unplugged=((20 * S, 22 * S),))),
    Case("silent bus", modbus, (("LN002", "bus"),), hear=silent),
    Case("clock stepped", modbus, (("LN007", "adapter"),), hear=stepping),
    Case("line errors counted", partial(modbus, (MarkParity(0.01),)), (("LN102", "bus"),), hear=counting),
    # through a USB adapter that holds octets back for 16 ms
    Case("FTDI station absent", partial(modbus, absent=(4,)), (("MB001", "station 4"),), FTDI),
    Case("FTDI answers lost", partial(modbus, (LostResponse(0.08, ("unit 2",)),)), (("MB002", "station 2"),), FTDI),
    Case(
        "FTDI bit errors of one station",
        partial(modbus, (BitFlips(6e-3, ("unit 2",)),)),
        (("MB005", "station 2"),),
        FTDI,
    ),
    Case("FTDI slow station", partial(modbus, (_some_lost,), delays={3: 175 * MS}), (("MB101", "station 3"),), FTDI),
    Case(
        "FTDI answered twice", partial(modbus, (DuplicateAddress("unit 2", 19 * MS),)), (("MB201", "station 2"),), FTDI
    ),
    Case("FTDI exception 2", partial(modbus, extra=(read_holding(1, 100, 2),)), (("MB008", "station 1"),), FTDI),
    # Modbus ASCII
    Case("ASCII station absent", partial(_ascii, absent=(4,)), (("MB001", "station 4"),)),
    Case("ASCII answers lost", partial(_ascii, (LostResponse(0.08, ("unit 2",)),)), (("MB002", "station 2"),)),
    Case("ASCII bit errors of one station", partial(_ascii, (BitFlips(4e-3, ("unit 2",)),)), (("MB005", "station 2"),)),
    Case("ASCII exception 2", partial(_ascii, extra=(read_holding(1, 100, 2),)), (("MB008", "station 1"),)),
    Case(
        "ASCII answered twice",
        partial(_ascii, (DuplicateAddress("unit 2", 30 * MS),), pause=70 * MS),
        (("MB201", "station 2"),),
    ),
    # Metasys N2
    Case("N2 station absent", partial(n2, absent=True), (("N2005", "station 3"),)),
    Case("N2 answers lost", partial(n2, (LostResponse(0.08, ("drive 2",)),)), (("N2005", "station 2"),)),
    Case("N2 bit errors of one station", partial(n2, (BitFlips(8e-3, ("drive 2",)),)), (("N2004", "station 2"),)),
    Case("N2 no such point", partial(n2, no_such_point=True), (("N2002", "station 1"),)),
    Case(
        "N2 two masters",
        partial(n2, second_master=True),
        (("N2007", "bus"),),
        struck=("station 1", "station 2"),
        also=("N2008",),
    ),
    Case("N2 station resets", partial(n2, change={2: partial(Resets, at=2 * S)}), (("N2001", "station 2"),)),
    Case(
        "N2 slow station", partial(n2, delays={2: 300 * MS}, pause=20 * MS, timeout=800 * MS), (("N2003", "station 2"),)
    ),
    Case("N2 override forgotten", partial(n2, overrides=True, pause=20 * S), (("N2006", "station 1"),), seconds=700),
    Case("N2 late answers", partial(n2, (LateResponse(0.06, 270 * MS, ("drive 1",)),)), (("N2011", "station 1"),)),
    # device profiles, BACnet MS/TP
    *N2_RULE_CASES,
    *DRIVE_CASES,
    *RING_CASES,
    *PROFIBUS_CASES,
    *LINE_RULE_CASES,
    *LATE_CASES,
)

FURTHER_CASES: tuple[Case, ...] = (
    Case(
        "RTU slower second device answers into the next request",
        partial(modbus, (DuplicateAddress("unit 2", 30 * MS),)),
        (Said(("bus",), words="behind an answer of station 2", own_words=True),),
        struck=("station 2",),
        seeds=1,
    ),
    Case(
        "RTU seldom asked station on a line that damages half",
        Modbus(
            (*4 * usual_requests((1, 2, 3, 4)), read_holding(9, 0, 6)), usual_stations((1, 2, 3, 4)), (BitFlips(0.03),)
        ),
        (("MB007", "bus"),),
        seconds=10,
        seeds=1,
    ),
    *CHECK_CASES,
    *MODBUS_CASES,
    *N2_CASES,
    *LINE_CASES,
    *MSTP_CASES,
    *FURTHER_LATE_CASES,
)
"""What is the same each time, time patterns, tokens. Written from the true cause; no captures are kept of them."""
