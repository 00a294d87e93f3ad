"""Modbus stations and masters that do one thing wrong, and what a technician should be told. Data."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from dissectors.frame import Place
from dissectors.line import LineSettings
from dissectors.modbus.simulated_master import read_holding, write_register, write_registers
from dissectors.simulated import Station
from dissectors.simulated_faults import BitFlips, Break, CutShort, LateResponse, LostResponse, MarkParity, NoiseInGaps
from sniff.simulation.tap import CH340, FTDI, UART
from tests.faults.buses import RTU_LINE, modbus
from tests.faults.case import Case, Said
from tests.faults.check_cases import Sends
from tests.faults.hearing import (
    as_text,
    echoing,
    hidden_latency,
    noisy_tap,
    of_party,
    reading_too_few,
    sent_otherwise,
    unheard,
)
from tests.faults.misbehaving import (
    ByTheClock,
    Rewrites,
    SpoiltFirst,
    SwapsChecks,
    TakesReadsOnly,
    Trimmed,
    Unhurried,
    copied_before,
    other_check,
    other_function,
    other_quantity,
    other_value,
    swapped_check,
)
from tests.faults.stations import AnswersBroadcasts, Dies, Ignores, Of
from tests.faults.well_behaved import counting_server
from tests.faults.workbench import Modbus, server, usual_requests, usual_stations

MS = 1_000_000
S = 1_000_000_000

_ascii = partial(modbus, is_ascii=True)
_FOUR = (1, 2, 3, 4)
_master = ("master", "bus")
_second = ("station 2",)

_no_unit = read_holding(0, 0, 2)
_wrong_count = b"\x01\x10\0\5\0\2\2\0\7"  # two registers, but the count says two octets
_vendor = b"\x02\x41\x10\x01"

_FIRST = r"\bfirst\b|too late|begin"
_LAST = r"\blast\b|too early|too soon|\bends?\b.*missing|lets go|cut (off|short)"
_SWAP = r"swap|other order|wrong order|order of|revers|exchang|high (octet|byte)"
_COPY = r"\becho|\bcop(y|ies|ied)|gives? back|repeats? the request"
_LATE = r"\blate|after (the|its|another|it was) |next (turn|request)|gave up"
_TWO = r"two (stations|devices|servers|drives)|second (station|device)|same (address|number)|both"


def _twin(delay: int, *, is_ascii: bool = False, seed: int) -> Station:
    """A second device with number 2, which has other values."""
    made = server(2, delay=delay, is_ascii=is_ascii)
    for address in range(64):
        made.holding.write(address, 40_000 + address)
    return TakesReadsOnly(made, is_ascii)


def _two_masters(unit_masters: tuple[int, ...], every: int, is_ascii: bool, *, seed: int) -> Station:
    """A second one that asks the same as the first, by its own clock."""
    line = LineSettings.parse("19200,7E1") if is_ascii else RTU_LINE
    asked = [read_holding(unit, 0, 6) for unit in unit_masters]
    return Unhurried(
        asked,
        line,
        60 * MS,
        seed,
        is_ascii=is_ascii,
        start=13 * MS,
        pause=every,
        interval=0,
        timeout=330 * MS,
        retries=0,
    )


_turns = Modbus(usual_requests(_FOUR), usual_stations(_FOUR, unit_2=60 * MS, unit_3=60 * MS), retries=0)

_by_the_clock = replace(
    _turns,
    asked=(*usual_requests(_FOUR), *usual_requests(_FOUR, 30)),
    stations=usual_stations(_FOUR, unit_4=30 * MS),
    master=partial(ByTheClock, tick=90 * MS),
)


def _counting(first: int) -> Modbus:
    """Three meters whose counters begin there."""
    units = (1, 2, 3)
    return Modbus(
        tuple(read_holding(unit, 0, 2) for unit in units),
        {unit: partial(counting_server, unit, 8 * MS, first) for unit in units},
    )


def _cr_as_lf(octets: bytes) -> bytes:
    return octets.replace(b"\r", b"\n")


def _without_flow(octets: bytes) -> bytes:
    return octets.replace(b"\x11", b"").replace(b"\x13", b"")


MODBUS_CASES: tuple[Case, ...] = (
    # damage that is the same each time
    Case(
        "RTU CRC octets swapped by one station",
        partial(modbus, change={2: partial(Rewrites, rewrite=swapped_check)}),
        (Said(_second, words=_SWAP),),
    ),
    Case(
        "RTU CRC octets swapped, FTDI",
        partial(modbus, change={2: partial(Rewrites, rewrite=swapped_check)}),
        (Said(_second, words=_SWAP),),
        FTDI,
    ),
    Case(
        "RTU CRC octets swapped by the master",
        replace(_turns, change_master=SwapsChecks),
        (("MB011", "master"),),
        never=("LN003",),
        seeds=1,
    ),
    Case(
        "RTU master makes no check",
        partial(modbus, (Trimmed("master", last=2),), units=(1, 2), absent=(1, 2)),
        (("MB006", "master"),),
        never=("LN003",),
        seconds=20,
        seeds=1,
    ),
    Case(
        "RTU requests end one octet early",
        partial(modbus, (Trimmed("master", last=1),), units=(1, 2), absent=(1, 2)),
        (("MB006", "master"),),
        never=("LN003",),
        seconds=20,
        seeds=1,
    ),
    Case(
        "RTU first octet of one station lost",
        partial(modbus, (Trimmed("unit 2", first=1, rate=0.5),)),
        (Said(_second, words=_FIRST),),
    ),
    Case(
        "RTU first octet of one station always lost, FTDI",
        partial(modbus, (Trimmed("unit 3", first=1),)),
        (Said(("station 3",), words=_FIRST),),
        FTDI,
    ),
    Case(
        "RTU first octet of one station spoilt",
        partial(modbus, (SpoiltFirst("unit 3", rate=0.6),)),
        (Said(("station 3",), words=_FIRST),),
    ),
    Case(
        "RTU last octet of one station lost",
        partial(modbus, (Trimmed("unit 2", last=1, rate=0.5),)),
        (Said(_second, ("MB006",), _LAST),),
    ),
    Case(
        "RTU last two octets of one station always lost",
        partial(modbus, (Trimmed("unit 1", last=2),)),
        (Said(("station 1",), ("MB006",), _LAST),),
    ),
    Case(
        "RTU last octet of one station lost, CH340",
        partial(modbus, (Trimmed("unit 2", last=1, rate=0.5),)),
        (Said(_second, ("MB006",), _LAST),),
        CH340,
    ),
    Case(
        "ASCII line feed of one station lost",
        partial(_ascii, (Trimmed("unit 2", last=1, rate=0.5),)),
        (Said(_second, ("MB019",)),),
        never=("MB202", "LN202"),
    ),
    Case(
        "ASCII first character of one station lost",
        partial(_ascii, (Trimmed("unit 2", first=1, rate=0.5),)),
        (Said(_second, ("MB005",), _FIRST),),
    ),
    Case(
        "ASCII last characters of one station lost",
        partial(_ascii, (Trimmed("unit 2", last=2, rate=0.5),)),
        (Said(_second, ("MB005", "MB006"), _LAST),),
    ),
    Case(
        "RTU echo cut short",
        modbus,
        (Said(("bus", "master", "adapter"), ("LN205",), _COPY),),
        hear=partial(echoing, 2),
        never=("MB203", "MB201", "MB202"),
        seeds=1,
    ),
    Case(
        "RTU station copies the request before its answer",
        partial(modbus, change={2: partial(Rewrites, rewrite=copied_before)}),
        (Said(("station 2", "bus"), ("LN205",), _COPY),),
        seeds=1,
    ),
    Case(
        "RTU station copies the request before its answer, FTDI",
        partial(modbus, change={2: partial(Rewrites, rewrite=copied_before)}),
        (("MB018", "station 2"),),
        FTDI,
        seeds=1,
    ),
    Case(
        "RTU check of one station computed otherwise",
        partial(modbus, change={2: partial(Rewrites, rewrite=other_check)}),
        (("MB021", "station 2"),),
        seeds=1,
    ),
    # octets that something takes for text
    Case(
        "RTU read as text",
        _counting(0x0CF0),
        (("MB023", "bus"),),
        hear=partial(as_text, _cr_as_lf),
        never=("MB005", "MB007"),
        seconds=20,
        seeds=1,
    ),
    Case(
        "RTU flow control before one station",
        replace(_counting(0x10F0), change={2: partial(Sends, made=_without_flow)}),
        (("MB023", "station 2"),),
        never=("MB005", "MB006"),
        seconds=20,
        seeds=1,
    ),
    # a program that takes fewer octets than come
    Case(
        "RTU answers read two octets short",
        _counting(0x0100),
        (("MB024", "bus"),),
        hear=partial(reading_too_few, 2),
        seconds=5,
        seeds=1,
    ),
    # what this tap alone does not hear
    Case(
        "RTU answers not heard here",
        modbus,
        (("MB020", "bus"),),
        hear=partial(unheard, ("unit 1", "unit 2", "unit 3"), 0.2),
        never=("MB001", "MB002", "MB003", "MB004"),
        seeds=2,
    ),
    Case(
        "RTU no answer heard here at all",
        modbus,
        (("MB020", "bus"),),
        hear=partial(unheard, ("unit 1", "unit 2", "unit 3"), 1.0),
        never=("MB001",),
        seeds=1,
    ),
    Case(
        "ASCII one station not heard here",
        _ascii,
        (("MB020", "bus"),),
        hear=partial(unheard, ("unit 3",), 1.0),
        never=("MB001", "MB003"),
        seeds=1,
    ),
    # a master that goes on as after an answer, since it never waits for one
    Case(
        "RTU station absent, master by the clock",
        replace(_by_the_clock, stations=usual_stations((1, 3, 4), unit_4=30 * MS)),
        (("MB001", "station 2"),),
        never=("MB020",),
        seeds=1,
    ),
    Case(
        "RTU answers lost, master by the clock",
        replace(_by_the_clock, faults=(LostResponse(0.08, ("unit 2",)),)),
        (("MB002", "station 2"),),
        never=("MB020",),
        seeds=2,
    ),
    Case(
        "RTU station dies, master by the clock",
        replace(_by_the_clock, change={2: partial(Dies, at=30 * S)}),
        (("MB003", "station 2"),),
        never=("MB020",),
        seeds=1,
    ),
    Case(
        "RTU requests damaged here alone",
        modbus,
        (("MB022", "bus"),),
        hear=partial(noisy_tap, "master", 0.08),
        never=("MB001",),
        seeds=2,
    ),
    # answers that do not fit, requests that are wrong
    Case(
        "RTU answers with another function",
        partial(modbus, change={2: partial(Rewrites, rewrite=other_function)}),
        (("MB010", "station 2"),),
        seeds=1,
    ),
    Case(
        "ASCII answers with another function",
        partial(_ascii, change={2: partial(Rewrites, rewrite=partial(other_function, is_ascii=True))}),
        (("MB010", "station 2"),),
        seeds=1,
    ),
    Case(
        "RTU write confirmed with another value",
        partial(modbus, change={2: partial(Rewrites, rewrite=other_value)}),
        (Said(_second, ("MB010",), r"confirm|other value|another value|differ|not fit"),),
        seeds=1,
    ),
    Case(
        "ASCII write confirmed with another value",
        partial(_ascii, change={2: partial(Rewrites, rewrite=partial(other_value, is_ascii=True))}),
        (Said(_second, ("MB010",), r"confirm|other value|another value|differ|not fit"),),
        seeds=1,
    ),
    Case(
        "RTU registers confirmed with another quantity",
        partial(
            modbus, extra=(write_registers(2, 4, [1, 2, 3]),), change={2: partial(Rewrites, rewrite=other_quantity)}
        ),
        (Said(_second, ("MB010",), r"confirm|quantity|differ|not fit"),),
        seeds=1,
    ),
    Case(
        "RTU byte count of requests wrong",
        partial(modbus, extra=(_wrong_count,)),
        (
            Said(
                ("master", "bus", "station 1"), (), r"byte count|count of (octets|bytes)|quantity|(octets|bytes) .*fit"
            ),
        ),
        struck=("station 1",),
        seeds=1,
    ),
    Case(
        "RTU master reads from address 0",
        partial(modbus, extra=(_no_unit,)),
        (Said(("master", "bus", "station 0"), (), r"address 0\b|broadcast|unit number|to all"),),
        never=("MB001", "MB004", "MB203"),
        seeds=1,
    ),
    Case(
        "ASCII master reads from address 0",
        partial(_ascii, extra=(_no_unit,)),
        (Said(("master", "bus", "station 0"), (), r"address 0\b|broadcast|unit number|to all"),),
        never=("MB001", "MB004", "MB203"),
        seeds=1,
    ),
    Case(
        "RTU answer to a broadcast, from a new address",
        partial(modbus, extra=(write_register(0, 3, 7),), change={2: partial(AnswersBroadcasts, unit=9)}),
        (Said(("bus", "station 9"), ("MB204",), "broadcast"),),
        seeds=1,
    ),
    Case(
        "RTU vendor function without answer",
        Modbus(
            (*usual_requests(_FOUR), _vendor),
            usual_stations(_FOUR),
            change={2: partial(Ignores, function=0x41)},
            retries=2,  # twice alone could be an answer that equals its request
        ),
        (Said(_second, ("MB004", "MB002")),),
        seeds=1,
    ),
    # late
    Case(
        "RTU late answers into the next turn",
        Modbus(_turns.asked, _turns.stations, (LateResponse(0.15, 201 * MS, ("unit 1",)),), retries=0),
        (Said(("station 1",), ("MB103", "MB207"), _LATE),),
        never=("MB201", "MB202", "MB206", "MB001", "MB002"),  # answered late is not lost
    ),
    Case(
        "RTU late answers into the next turn, FTDI",
        Modbus(_turns.asked, _turns.stations, (LateResponse(0.15, 201 * MS, ("unit 1",)),), retries=0),
        (Said(("station 1",), ("MB103", "MB207"), _LATE),),
        FTDI,
        never=("MB201", "MB202", "MB206", "MB001", "MB002"),  # answered late is not lost
    ),
    Case(
        "ASCII late answers into the next turn",
        Modbus(
            usual_requests(_FOUR, 2),
            usual_stations(_FOUR, is_ascii=True, unit_2=70 * MS, unit_3=70 * MS),
            (LateResponse(0.15, 201 * MS, ("unit 1",)),),
            is_ascii=True,
            retries=0,
        ),
        (Said(("station 1",), ("MB103", "MB207"), _LATE),),
        never=("MB201", "MB202", "MB206", "MB001", "MB002"),  # answered late is not lost
    ),
    # who has an address
    Case(
        "RTU two devices with one address, other values",
        Modbus(
            usual_requests(_FOUR),
            usual_stations(_FOUR),
            change={2: TakesReadsOnly},
            others={"twin": partial(_twin, 32 * MS)},
            pause=60 * MS,
        ),
        (Said(_second, ("MB201", "MB202"), _TWO),),
        also=("MB201", "MB202"),
        seeds=1,
    ),
    Case(
        "RTU two devices with one address, other values, FTDI",
        Modbus(
            usual_requests(_FOUR),
            usual_stations(_FOUR),
            change={2: TakesReadsOnly},
            others={"twin": partial(_twin, 50 * MS)},
            pause=90 * MS,
        ),
        (Said(_second, ("MB201", "MB202"), _TWO),),
        FTDI,
        also=("MB201", "MB202"),
    ),
    Case(
        "ASCII two devices with one address, other values",
        Modbus(
            usual_requests(_FOUR),
            usual_stations(_FOUR, is_ascii=True),
            change={2: partial(TakesReadsOnly, is_ascii=True)},
            others={"twin": partial(_twin, 45 * MS, is_ascii=True)},
            is_ascii=True,
            pause=90 * MS,
        ),
        (Said(_second, ("MB201", "MB202"), _TWO),),
        also=("MB201", "MB202"),
        seeds=1,
    ),
    Case(
        "RTU two masters ask the same by two clocks",
        Modbus(
            usual_requests(_FOUR),
            usual_stations(_FOUR),
            others={"second master": partial(_two_masters, _FOUR, 470 * MS, False)},
        ),
        (("MB203", "bus"),),
        struck=("master",),
    ),
    Case(
        "RTU two masters often meet at one station",
        Modbus(
            usual_requests(_FOUR),
            usual_stations(_FOUR),
            others={"second master": partial(_two_masters, _FOUR, 610 * MS, False)},
        ),
        (("MB203", "bus"),),
        struck=("master",),
        seeds=4,
    ),
    Case(
        "ASCII two masters ask the same by two clocks",
        Modbus(
            usual_requests(_FOUR),
            usual_stations(_FOUR, is_ascii=True),
            others={"second master": partial(_two_masters, _FOUR, 470 * MS, True)},
            is_ascii=True,
        ),
        (("MB203", "bus"),),
        struck=("master",),
    ),
    # line errors of one
    Case(
        "RTU parity errors of one station, one flag a read",
        partial(modbus, (MarkParity(0.03, ("unit 2",)),)),
        (("LN101", "station 2"),),
        FTDI,
    ),
    Case(
        "RTU parity errors of one station, 16550",
        partial(modbus, (MarkParity(0.01, ("unit 2",)),)),
        (("LN101", "station 2"),),
        UART,
    ),
    Case(
        "ASCII parity errors of one station",
        partial(_ascii, (MarkParity(0.01, ("unit 2",)),)),
        (("LN101", "station 2"),),
    ),
    Case(
        "RTU parity errors of the master",
        partial(modbus, (MarkParity(0.01, ("master",)),)),
        (("LN101", "master"),),
    ),
    Case(
        "RTU breaks after one station",
        partial(modbus, (Of("unit 2", Break(0.15)),)),
        (("LN103", "station 2"),),
    ),
    Case(
        "ASCII answers cut short",
        partial(_ascii, (CutShort(0.1, ("unit 3",)),)),
        (("MB005", "station 3"),),
    ),
    Case(
        "ASCII answers cut short, FTDI",
        partial(_ascii, (CutShort(0.1, ("unit 3",)),)),
        (("MB005", "station 3"),),
        FTDI,
    ),
    Case(
        "RTU answers cut short, FTDI",
        partial(modbus, (CutShort(0.1, ("unit 3",)),)),
        (("MB005", "station 3"),),
        FTDI,
    ),
    Case(
        "RTU noise before a station, FTDI",
        partial(modbus, (Of("unit 2", NoiseInGaps(0.2, places=(Place.BEFORE,))),)),
        (Said(_second, ("LN201",), r"stray|noise|before"),),
        FTDI,
    ),
    Case(
        "RTU one station's clock six in a hundred too slow",
        modbus,
        (Said(_second, ("MB005", "MB006", "LN101"), r"damag|framing|baud|parity"),),
        hear=partial(sent_otherwise, partial(of_party, "unit 2", LineSettings(18_048, 8, "E", 1))),
        seeds=1,
    ),
    # a recording that hides how late it was
    Case(
        "hidden latency, station absent",
        partial(modbus, absent=(4,)),
        (("MB001", "station 4"),),
        FTDI,
        hear=hidden_latency,
    ),
    Case(
        "hidden latency, answers lost",
        partial(modbus, (LostResponse(0.08, ("unit 2",)),)),
        (("MB002", "station 2"),),
        FTDI,
        hear=hidden_latency,
    ),
    Case(
        "hidden latency, bit errors of one station",
        partial(modbus, (BitFlips(6e-3, ("unit 2",)),)),
        (("MB005", "station 2"),),
        FTDI,
        hear=hidden_latency,
    ),
)
