"""The matrix: what is wrong with each bus, and what a technician should be told. Data."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from random import Random

from dissectors.frame import Chunk, LineError, Mark, Place
from dissectors.line import LineSettings
from dissectors.modbus.simulated_master import read_holding, write_register
from sniff.session import Item, LineEvent, LineEventKind
from sniff.simulation.faults import (
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
from sniff.simulation.line_mix import low_times, receive
from sniff.simulation.scenarios import Scenario, simulate
from sniff.simulation.tap import CH340, EXACT, FTDI, FTDI_LOW_LATENCY, OCTETS, UART, TapModel
from tests.faults.buses import modbus, mstp, n2
from tests.faults.case import Case, Heard
from tests.faults.drive_cases import DRIVE_CASES
from tests.faults.n2_cases import N2_CASES
from tests.faults.n2_clean_cases import n2_clean_cases
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

MS = 1_000_000
S = 1_000_000_000


def clean_cases(seconds: float) -> Iterator[Case]:
    """Nothing is wrong: nothing may be found at warning or above. `seconds` with exact times and with an FTDI adapter,
    a tenth of it with the others."""
    buses = {"RTU": modbus, "ASCII": partial(modbus, is_ascii=True), "N2": n2, "MS/TP": mstp}
    for protocol, make in buses.items():
        for tap in (EXACT, FTDI, OCTETS, FTDI_LOW_LATENCY, UART, CH340):
            yield Case(
                f"{protocol} clean, {tap.name}", make, (), tap, seconds if tap in (EXACT, FTDI) else seconds / 10
            )
    yield from n2_clean_cases(seconds / 6)


def unsteady_cases() -> Iterator[Case]:
    """Stations whose times vary, yet nothing is wrong, or the adapter does not let anybody know."""
    uneven = partial(modbus, change={2: partial(Waits, spread=30 * MS), 3: partial(Waits, spread=8 * MS)})
    groups = partial(modbus, change={2: partial(Waits, spread=12 * MS, groups=True)})
    rare = partial(modbus, change={2: partial(Waits, spread=25 * MS, groups=True, share=0.03)})
    yield Case("RTU clean, uneven times", uneven, (), never=("MB102", "MB208"))
    yield Case("RTU clean, uneven times, FTDI 16 ms", uneven, (), FTDI, never=("MB102", "MB208"))
    yield Case("RTU clean, uneven times, octet by octet", uneven, (), OCTETS, never=("MB102", "MB208"))
    yield Case("RTU clean, two times that an FTDI hides", groups, (), FTDI, never=("MB102", "MB208"))
    yield Case("RTU clean, busy now and then", rare, (), never=("MB102", "MB208"))


# ---- what goes wrong in the sniffer


def _other_settings(settings: str, plan: Scenario, seconds: float, tap: TapModel) -> Heard:
    """The same line heard by a UART with other settings, bit by bit."""
    session, _ = simulate(plan, seconds, tap)
    other = LineSettings.parse(settings)

    def items() -> Iterator[Item]:
        for burst in plan.wire().run(int(seconds * S)):
            if burst.octets:
                received = receive(other, low_times(plan.line, burst.start, burst.octets, {}))
                if received.octets:
                    yield Chunk(max(received.ends), received.octets, received.marks)

    return replace(session, line=other), items()


def _swapped(plan: Scenario, seconds: float, tap: TapModel) -> Heard:
    """A and B swapped: what was low is high; the silence between frames reads as a break."""
    session, _ = simulate(plan, seconds, tap)

    def items() -> Iterator[Item]:
        silent_since = 0
        for burst in plan.wire().run(int(seconds * S)):
            if not burst.octets:
                continue
            lows = sorted(low_times(plan.line, burst.start, burst.octets, {}))
            inverted, at = [], silent_since
            for begin, end in lows:
                if begin > at:
                    inverted.append((at, begin))
                at = max(at, end)
            silent_since = at
            received = receive(plan.line, inverted)
            if received.octets:
                yield Chunk(max(received.ends), received.octets, received.marks)

    return session, items()


def _losing(plan: Scenario, seconds: float, tap: TapModel) -> Heard:
    """A computer that loses a read now and then, and says so."""
    session, items = simulate(plan, seconds, tap)
    dice = Random(plan.seed)

    def some() -> Iterator[Item]:
        for item in items:
            if isinstance(item, Chunk) and dice.random() < 0.01:
                yield LineEvent(item.time, LineEventKind.DROPPED, "", len(item.octets))
            else:
                yield item

    return session, some()


def _overrunning(plan: Scenario, seconds: float, tap: TapModel) -> Heard:
    """An adapter that loses octets inside a read, and marks the place."""
    session, items = simulate(plan, seconds, tap)
    dice = Random(plan.seed)

    def some() -> Iterator[Item]:
        for item in items:
            if isinstance(item, Chunk) and len(item.octets) > 4 and dice.random() < 0.02:
                yield Chunk(item.time, item.octets[:2] + item.octets[4:], (Mark(2, LineError.OVERRUN),))
            else:
                yield item

    return session, some()


def _echoing(plan: Scenario, seconds: float, tap: TapModel) -> Heard:
    """A tap behind a converter that gives back what the master sends."""
    session, _ = simulate(plan, seconds, tap)

    def items() -> Iterator[Item]:
        for burst in plan.wire().run(int(seconds * S)):
            if burst.octets:
                yield Chunk(burst.end, burst.octets, burst.marks)
            if burst.octets and burst.sent[0].party == "master":
                yield Chunk(burst.end + len(burst.octets) * plan.line.char + 200_000, burst.octets)

    return session, items()


def _stepping(plan: Scenario, seconds: float, tap: TapModel) -> Heard:
    """A computer whose wall clock is put right by two minutes after a while."""
    session, items = simulate(plan, seconds, tap)

    def stepped() -> Iterator[Item]:
        waiting = True
        for item in items:
            if waiting and item.time > S // 2:
                yield LineEvent(item.time, LineEventKind.CLOCK, "", 120 * S)
                waiting = False
            yield item

    return session, stepped()


def _counting(plan: Scenario, seconds: float, tap: TapModel) -> Heard:
    """A driver that counts line errors and does not say where they were."""
    session, items = simulate(plan, seconds, tap)

    def counted() -> Iterator[Item]:
        for item in items:
            if isinstance(item, Chunk) and item.marks:
                yield Chunk(item.time, item.octets)
                yield LineEvent(item.time, LineEventKind.ERRORS, "parity", len(item.marks))
            else:
                yield item

    return session, counted()


def _silent(plan: Scenario, seconds: float, tap: TapModel) -> Heard:
    session, _ = simulate(plan, seconds, tap)
    return session, ()


# ---- the table

_ascii = partial(modbus, is_ascii=True)
_wrong_place = {2: partial(AnswersAs, unit=7)}
_some_lost = LostResponse(0.04, ("unit 3",))
_short_answers = {2: partial(AnswersAs, drop=2)}

CASES: tuple[Case, ...] = (
    # Modbus RTU: who fails
    Case("RTU station absent", partial(modbus, absent=(4,)), (("MB001", "station 4"), ("MB105", "bus"))),
    Case("RTU station with wrong address", partial(modbus, absent=(3,), units=(1, 2, 7)), (("MB001", "station 3"),)),
    Case("RTU answers lost", partial(modbus, (LostResponse(0.08, ("unit 2",)),)), (("MB002", "station 2"),)),
    Case("RTU repeats cost time", partial(modbus, (LostResponse(0.25, ("unit 2",)),)), (("MB104", "station 2"),)),
    Case("RTU station dies", partial(modbus, change={2: partial(Dies, at=30 * S)}), (("MB003", "station 2"),)),
    Case(
        "RTU station away for a while",
        partial(modbus, change={2: partial(Dies, at=20 * S, until=26 * S)}),
        (("MB002", "station 2"),),
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
    Case("RTU echo", modbus, (("LN205", "bus"),), hear=_echoing),
    # the sniffer and its settings
    Case("wrong baud rate", modbus, (("LN003", "bus"),), hear=partial(_other_settings, "9600,8E1")),
    Case("wrong baud rate, too high", modbus, (("LN003", "bus"),), hear=partial(_other_settings, "38400,8E1")),
    Case("wrong parity", modbus, (("LN004", "bus"),), hear=partial(_other_settings, "19200,8O1")),
    Case("A and B swapped", modbus, (("LN003", "bus"),), hear=_swapped),
    Case("octets lost by the computer", modbus, (("LN005", "adapter"),), hear=_losing),
    Case("octets lost in the adapter", modbus, (("LN104", "adapter"),), hear=_overrunning),
    Case("adapter unplugged", modbus, (("LN006", "adapter"),), replace(EXACT, unplugged=((20 * S, 22 * S),))),
    Case("silent bus", modbus, (("LN002", "bus"),), hear=_silent),
    Case("clock stepped", modbus, (("LN007", "adapter"),), hear=_stepping),
    Case("line errors counted", partial(modbus, (MarkParity(0.01),)), (("LN102", "bus"),), hear=_counting),
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
    *N2_CASES,
    *DRIVE_CASES,
    *RING_CASES,
)
