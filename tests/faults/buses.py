"""Buses on which nothing is wrong, one a protocol, each with places where a fault can be put in."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from dissectors.line import LineSettings, Timing
from dissectors.modbus.simulated import Cells, ModbusServer
from dissectors.modbus.simulated_master import PollingMaster, read_holding, write_register
from dissectors.simulated import Station
from dissectors.simulated_faults import Fault
from sniff.simulation.scenarios import Scenario
from sniff.simulation.wire import Party

MS = 1_000_000
RTU_LINE = LineSettings.parse("19200,8E1")
ASCII_LINE = LineSettings.parse("19200,7E1")
N2_LINE = LineSettings.parse("9600,8N1")
MSTP_LINE = LineSettings.parse("38400,8N1")

Change = Callable[[Station], Station]


def modbus(
    faults: Sequence[Fault] = (),
    *,
    is_ascii: bool = False,
    absent: Sequence[int] = (),
    extra: Sequence[bytes] = (),
    delays: dict[int, int] | None = None,
    change: dict[int, Change] | None = None,
    second_master: bool = False,
    units: Sequence[int] = (1, 2, 3),
    pause: int = 25 * MS,
    line: LineSettings | None = None,
    seed: int = 0,
) -> Scenario:
    """A master that asks three servers about twenty times a second, waits 200 ms and repeats once.

    `absent`: units that are asked but not there. `delays`: ns until a unit answers. `change`: what to make of a unit.
    """
    line = line or (ASCII_LINE if is_ascii else RTU_LINE)
    parties = partial(
        _modbus_parties,
        line,
        is_ascii,
        tuple(absent),
        tuple(extra),
        delays or {},
        change or {},
        second_master,
        tuple(units),
        pause,
    )
    gap = 0 if is_ascii else Timing(line).t35
    name = "modbus-ascii" if is_ascii else "modbus-rtu"
    return Scenario(name, name, line, parties, tuple(faults), seed, gap)


def _modbus_parties(
    line: LineSettings,
    is_ascii: bool,
    absent: tuple[int, ...],
    extra: tuple[bytes, ...],
    delays: dict[int, int],
    change: dict[int, Change],
    second_master: bool,
    units: tuple[int, ...],
    pause: int,
) -> list[Party]:
    asked = (*units, *(unit for unit in absent if unit not in units))
    requests: list[bytes] = []
    for unit in asked:
        requests += [read_holding(unit, 0, 6), read_holding(unit, 16, 2), b"%c\x04\0\0\0\x03" % unit]
        requests.append(write_register(unit, 3, 1234))
    master = PollingMaster(
        [*requests, *extra], line, is_ascii=is_ascii, interval=0, pause=pause, timeout=200 * MS, retries=1
    )
    parties = [Party("master", master, answers=False)]
    for unit in units:
        if unit in absent:
            continue
        server: Station = ModbusServer(
            unit,
            holding=Cells({k: 257 * k + 100 * unit for k in range(32)}),
            input=Cells({k: 999 + k for k in range(8)}),
            is_ascii=is_ascii,
            delay=delays.get(unit, (6 + 3 * unit) * MS),
        )
        if unit in change:
            server = change[unit](server)
        parties.append(Party(f"unit {unit}", server))
    if second_master:
        other = PollingMaster(
            [read_holding(unit, 24, 3) for unit in units],
            line,
            is_ascii=is_ascii,
            start=7 * MS,
            interval=0,
            pause=470 * MS,
            timeout=200 * MS,
            retries=0,
        )
        parties.append(Party("second master", other, answers=False))
    return parties


def drives(
    faults: Sequence[Fault] = (),
    *,
    extra: Sequence[bytes] = (),
    delay: int = 6 * MS,
    change: dict[int, Change] | None = None,
    numbers: tuple[int, int] = (1, 2),
    seed: int = 0,
) -> Scenario:
    """A master that asks two TECO E510 drives, which are known to be such."""
    parties = partial(_drives_parties, tuple(extra), delay, change or {}, numbers)
    devices = dict.fromkeys(numbers, "teco-e510")
    return Scenario("drives", "modbus-rtu", RTU_LINE, parties, tuple(faults), seed, Timing(RTU_LINE).t35, devices)


def _drives_parties(
    extra: tuple[bytes, ...], delay: int, change: dict[int, Change], numbers: tuple[int, int]
) -> list[Party]:
    from dissectors.modbus.simulated_e510 import SimulatedE510

    status, speed, alarm = (0x2520, 4), (0x2524, 1), (0x2528, 1)
    asked = [read_holding(unit, *block) for unit in numbers for block in (status, speed, alarm)]
    master = PollingMaster([*extra, *asked], RTU_LINE, interval=0, pause=25 * MS, timeout=200 * MS, retries=1)
    parties = [Party("master", master, answers=False)]
    for unit in numbers:
        drive: Station = SimulatedE510(unit, delay=delay)
        parties.append(Party(f"drive {unit}", change[unit](drive) if unit in change else drive))
    return parties


def n2(
    faults: Sequence[Fault] = (),
    *,
    absent: bool = False,
    delays: dict[int, int] | None = None,
    change: dict[int, Change] | None = None,
    no_such_point: bool = False,
    second_master: bool = False,
    overrides: bool = False,
    pause: int = 60 * MS,
    timeout: int = 250 * MS,
    seed: int = 0,
) -> Scenario:
    """A supervisor that polls and reads two followers. `overrides`: first it overrides two points, and releases one."""
    parties = partial(
        _n2_parties, absent, delays or {}, change or {}, no_such_point, second_master, overrides, pause, timeout
    )
    return Scenario("n2", "n2", N2_LINE, parties, tuple(faults), seed)


def _n2_parties(
    absent: bool,
    delays: dict[int, int],
    change: dict[int, Change],
    no_such_point: bool,
    second_master: bool,
    overrides: bool,
    pause: int,
    timeout: int,
) -> list[Party]:
    from dissectors.n2.f510 import POINTS
    from dissectors.n2.simulated import Follower, Master, overriding, reading, readings, releasing

    monitored = [point for point in POINTS if point.region in (1, 2)][:8]
    jobs = [*readings(1, monitored), *readings(2, monitored)]
    if absent:
        jobs.insert(5, reading(3, 1, 9))
    if no_such_point:
        jobs.insert(5, reading(1, 1, 200))
    supervisor = Master(jobs, line=N2_LINE, delay=pause, timeout=timeout)
    if overrides:
        supervisor.ask(overriding(1, 3, 1, 42.5), overriding(1, 4, 1, 1), releasing(1, 4, 1))
    parties = [Party("supervisor", supervisor, answers=False)]
    for address, delay in ((1, 10 * MS), (2, 18 * MS)):
        follower: Station = Follower(
            address, points=POINTS if overrides else monitored, delay=delays.get(address, delay)
        )
        if address in change:
            follower = change[address](follower)
        parties.append(Party(f"drive {address}", follower))
    if second_master:
        other = Master(readings(1, monitored), line=N2_LINE, delay=470 * MS, timeout=250 * MS, retries=0, start=30 * MS)
        parties.append(Party("second supervisor", other, answers=False))
    return parties


def mstp(
    faults: Sequence[Fault] = (),
    *,
    present: Sequence[int] = (1, 2, 5, 9),
    node_faults: dict[int, dict[str, object]] | None = None,
    change: dict[int, Change] | None = None,
    twin_of: int | None = None,
    polls_every: int = 50,
    requests: int = 1,
    also_logged: Sequence[tuple[int, str, str]] = (),
    seed: int = 0,
) -> Scenario:
    """A ring of four masters: a controller that asks, a logger, two drives; those `present` of them.

    `node_faults`: as `simulated.Faults`. `twin_of`: a second drive with this address. `polls_every`: tokens from poll
    to poll. `requests`: what controller and logger ask with each token, once a second unless there are several.
    `also_logged`: what the logger asks for besides: station, object, property.
    """
    parties = partial(
        _mstp_parties,
        tuple(present),
        node_faults or {},
        change or {},
        twin_of,
        polls_every,
        max(1, requests),
        tuple(also_logged),
    )
    return Scenario("mstp", "mstp", MSTP_LINE, parties, tuple(faults), seed)


def _mstp_parties(
    present: tuple[int, ...],
    node_faults: dict[int, dict[str, object]],
    change: dict[int, Change],
    twin_of: int | None,
    polls_every: int,
    requests: int,
    also_logged: tuple[tuple[int, str, str], ...],
) -> list[Party]:
    from dissectors.bacnet.application import Application
    from dissectors.bacnet.f510 import f510
    from dissectors.bacnet.simulated import Faults, Poller, SimulatedNode
    from tests.faults.ring_nodes import Greedy

    timing = Timing(MSTP_LINE)
    readings = [(mac, f"analog-input,{number}", "present-value") for number in (4, 5) for mac in (5, 9)]
    logged = [(mac, "analog-output,0", "present-value") for mac in (5, 9)] + list(also_logged)
    applications: dict[int, Application] = {
        1: Poller(readings) if requests == 1 else Greedy(readings, requests),
        2: Poller(logged) if requests == 1 else Greedy(logged, requests),
        5: f510(5),
        9: f510(9, name="fan"),
    }
    parties = []
    for mac in present:
        frames = max(requests, 2 if mac == 1 else 1)
        faults = Faults(**node_faults.get(mac, {}))  # type: ignore[arg-type]
        node: Station = SimulatedNode(
            mac,
            timing,
            applications[mac],
            max_master=31,
            max_info_frames=frames,
            polls_every=polls_every,
            faults=faults,
        )
        parties.append(Party(f"mac {mac}", change[mac](node) if mac in change else node, answers=False))
    if twin_of is not None:
        twin = SimulatedNode(twin_of, timing, f510(777), max_master=31, faults=Faults(use_delay=4 * MS))
        parties.append(Party("twin", twin, answers=False))
    return parties
