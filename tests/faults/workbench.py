"""Buses put together part by part: who asks what, who answers how, who else is on the line."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from dissectors.bacnet.application import Application
from dissectors.line import LineSettings, Timing
from dissectors.modbus.simulated import Cells, ModbusServer
from dissectors.modbus.simulated_master import PollingMaster, read_holding
from dissectors.simulated import Station
from dissectors.simulated_faults import Fault
from sniff.simulation.scenarios import Scenario
from sniff.simulation.wire import Party
from tests.faults.buses import ASCII_LINE, MSTP_LINE, N2_LINE, RTU_LINE, Change

MS = 1_000_000

Maker = Callable[..., Station]
"""Makes one more party; called with `seed`."""


def unchanged(station: Station) -> Station:
    """A station that does well."""
    return station


# ---- Modbus


def server(unit: int, *, delay: int = 8 * MS, is_ascii: bool = False, words: int = 128) -> ModbusServer:
    """A server with registers and bits that do not change by themselves."""
    return ModbusServer(
        unit,
        holding=Cells({k: 257 * k + 100 * unit for k in range(words)}),
        input=Cells({k: 999 + k + 16 * unit for k in range(words)}),
        coils=Cells(dict.fromkeys(range(64), 0)),
        discrete=Cells({k: k % 3 == 0 for k in range(64)}),
        is_ascii=is_ascii,
        delay=delay,
    )


@dataclass(frozen=True)
class Modbus:
    """A Modbus bus. Called with faults and seed it gives the scenario.

    `stations`: makers by unit; `change`: what to make of them. `master`: makes the master of requests and line.
    `others`: further parties by name. `asked`: asked round and round.
    """

    asked: tuple[bytes, ...] = ()
    stations: Mapping[int, Callable[[], Station]] = field(default_factory=dict)
    faults: tuple[Fault, ...] = ()
    change: Mapping[int, Change] = field(default_factory=dict)
    others: Mapping[str, Maker] = field(default_factory=dict)
    master: Callable[..., Station] = PollingMaster
    change_master: Change = unchanged
    is_ascii: bool = False
    line: LineSettings | None = None
    timeout: int = 200 * MS
    retries: int = 1
    pause: int = 25 * MS
    turnaround: int = 100 * MS
    interval: int = 0
    devices: Mapping[int, str] = field(default_factory=dict)

    def __call__(self, *, seed: int = 0) -> Scenario:
        line = self.line or (ASCII_LINE if self.is_ascii else RTU_LINE)
        name = "modbus-ascii" if self.is_ascii else "modbus-rtu"
        gap = 0 if self.is_ascii else Timing(line).t35
        return Scenario(name, name, line, partial(self._parties, line, seed), self.faults, seed, gap, self.devices)

    def _parties(self, line: LineSettings, seed: int) -> list[Party]:
        settings: dict[str, Any] = {"is_ascii": True} if self.is_ascii else {}
        master = self.master(
            self.asked,
            line,
            interval=self.interval,
            pause=self.pause,
            timeout=self.timeout,
            retries=self.retries,
            turnaround=self.turnaround,
            **settings,
        )
        parties = [Party("master", self.change_master(master), answers=False)]
        for unit, make in self.stations.items():
            parties.append(Party(f"unit {unit}", self.change.get(unit, unchanged)(make())))
        return parties + [Party(name, make(seed=seed), answers=False) for name, make in self.others.items()]


def usual_requests(units: Sequence[int], quantity: int = 6) -> tuple[bytes, ...]:
    """Two reads a unit, one unit after the other."""
    return tuple(read_holding(unit, start, quantity) for start in (0, 16) for unit in units)


def usual_stations(units: Sequence[int], *, is_ascii: bool = False, **delays: int) -> dict[int, Callable[[], Station]]:
    """Servers that answer after 6 ms and some more; `unit_2=…`: ns until unit 2 answers."""
    return {
        unit: partial(server, unit, delay=delays.get(f"unit_{unit}", (6 + 2 * unit) * MS), is_ascii=is_ascii)
        for unit in units
    }


# ---- N2


@dataclass(frozen=True)
class N2:
    """An N2 bus: `jobs` makes what is asked in turn, `followers` makes the stations by name."""

    jobs: Callable[[], Sequence[Any]]
    followers: Mapping[str, Callable[[], Station]]
    faults: tuple[Fault, ...] = ()
    others: Mapping[str, Maker] = field(default_factory=dict)
    change_master: Change = unchanged
    pause: int = 60 * MS
    timeout: int = 250 * MS
    retries: int = 3
    devices: Mapping[int, str] = field(default_factory=dict)

    def __call__(self, *, seed: int = 0) -> Scenario:
        return Scenario("n2", "n2", N2_LINE, partial(self._parties, seed), self.faults, seed, 0, self.devices)

    def _parties(self, seed: int) -> list[Party]:
        from dissectors.n2.simulated import Master

        master = Master(self.jobs(), line=N2_LINE, delay=self.pause, timeout=self.timeout, retries=self.retries)
        parties = [Party("supervisor", self.change_master(master), answers=False)]
        parties += [Party(name, make()) for name, make in self.followers.items()]
        return parties + [Party(name, make(seed=seed), answers=False) for name, make in self.others.items()]


def follower(
    address: int, delay: int = 10 * MS, *, values: Mapping[tuple[int, int], float] | None = None, few: bool = False
) -> Station:
    """A drive; `values`: what some of its points have, by region and number. `few`: only those read `by_turns`, so
    that its reports are short."""
    from dissectors.n2.f510 import POINTS
    from dissectors.n2.simulated import Follower

    points = [point for point in POINTS if point.region in (1, 2)][:6] if few else POINTS
    made = Follower(address, points=points, delay=delay)
    for (region, number), value in (values or {}).items():
        made.set(region, number, value)
    return made


def by_turns(*addresses: int, count: int = 6) -> Sequence[Any]:
    """Readings of several drives, one after the other's."""
    from dissectors.n2.f510 import POINTS
    from dissectors.n2.simulated import reading

    monitored = [point for point in POINTS if point.region in (1, 2)][:count]
    return [reading(address, point.region, point.number) for point in monitored for address in addresses]


# ---- BACnet MS/TP


@dataclass(frozen=True)
class Member:
    """A master of the ring: its number, what it does with data, and how it misbehaves."""

    mac: int
    application: Callable[[], Application]
    change: Change = unchanged
    settings: Mapping[str, Any] = field(default_factory=dict)
    """As `simulated.Node` takes them; `faults` as a mapping."""


@dataclass(frozen=True)
class Ring:
    """A token ring of members, and others on its line."""

    members: tuple[Member, ...]
    faults: tuple[Fault, ...] = ()
    others: Mapping[str, Maker] = field(default_factory=dict)
    devices: Mapping[int, str] = field(default_factory=dict)

    def __call__(self, *, seed: int = 0) -> Scenario:
        return Scenario("mstp", "mstp", MSTP_LINE, partial(self._parties, seed), self.faults, seed, 0, self.devices)

    def _parties(self, seed: int) -> list[Party]:
        from dissectors.bacnet.simulated import Faults, SimulatedNode

        parties = []
        for member in self.members:
            settings = {"max_master": 31, **member.settings}
            faults = Faults(**settings.pop("faults", {}))
            node = SimulatedNode(member.mac, Timing(MSTP_LINE), member.application(), faults=faults, **settings)
            parties.append(Party(f"mac {member.mac}", member.change(node), answers=False))
        return parties + [Party(name, make(seed=seed), answers=False) for name, make in self.others.items()]
