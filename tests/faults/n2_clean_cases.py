"""N2 buses on which nothing is wrong, though it may look so: slow stations, brisk masters, scans, a busy computer."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from random import Random

from dissectors.frame import Chunk
from dissectors.n2.f510 import POINTS
from dissectors.n2.simulated import Follower, Master, command, readings
from dissectors.simulated import Send
from sniff.simulation.scenarios import Scenario, simulate
from sniff.simulation.tap import CH340, EXACT, FTDI, FTDI_LOW_LATENCY, OCTETS, UART, TapModel
from sniff.simulation.wire import Party
from tests.bus_delivery import stalled
from tests.faults.buses import MS, N2_LINE, n2
from tests.faults.case import Case, Heard
from tests.faults.uneven_stations import Waits

TAPS = (EXACT, FTDI, OCTETS, FTDI_LOW_LATENCY, UART, CH340)


class Scanner:
    """A tool that asks every address twice who it is, once, and does not wait long."""

    def __init__(self, addresses: Sequence[int], timeout: int) -> None:
        self.left = [command(address, "F") for address in addresses for _ in range(2)]
        self.timeout, self.due = timeout, 0

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        self.due = now + 5 * MS
        return ()

    def wake(self, now: int) -> tuple[Send, ...]:
        if now < self.due or not self.left:
            return ()
        octets = self.left.pop(0)
        self.due = now + len(octets) * N2_LINE.char + self.timeout
        return (Send(now, octets),)

    def next_wake(self) -> int | None:
        return self.due if self.left else None


def scan(timeout: int = 50 * MS, *, seed: int = 0) -> Scenario:
    """A scan over all addresses, of which three are there."""
    return Scenario("n2", "n2", N2_LINE, partial(_scan_parties, timeout), (), seed)


def _scan_parties(timeout: int) -> list[Party]:
    parties = [Party("tool", Scanner(range(1, 256), timeout), answers=False)]
    return [*parties, *(Party(f"drive {address}", Follower(address)) for address in (5, 42, 250))]


def many(*, seed: int = 0) -> Scenario:
    """A supervisor that goes round twelve followers with all their points and little pause."""
    return Scenario("n2", "n2", N2_LINE, _many_parties, (), seed)


def _many_parties() -> list[Party]:
    jobs = [job for address in range(1, 13) for job in readings(address, POINTS[:6])]
    supervisor = Party("supervisor", Master(jobs, line=N2_LINE, delay=3 * MS), answers=False)
    return [supervisor, *(Party(f"drive {a}", Follower(a, delay=(2 + a) * MS)) for a in range(1, 13))]


def _busy(plan: Scenario, seconds: float, tap: TapModel) -> Heard:
    """The same heard by a computer that in one of fifty reads comes up to 80 ms late, and cannot say so."""
    session, items = simulate(plan, seconds, tap)
    chunks = [item for item in items if isinstance(item, Chunk)]
    return session, iter(stalled(chunks, Random(plan.seed), 0.02, 80 * MS))


def n2_clean_cases(seconds: float) -> Iterator[Case]:
    """Nothing may be found at warning or above, through any adapter (through two where it must be quick)."""
    uneven = partial(n2, change={2: partial(Waits, spread=120 * MS)})
    for tap in TAPS if seconds > 60 else (EXACT, FTDI):
        for delay in (300, 900, 2500):
            slow = partial(n2, delays={2: delay * MS}, timeout=3000 * MS)
            yield Case(f"N2 clean, {delay} ms, {tap.name}", slow, (), tap, seconds)
        yield Case(
            f"N2 clean, hardly a pause, {tap.name}", partial(n2, pause=2 * MS, delays={1: 2 * MS}), (), tap, seconds
        )
        yield Case(f"N2 clean, uneven, {tap.name}", uneven, (), tap, seconds, never=("N2007", "N2008", "N2013"))
        yield Case(f"N2 clean, many, {tap.name}", many, (), tap, seconds)
        yield Case(f"N2 scan, {tap.name}", scan, (), tap, 120)
        yield Case(f"N2 slow scan, {tap.name}", partial(scan, 300 * MS), (), tap, 240)
        yield Case(f"N2 clean, busy computer, {tap.name}", n2, (), tap, seconds, hear=_busy)
        yield Case(f"N2 many, busy computer, {tap.name}", many, (), tap, seconds, hear=_busy)
