"""Named buses, ready to listen to: who is on them, how the line runs, what goes wrong. For `demo` and for tests.

A scenario is data, and each protocol brings its own (`Dissector.scenarios`); its stations are made where the bus runs.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial

from dissectors import registry
from dissectors.line import NS_PER_S, LineSettings, Timing
from dissectors.manifest import Dissector
from dissectors.simulated import SimulatedBus
from dissectors.simulated_faults import Fault
from sniff.engine.session import DEVICES_NOTE, Item, Session
from sniff.simulation.tap import EXACT, Tap, TapModel
from sniff.simulation.wire import Burst, Factory, Wire


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
    return tuple(_known())


def scenario(name: str, seed: int = 0, faults: bool = True, line: LineSettings | None = None) -> Scenario:
    """The scenario of that name. Raises UnknownScenario.

    `faults`: with its usual ones, else a perfect bus. `line`: instead of the settings that it usually runs at.
    """
    known = _known()
    if name not in known:
        raise UnknownScenario(f"scenario {name!r}: expected one of {', '.join(known)}")
    dissector, bus = known[name]
    line = line or LineSettings.parse(bus.line or dissector.default_line)
    return Scenario(
        name=name,
        protocol=dissector.name,
        line=line,
        stations=partial(bus.parties, line, faults),
        faults=bus.faults if faults else (),
        seed=seed,
        gap=bus.gap(Timing(line)),
        devices=bus.devices,
        text="; ".join(said for said in (bus.text, bus.misbehaving if faults else "") if said),
    )


def _known() -> Mapping[str, tuple[Dissector, SimulatedBus]]:
    """Every scenario with its protocol, by name; of one that two protocols bring, the first one's."""
    known: dict[str, tuple[Dissector, SimulatedBus]] = {}
    for one in registry.usable():
        for name, bus in one.scenarios().items():
            known.setdefault(name, (one, bus))
    return known


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
