"""Named buses, ready to listen to: who is on them, how the line runs, what goes wrong. For `demo` and for tests.

A scenario is data; its stations are made where the bus runs, by a function of this file that imports the protocol's
simulated stations only then. A new one is one function and one line in SCENARIOS.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import cycle

from dissectors.frame import Place
from dissectors.line import LineSettings, Timing
from sniff.engine.session import DEVICES_NOTE, Item, Session
from sniff.simulation.faults import (
    BitFlips,
    Break,
    CutShort,
    EarlyRelease,
    Fault,
    LateResponse,
    LostResponse,
    NoiseInGaps,
)
from sniff.simulation.tap import EXACT, Tap, TapModel
from sniff.simulation.wire import Burst, Factory, Party, Wire

MS = 1_000_000
NS_PER_S = 1_000_000_000


@dataclass(frozen=True, slots=True)
class Scenario:
    """One bus as it is meant to be.

    `name`: of the scenario; `protocol`: a registry name. `stations`: makes the parties, afresh for each run, in any
    process. `gap`: ns of silence that the protocol wants before a frame. `devices`: device profiles by address.
    `text`: who is there and what is wrong, in a line for people.
    """

    name: str
    protocol: str
    line: LineSettings
    stations: Factory
    faults: tuple[Fault, ...] = ()
    seed: int = 0
    gap: int = 0
    devices: Mapping[int, str] = field(default_factory=dict)
    text: str = ""

    def wire(self) -> Wire:
        """The bus in simulated time, before anything has happened."""
        return Wire(self.line, self.stations(), self.faults, self.seed, self.gap)


class UnknownScenario(LookupError):
    """No such scenario; the message lists those there are."""


def names() -> tuple[str, ...]:
    """Names of all scenarios."""
    return tuple(SCENARIOS)


def scenario(name: str, seed: int = 0, faults: bool = True, line: LineSettings | None = None) -> Scenario:
    """The scenario of that name. Raises UnknownScenario.

    `faults`: with its usual ones, else a perfect bus. `line`: instead of the settings that it usually runs at.
    """
    entry = SCENARIOS.get(name)
    if entry is None:
        raise UnknownScenario(f"scenario {name!r}: expected one of {', '.join(SCENARIOS)}")
    usual, make = entry
    made = make(line or LineSettings.parse(usual), faults)
    return replace(made, name=name, seed=seed, faults=made.faults if faults else ())


def simulate(plan: Scenario, seconds: float, tap: TapModel = EXACT, started: int = 0) -> tuple[Session, Iterator[Item]]:
    """Run a scenario as fast as it goes; give what a sniffer behind that adapter reads, lazily.

    `started`: ns since the epoch at which the capture begins; all times count from there.
    """
    session = Session(
        port=f"simulated:{plan.name}",
        line=plan.line,
        protocol=plan.protocol,
        started=started,
        adapter=tap.adapter(plan.line),
        notes={"scenario": plan.name, "seed": str(plan.seed), **_devices_note(plan)},
    )
    items = Tap(plan.line, tap, plan.seed).tap(plan.wire().run(int(seconds * NS_PER_S)))
    return session, (replace(item, time=item.time + started) for item in items) if started else items


def _devices_note(plan: Scenario) -> dict[str, str]:
    said = ",".join(f"{address}={profile}" for address, profile in plan.devices.items())
    return {DEVICES_NOTE: said} if said else {}


def bursts(plan: Scenario, seconds: float) -> Iterator[Burst]:
    """The same run with its ground truth: what the line carried and what became of each transmission."""
    return plan.wire().run(int(seconds * NS_PER_S))


# ---- Modbus: three drives and a master that asks for one more


class _InTurn:
    """A request of a polling master that is another one each time."""

    def __init__(self, *requests: bytes) -> None:
        self._requests = cycle(requests)

    def __call__(self, now: int) -> bytes:
        return next(self._requests)


def _modbus_parties(line: LineSettings, is_ascii: bool, busy: bool) -> list[Party]:
    from dissectors.modbus.simulated_e510 import SimulatedE510
    from dissectors.modbus.simulated_master import PollingMaster, read_holding, write_register, write_registers

    run, stop, command, frequency, no_such_parameter = 1, 0, 0x2501, 0x2502, 0x0064
    seldom = _InTurn(
        write_registers(1, command, [run, 3_000]),
        write_register(2, frequency, 4_500),
        write_register(2, command, run),
        read_holding(4, 0x2520, 4),  # nobody there
        b"\x03\x08\x00\x00\xa5\x37",  # loopback
        write_registers(3, command, [run, 5_000]),
        read_holding(2, no_such_parameter, 1),
        write_register(1, frequency, 6_000),
        read_holding(1, 0x2520, 16),
        read_holding(4, 0x2520, 4),
        write_register(3, frequency, 1_250),
        write_register(2, 0x2526, 1),  # read only
        write_register(1, command, stop),
        read_holding(2, 0x2510, 2),
        write_register(2, command, stop),
        write_register(0, command, stop),  # to all
    )
    status, speed, dc_bus = (0x2520, 4), (0x2524, 1), (0x2526, 2)
    often = [read_holding(unit, *block) for block in (status, speed, dc_bus) for unit in (1, 2, 3)]
    master = PollingMaster(
        [*often, seldom],
        line,
        is_ascii=is_ascii,
        interval=0 if busy else NS_PER_S,
        pause=2 * MS if busy else 65 * MS,
        timeout=300 * MS,
        retries=1,
    )
    drives = [
        Party(f"drive {unit}", SimulatedE510(unit, is_ascii=is_ascii, delay=MS if busy else delay, ramp=ramp))
        for unit, delay, ramp in ((1, 10 * MS, 1_000), (2, 6 * MS, 2_000), (3, 14 * MS, 400))
    ]
    return [Party("master", master, answers=False), *drives]


def _modbus(protocol: str, busy: bool, line: LineSettings, faults: bool) -> Scenario:
    is_ascii = protocol == "modbus-ascii"
    return Scenario(
        name=protocol,
        protocol=protocol,
        line=line,
        stations=partial(_modbus_parties, line, is_ascii, busy),
        faults=(
            BitFlips(2e-4),
            EarlyRelease(0.01, ("drive 3",)),
            LostResponse(0.004),
            LateResponse(0.003, 320 * MS),
            NoiseInGaps(0.01),
            Break(0.0005),
        ),
        gap=0 if is_ascii else Timing(line).t35,
        devices=dict.fromkeys((1, 2, 3), "teco-e510"),
        text="three TECO E510 drives; unit 4 is absent, drive 3 lets go of the line too early now and then",
    )


# ---- N2: two drives under a supervisor


def _n2_parties(line: LineSettings) -> list[Party]:
    from dissectors.n2.f510 import POINTS
    from dissectors.n2.simulated import Follower, Master, overriding, reading, readings, releasing

    monitored = [point for point in POINTS if point.region in (1, 2)]
    jobs = [
        *readings(1, monitored),
        overriding(1, 3, 1, 45.0),
        overriding(1, 4, 1, 1),
        *readings(2, monitored),
        overriding(2, 3, 1, 30.0),
        overriding(2, 4, 1, 1),
        reading(3, 1, 9),  # nobody there
        overriding(1, 3, 1, 900.0),  # out of range
        releasing(1, 3, 1),
    ]
    master = Master(jobs, line=line, delay=60 * MS, timeout=250 * MS, retries=1)
    return [
        Party("supervisor", master, answers=False),
        Party("drive 1", Follower(1, delay=10 * MS)),
        Party("drive 2", Follower(2, delay=18 * MS)),
    ]


def _n2(line: LineSettings, faults: bool) -> Scenario:
    return Scenario(
        name="n2",
        protocol="n2",
        line=line,
        stations=partial(_n2_parties, line),
        faults=(
            BitFlips(2e-4),
            LostResponse(0.004),
            LateResponse(0.003, 270 * MS),
            NoiseInGaps(0.01, places=(Place.BETWEEN, Place.AFTER)),
            Break(0.0005),
        ),
        devices=dict.fromkeys((1, 2), "teco-f510"),
        text="two TECO F510 drives under a supervisor; address 3 is absent",
    )


# ---- BACnet MS/TP: a ring of four masters


def _mstp_parties(line: LineSettings, faults: bool) -> list[Party]:
    from dissectors.bacnet.f510 import f510
    from dissectors.bacnet.simulated import Faults, Node, Poller

    timing = Timing(line)
    drive, fan = 5, 9
    readings = [(mac, f"analog-input,{number}", "present-value") for number in (4, 5, 0, 3) for mac in (drive, fan)]
    controller = Poller([*readings, (drive, "device,5", "object-name"), (fan, "analog-input,99", "present-value")])
    logger = Poller([(drive, "analog-output,0", "present-value"), (fan, "analog-output,0", "present-value")])
    forgetful = Faults(loses_token_every=700, postpones=True) if faults else Faults(postpones=True)
    nodes = {
        "controller": Node(1, timing, controller, max_master=31, max_info_frames=2),
        "logger": Node(2, timing, logger, max_master=31),
        "drive": Node(drive, timing, f510(drive), max_master=127),
        "fan": Node(fan, timing, f510(fan, name="fan"), max_master=31, faults=forgetful),
    }
    return [Party(name, node, answers=False) for name, node in nodes.items()]


def _mstp(line: LineSettings, faults: bool) -> Scenario:
    return Scenario(
        name="mstp",
        protocol="mstp",
        line=line,
        stations=partial(_mstp_parties, line, faults),
        faults=(
            BitFlips(2e-5),
            CutShort(0.0005),
            NoiseInGaps(0.002, places=(Place.AFTER,)),
            Break(0.0002),
        ),
        devices=dict.fromkeys((5, 9), "teco-f510"),
        text="four masters, two of them TECO F510 drives; the drive at 9 drops the token now and then",
    )


SCENARIOS: Mapping[str, tuple[str, Callable[[LineSettings, bool], Scenario]]] = {
    "modbus-rtu": ("19200,8E1", partial(_modbus, "modbus-rtu", False)),
    "modbus-ascii": ("19200,7E1", partial(_modbus, "modbus-ascii", False)),
    "modbus-rtu-busy": ("115200,8E1", partial(_modbus, "modbus-rtu", True)),
    "n2": ("9600,8N1", _n2),
    "mstp": ("38400,8N1", _mstp),
}
"""Usual line settings and maker of each scenario, by name. The maker is told whether stations may misbehave, too."""
