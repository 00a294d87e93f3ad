"""Faults of Metasys N2 beyond the usual ones: who is at fault, and who must not be accused."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

from dissectors.frame import Chunk
from dissectors.n2.f510 import POINTS
from dissectors.n2.simulated import Follower, Master, readings
from dissectors.simulated import Send, Station
from dissectors.simulated_faults import BitFlips, DuplicateAddress, Fault, LateResponse, LostResponse
from sniff.engine.session import Item
from sniff.simulation.scenarios import Scenario, simulate
from sniff.simulation.tap import TapModel
from sniff.simulation.wire import Party
from tests.faults.buses import MS, N2_LINE, n2
from tests.faults.case import Case, Heard, Said
from tests.faults.stations import Dies, Wrapped
from tests.faults.workbench import N2, by_turns, follower

S = 1_000 * MS


class Twinned(Wrapped):
    """A follower, and behind it another one with the same address and values of its own."""

    def __init__(self, inner: Station, address: int, after: int) -> None:
        super().__init__(inner)
        self.twin, self.after = Follower(address, points=[p for p in POINTS if p.region in (1, 2)][:8]), after
        for number in range(1, 9):
            self.twin.set(1, number, 100 + number)

    def change(self, now: int, octets: bytes, sends: tuple[Send, ...]) -> tuple[Send, ...]:
        if not sends:
            return sends
        behind = sends[-1].at + len(sends[-1].octets) * N2_LINE.char + self.after
        return (*sends, *(replace(send, at=behind) for send in self.twin.hear(now, octets, True)))


def impatient(faults: tuple[Fault, ...] = (), *, seed: int = 0) -> Scenario:
    """A supervisor that reads two followers in turn and repeats nothing."""
    return Scenario("n2", "n2", N2_LINE, _impatient_parties, faults, seed)


def _impatient_parties() -> list[Party]:
    monitored = [point for point in POINTS if point.region in (1, 2)][:8]
    jobs = [job for pair in zip(readings(1, monitored), readings(2, monitored), strict=True) for job in pair]
    parties = [Party("supervisor", Master(jobs, line=N2_LINE, delay=60 * MS, retries=0), answers=False)]
    return [*parties, *(Party(f"drive {a}", Follower(a, points=monitored, delay=15 * MS)) for a in (1, 2))]


def _edited(
    edit: Callable[[bytes], bytes], parties: tuple[str, ...], plan: Scenario, seconds: float, tap: TapModel
) -> Heard:
    """What is heard where the octets of some parties come changed; the parties themselves hear each other well."""
    session, _ = simulate(plan, seconds, tap)

    def items() -> Iterator[Item]:
        for burst in plan.wire().run(int(seconds * S)):
            octets = edit(burst.octets) if len(burst.sent) == 1 and burst.sent[0].party in parties else burst.octets
            for octet, end in zip(octets, burst.ends[-len(octets) :] if octets else (), strict=True):
                yield Chunk(end, bytes((octet,)))

    return session, items()


def _without_first(octets: bytes) -> bytes:
    return octets[1:]


def _without_last(octets: bytes) -> bytes:
    return octets[:-1]


def _swapped(octets: bytes) -> bytes:
    return octets[:-3] + octets[-2:-1] + octets[-3:-2] + octets[-1:] if len(octets) > 4 else octets


def _with_start_in_sum(octets: bytes) -> bytes:
    """Its checksum counts the `A`, which belongs to none."""
    return octets[:-3] + b"%02X" % ((int(octets[-3:-1], 16) + 0x41) & 0xFF) + octets[-1:] if len(octets) > 4 else octets


def _nothing(octets: bytes) -> bytes:
    return b""


def _empty(octets: bytes) -> bytes:
    """An acknowledge without the value."""
    return b"A\r" if octets[:1] == b"A" else octets


_INNOCENT = ("N2007", "N2008")
_DRIVE = (("N2012", "station 2"),)

N2_RULE_CASES: tuple[Case, ...] = (
    Case(
        "N2 slow station and lost answers of another",
        partial(n2, (LostResponse(0.1, ("drive 1",)),), delays={2: 260 * MS}),
        (("N2011", "station 2"), ("N2005", "station 1")),
        seconds=40,
        never=("N2008",),
        seeds=2,
    ),
    Case(
        "N2 station dies beside noise",
        partial(n2, (BitFlips(0.001),), change={2: partial(Dies, at=10 * S)}),
        (Said(("station 2",), words="none to the last", own_words=True), ("N2004", "bus")),
        seconds=30,
        seeds=2,
    ),
    Case(
        "N2 answered twice",
        partial(n2, change={2: partial(Twinned, address=2, after=3 * MS)}, pause=150 * MS),
        (("N2008", "station 2"),),
        never=("N2007",),
    ),
    Case(
        "N2 same answer again",
        partial(n2, (DuplicateAddress("drive 2", 120 * MS),), pause=400 * MS),
        (("N2013", "station 2"),),
        never=_INNOCENT,
    ),
    Case(
        "N2 late in another's turn",
        partial(impatient, (LateResponse(0.06, 300 * MS, ("drive 2",)),)),
        (("N2011", "station 2"),),
        never=_INNOCENT,
    ),
    Case(
        "N2 checksum off", n2, _DRIVE, hear=partial(_edited, _with_start_in_sum, ("drive 2",)), never=_INNOCENT, seeds=1
    ),
    Case(
        "N2 one drive not heard here",
        n2,
        (("N2015", "bus"),),
        hear=partial(_edited, _nothing, ("drive 2",)),
        never=("N2005", *_INNOCENT),
    ),
    Case(
        "N2 only the master heard",
        n2,
        (("N2015", "bus"),),
        hear=partial(_edited, _nothing, ("drive 1", "drive 2")),
        never=("N2005", *_INNOCENT),
        seeds=1,
    ),
    Case(
        "N2 reads acknowledged without a value",
        partial(n2, pause=150 * MS),
        (("N2016", "station 2"),),
        hear=partial(_edited, _empty, ("drive 2",)),
        never=_INNOCENT,
    ),
    Case("N2 bit errors everywhere", partial(n2, (BitFlips(4e-3),)), (("N2004", "bus"),), never=_INNOCENT),
    Case(
        "N2 bit errors of the master",
        partial(n2, (BitFlips(8e-3, ("supervisor",)),)),
        (("N2004", "master"),),
        struck=("station 1", "station 2"),
        never=_INNOCENT,
    ),
    Case("N2 first octet missing", n2, _DRIVE, hear=partial(_edited, _without_first, ("drive 2",)), never=_INNOCENT),
    Case("N2 last octet missing", n2, _DRIVE, hear=partial(_edited, _without_last, ("drive 2",)), never=_INNOCENT),
    Case("N2 checksum swapped", n2, _DRIVE, hear=partial(_edited, _swapped, ("drive 2",)), never=_INNOCENT),
    Case(
        "N2 first octet of all missing",
        n2,
        (("N2012", "bus"),),
        hear=partial(_edited, _without_first, ("drive 1", "drive 2")),
        never=_INNOCENT,
    ),
    Case(
        "N2 first octet of the only one missing",
        N2(partial(by_turns, 5, count=4), {"drive 5": partial(follower, 5)}),
        (("N2012", "bus"),),
        hear=partial(_edited, _without_first, ("drive 5",)),
        never=_INNOCENT,
    ),
    Case(
        "N2 first octet of commands missing",
        n2,
        (("N2012", "master"),),
        hear=partial(_edited, _without_first, ("supervisor",)),
        never=_INNOCENT,
    ),
)
