"""Buses on which nothing is wrong, one a protocol, each with places where a fault can be put in."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from dissectors.line import LineSettings, Timing
from dissectors.modbus.simulated import Cells, ModbusServer
from dissectors.modbus.simulated_master import PollingMaster, read_holding, write_register
from dissectors.simulated import Station
from sniff.simulation.faults import Fault
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


def n2(
    faults: Sequence[Fault] = (),
    *,
    absent: bool = False,
    delays: dict[int, int] | None = None,
    change: dict[int, Change] | None = None,
    no_such_point: bool = False,
    second_master: bool = False,
    seed: int = 0,
) -> Scenario:
    """A supervisor that polls and reads two followers."""
    parties = partial(_n2_parties, absent, delays or {}, change or {}, no_such_point, second_master)
    return Scenario("n2", "n2", N2_LINE, parties, tuple(faults), seed)


def _n2_parties(
    absent: bool, delays: dict[int, int], change: dict[int, Change], no_such_point: bool, second_master: bool
) -> list[Party]:
    from dissectors.n2.f510 import POINTS
    from dissectors.n2.simulated import Follower, Master, reading, readings

    monitored = [point for point in POINTS if point.region in (1, 2)][:8]
    jobs = [*readings(1, monitored), *readings(2, monitored)]
    if absent:
        jobs.insert(5, reading(3, 1, 9))
    if no_such_point:
        jobs.insert(5, reading(1, 1, 200))
    parties = [Party("supervisor", Master(jobs, line=N2_LINE, delay=60 * MS, timeout=250 * MS), answers=False)]
    for address, delay in ((1, 10 * MS), (2, 18 * MS)):
        follower: Station = Follower(address, points=monitored, delay=delays.get(address, delay))
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
    node_faults: dict[int, dict[str, object]] | None = None,
    twin_of: int | None = None,
    seed: int = 0,
) -> Scenario:
    """A ring of four masters: a controller that asks, a logger, two drives. `node_faults`: as `simulated.Faults`."""
    return Scenario("mstp", "mstp", MSTP_LINE, partial(_mstp_parties, node_faults or {}, twin_of), tuple(faults), seed)


def _mstp_parties(node_faults: dict[int, dict[str, object]], twin_of: int | None) -> list[Party]:
    from dissectors.bacnet.f510 import f510
    from dissectors.bacnet.simulated import Faults, Node, Poller

    timing = Timing(MSTP_LINE)

    def faults(mac: int) -> Faults:
        return Faults(**node_faults.get(mac, {}))  # type: ignore[arg-type]

    readings = [(mac, f"analog-input,{number}", "present-value") for number in (4, 5) for mac in (5, 9)]
    logger = Poller([(5, "analog-output,0", "present-value"), (9, "analog-output,0", "present-value")])
    nodes = [
        Node(1, timing, Poller(readings), max_master=31, max_info_frames=2, faults=faults(1)),
        Node(2, timing, logger, max_master=31, faults=faults(2)),
        Node(5, timing, f510(5), max_master=31, faults=faults(5)),
        Node(9, timing, f510(9, name="fan"), max_master=31, faults=faults(9)),
    ]
    parties = [Party(f"mac {node.mac}", node, answers=False) for node in nodes]
    if twin_of is not None:
        parties.append(Party("twin", Node(twin_of, timing, f510(twin_of), max_master=31), answers=False))
    return parties
