"""Buses on which nothing is wrong, though they are slow, brisk, odd or badly heard: nothing may be said. Data."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

from dissectors.bacnet.application import Poller, Quiet, read_property
from dissectors.bacnet.envelope import npdu_frame
from dissectors.bacnet.simulated import SimulatedNode
from dissectors.line import LineSettings, Timing
from dissectors.modbus.simulated_master import read_holding, write_register, write_registers
from dissectors.simulated import Station
from sniff.simulation.scenarios import Scenario, simulate
from sniff.simulation.tap import CH340, EXACT, FTDI, FTDI_LOW_LATENCY, OCTETS, UART, TapModel
from tests.faults.buses import MSTP_LINE, modbus, mstp, n2
from tests.faults.case import Case, Heard
from tests.faults.hearing import busy_host, hidden_latency
from tests.faults.misbehaving import ScansOnce
from tests.faults.n2_clean_cases import n2_clean_cases
from tests.faults.profibus_cases import profibus
from tests.faults.profibus_clean_cases import profibus_clean_cases
from tests.faults.ring_nodes import TestsItself
from tests.faults.ring_programs import Lister, Scans, Segmenting, controller, drive
from tests.faults.uneven_stations import Waits
from tests.faults.well_behaved import (
    AsksWithoutToken,
    LooksAround,
    NeverByItself,
    OwnFunctions,
    counting_server,
    requests_ending_in_zero,
    zero_checked,
    zero_checked_requests,
)
from tests.faults.workbench import (
    N2,
    Member,
    Modbus,
    Ring,
    by_turns,
    follower,
    server,
    usual_requests,
    usual_stations,
)

MS = 1_000_000
S = 1_000_000_000

ADAPTERS = (EXACT, FTDI, OCTETS, FTDI_LOW_LATENCY, UART, CH340)
LATE = (FTDI, FTDI_LOW_LATENCY, CH340)
"""Adapters that hold octets back although nobody says so."""

_SLOW = {1: 300 * MS, 2: 900 * MS, 3: 2_500 * MS}
_FOUR = (1, 2, 3, 4)


@dataclass(frozen=True)
class Clean:
    """A kind of clean bus. `adapters`: through which it is heard; `is_ring`: it has some hundred frames a second."""

    name: str
    make: Callable[..., Scenario]
    adapters: tuple[TapModel, ...] = ADAPTERS
    hear: Callable[[Scenario, float, TapModel], Heard] = simulate
    is_ring: bool = False


def _slow_stations(is_ascii: bool) -> dict[int, Callable[[], Station]]:
    return {unit: partial(server, unit, delay=delay, is_ascii=is_ascii) for unit, delay in _SLOW.items()}


def _mixed(unit: int) -> tuple[bytes, ...]:
    """Reads, and writes whose confirmation is the request again."""
    return (
        read_holding(unit, 0, 6),
        write_register(unit, 3, 1_000 + unit),
        b"%c\x05\0\x04\xff\0" % unit,
        b"%c\x08\0\0\xa5\x37" % unit,
        write_registers(unit, 8, [unit, 2, 3]),
    )


def _writes(unit: int) -> tuple[bytes, ...]:
    return write_register(unit, 3, 1_000 + unit), b"%c\x05\0\x04\xff\0" % unit


def _slow(is_ascii: bool, asked: Callable[[int], tuple[bytes, ...]]) -> Modbus:
    requests = tuple(one for unit in _SLOW for one in asked(unit))
    return Modbus(requests, _slow_stations(is_ascii), is_ascii=is_ascii, timeout=4 * S, retries=1, pause=120 * MS)


def _brisk(is_ascii: bool) -> Modbus:
    line = LineSettings.parse("38400,7E1" if is_ascii else "38400,8E1")
    stations = {unit: partial(server, unit, delay=2_100_000, is_ascii=is_ascii) for unit in _FOUR}
    asked = (*usual_requests(_FOUR), *(one for unit in _FOUR for one in _writes(unit)))
    return Modbus(asked, stations, is_ascii=is_ascii, line=line, pause=2_200_000, timeout=80 * MS)


def _one_write() -> Modbus:
    """A master that tells one drive the same value for ever: confirmations and requests are all alike."""
    line = LineSettings.parse("38400,8E1")
    return Modbus((write_register(32, 40, 395),), {32: partial(server, 32, delay=4 * MS)}, line=line, pause=3_500_000)


def _slow_bus(settings: str) -> Modbus:
    """Stations that answer as soon as they may, on a line where that takes longer than an adapter's timer."""
    line = LineSettings.parse(settings)
    soon = Timing(line).t35
    stations = {unit: partial(server, unit, delay=soon) for unit in _FOUR}
    asked = tuple(read_holding(unit, 3, quantity) for quantity in (2, 5, 9) for unit in _FOUR)
    return Modbus(asked, stations, line=line, pause=2 * soon, timeout=S)


def _makers_own(unit: int, times: dict[int, int]) -> Station:
    return OwnFunctions(server(unit), unit, times)


def _vendor() -> Modbus:
    times = {
        1: {0x41: 9 * MS, 0x64: 5 * MS},
        2: {0x41: 700 * MS, 0x6E: 320 * MS},
        3: {0x42: 2_400 * MS},
        4: {},
    }
    stations = {unit: partial(_makers_own, unit, functions) for unit, functions in times.items()}
    asked = [one for unit in _FOUR for one in (read_holding(unit, 0, 4), write_register(unit, 3, 7))]
    asked += [b"\1\x41\0\5", b"\1\x64\x10\x20\x30\x40\x50", b"\2\x41\0\5\1", b"\2\x6e", b"\3\x42\0\0\0\1"]
    return Modbus(tuple(asked), stations, timeout=3 * S, pause=40 * MS)


def _scan(is_ascii: bool) -> Modbus:
    looking = tuple(read_holding(unit, 0, 1) for unit in range(1, 248))
    return Modbus(
        usual_requests(_FOUR),
        usual_stations(_FOUR, is_ascii=is_ascii),
        master=partial(ScansOnce, scan=looking, at=4 * S),
        is_ascii=is_ascii,
        retries=0,
        timeout=100 * MS,
    )


def _zeros() -> Modbus:
    stations: dict[int, Callable[[], Station]] = {
        1: partial(counting_server, 1, 8 * MS, 200),
        2: partial(counting_server, 2, 8 * MS, 0x0001_0000 - 50),
        3: partial(zero_checked, 3, 9 * MS),
        5: partial(zero_checked, 5, 20 * MS),
        6: partial(server, 6, words=2_000),
    }
    counters = (read_holding(1, 0, 2), read_holding(2, 0, 2))
    static = (*zero_checked_requests(3), *zero_checked_requests(5))
    requests = requests_ending_in_zero(6, 2_000)
    return Modbus((*(counters * 6), *static, *requests), stations)


_SLOW_FOLLOWERS = {"drive 1": partial(follower, 1, 320 * MS), "drive 2": partial(follower, 2, 1_500 * MS)}
_FOLLOWERS = {"drive 1": partial(follower, 1, 10 * MS), "drive 2": partial(follower, 2, 18 * MS)}
_BRISK_FOLLOWERS = {"drive 1": partial(follower, 1, 2 * MS), "drive 2": partial(follower, 2, 3 * MS)}
_TURNS = partial(by_turns, 1, 2)

_one = Member(1, partial(controller, 5, 9))
_two = Member(2, partial(controller, 5))
_five = Member(5, partial(drive, 5))
_nine = Member(9, partial(drive, 9))
_far = {"max_master": 127}


def _joining() -> Ring:
    """A drive that gives itself a number, and looks first whether another one has it."""
    joins = partial(TestsItself, line=MSTP_LINE)
    return Ring(
        (
            Member(1, partial(controller, 62), settings=_far),
            Member(62, partial(drive, 62), settings=_far),
            Member(66, partial(drive, 66), joins, {**_far, "begins_at": 4 * S}),
        )
    )


def _looking_for_devices() -> Poller:
    return Scans([(5, "analog-input,4", "present-value")], (n for n in range(128) if n not in (1, 2, 5, 9)), 3 * S)


def _slave(mac: int, *, seed: int) -> Station:
    return NeverByItself(SimulatedNode(mac, Timing(MSTP_LINE), drive(mac)))


def _asks_slaves(*, seed: int) -> Station:
    asked = [
        npdu_frame(mac, 1, read_property(number, "analog-input,4", "present-value"), expects_reply=True)
        for number, mac in enumerate((5, 9), 1)
    ]
    return AsksWithoutToken(asked, 150 * MS)


def _no_token(*, seed: int = 0) -> Scenario:
    others: dict[str, Callable[..., Station]] = {
        "reader": _asks_slaves,
        "slave 5": partial(_slave, 5),
        "slave 9": partial(_slave, 9),
    }
    return Ring((), others=others)(seed=seed)


_ascii = partial(modbus, is_ascii=True)

CLEAN: tuple[Clean, ...] = (
    Clean("RTU clean", modbus),
    Clean("ASCII clean", _ascii),
    Clean("N2 clean", n2),
    Clean("MS/TP clean", mstp, is_ring=True),
    Clean("PROFIBUS clean", profibus, is_ring=True),
    # slow and brisk
    Clean("RTU clean, slow stations", _slow(False, _mixed)),
    Clean("RTU clean, slow stations that are only written to", _slow(False, _writes)),
    Clean("ASCII clean, slow stations", _slow(True, _mixed)),
    Clean("ASCII clean, slow stations that are only written to", _slow(True, _writes)),
    Clean("N2 clean, slow stations", N2(_TURNS, _SLOW_FOLLOWERS, timeout=3 * S)),
    Clean("RTU clean, brisk", _brisk(False)),
    Clean("ASCII clean, brisk", _brisk(True)),
    Clean("N2 clean, brisk", N2(_TURNS, _BRISK_FOLLOWERS, pause=4 * MS)),
    # odd
    Clean("RTU clean, functions of makers", _vendor()),
    Clean("RTU clean, scan of all addresses", _scan(False)),
    Clean("ASCII clean, scan of all addresses", _scan(True)),
    Clean(
        "N2 clean, scan of all addresses",
        N2(_TURNS, _FOLLOWERS, change_master=partial(LooksAround, at=4 * S, addresses=range(3, 128))),
    ),
    Clean(
        "MS/TP clean, scan of all addresses",
        Ring((_one, Member(2, _looking_for_devices), _five, _nine)),
        is_ring=True,
    ),
    Clean("RTU clean, check octets 00", _zeros()),
    Clean("MS/TP clean, joins without configuration", _joining(), is_ring=True),
    Clean(
        "MS/TP clean, segmented answers",
        Ring((Member(1, partial(Lister, 5, 5)), _two, Member(5, partial(Segmenting, 5)), _nine)),
        is_ring=True,
    ),
    Clean("MS/TP clean, no token anywhere", _no_token),
    Clean(
        "MS/TP clean, nobody asks",
        Ring((Member(1, Quiet), Member(2, Quiet), Member(5, Quiet))),
        is_ring=True,
    ),
    # badly heard
    Clean("RTU clean, one write again and again", _one_write()),
    Clean("RTU clean, one write again and again, hidden latency", _one_write(), LATE, hidden_latency),
    Clean("RTU clean, one write again and again, busy host", _one_write(), hear=busy_host),
    Clean("RTU clean, slow bus, hidden latency", _slow_bus("4800,8E1"), LATE, hidden_latency),
    Clean("RTU clean, very slow bus, hidden latency", _slow_bus("1200,8N1"), LATE, hidden_latency),
    Clean("RTU clean, busy host", modbus, hear=busy_host),
    Clean("ASCII clean, busy host", _ascii, hear=busy_host),
    Clean("N2 clean, busy host", n2, hear=busy_host),
    Clean("MS/TP clean, busy host", mstp, hear=busy_host, is_ring=True),
    Clean("RTU clean, hidden latency", modbus, LATE, hidden_latency),
    Clean("ASCII clean, hidden latency", _ascii, LATE, hidden_latency),
    Clean("N2 clean, hidden latency", n2, LATE, hidden_latency),
    Clean("MS/TP clean, hidden latency", mstp, LATE, hidden_latency, is_ring=True),
)


def clean_cases(seconds: float) -> Iterator[Case]:
    """Every kind of clean bus through every adapter for `seconds`; then stations whose times vary, a minute each.

    A ring that is not the plain one is heard a sixth as long except with exact times and with an FTDI adapter.
    """
    for kind in CLEAN:
        for tap in kind.adapters:
            shorter = kind.is_ring and kind.name != "MS/TP clean" and tap not in (EXACT, FTDI)
            heard = seconds / 6 if shorter else seconds
            yield Case(f"{kind.name}, {tap.name}", kind.make, (), tap, heard, kind.hear)
    yield from n2_clean_cases(seconds / 6)
    yield from profibus_clean_cases(seconds / 6)
    yield from unsteady_cases()


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
