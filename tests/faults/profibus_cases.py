"""Faults of PROFIBUS: a ring of two masters with two drives and a valve, and what is wrong with it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

from dissectors.frame import Place
from dissectors.line import LineSettings
from dissectors.profibus.f510 import RUN, drive, outputs
from dissectors.profibus.simulated_master import Job, Master, RingBehaviour
from dissectors.profibus.simulated_slave import Slave
from dissectors.profibus.telegram import SC, SD2, Telegram, parse, telegram
from dissectors.simulated import Send, Station
from dissectors.simulated_faults import BitFlips, CutShort, Fault, LostResponse, NoiseInGaps
from sniff.simulation.scenarios import Scenario
from sniff.simulation.tap import FTDI
from sniff.simulation.wire import Party
from tests.faults.buses import MS, Change
from tests.faults.case import Case, Said
from tests.faults.profibus_stations import KeepsToken, NeverReady, Off, from_the_middle
from tests.faults.stations import Dies, Wrapped

LINE = LineSettings.parse("187500,8E1")
S = 1_000 * MS
VALVE = b"\x11\x20"
RING = RingBehaviour(cycle=40 * MS)


def running(now: int) -> bytes:
    """A drive that is told to run at 40 Hz."""
    return outputs(RUN, 40)


def no_output(now: int) -> bytes:
    """One octet, zero."""
    return b"\0"


def profibus(
    faults: Sequence[Fault] = (),
    *,
    absent: Sequence[int] = (),
    change: dict[str, Change] | None = None,
    slave: Callable[[], Station] | None = None,
    ring: RingBehaviour = RING,
    also_second: Sequence[int] = (),
    rogue: bool = False,
    also: dict[str, Callable[[], Station]] | None = None,
    others: Sequence[int] = (),
    seed: int = 0,
) -> Scenario:
    """A controller with drives 5 and 6, a second master with valve 12.

    `absent`: slaves of the controller that are not there. `change`: what to make of a party. `slave`: who is drive 6
    instead. `ring`: of the controller. `also_second`: slaves that the second master wants too. `rogue`: a tool at
    address 3 asks without a token. `also`: further stations; `others`: those of them in the ring.
    """
    added: dict[str, Callable[[], Station]] = {**(also or {}), **({"tool": Tool} if rogue else {})}
    parties = partial(_parties, tuple(absent), change or {}, slave, ring, tuple(also_second), added, tuple(others))
    return Scenario("profibus", "profibus", LINE, parties, tuple(faults), seed)


def _parties(
    absent: tuple[int, ...],
    change: dict[str, Change],
    slave: Callable[[], Station] | None,
    ring: RingBehaviour,
    also_second: tuple[int, ...],
    added: dict[str, Callable[[], Station]],
    others: tuple[int, ...],
) -> list[Party]:
    jobs = [Job(address, outputs=running) for address in (5, 6, *absent)]
    second = [Job(12, 0x80C8, VALVE, no_output, user=b""), *(Job(address, outputs=running) for address in also_second)]
    stations: dict[str, Station] = {
        "controller": Master(1, LINE, jobs, others=(2, *others), ring=ring),
        "second master": Master(2, LINE, second, others=(1, *others), ring=replace(RING, highest=ring.highest)),
        "drive 5": Slave(5, LINE, process=drive, tsdr=40),
        "drive 6": slave() if slave is not None else Slave(6, LINE, process=drive, tsdr=50),
        "valve": Slave(12, LINE, ident=0x80C8, configuration=VALVE),
    }
    stations |= {name: make() for name, make in added.items()}
    return [
        Party(name, change.get(name, _same)(station), answers=isinstance(station, Slave | Wrapped))
        for name, station in stations.items()
    ]


def _same(station: Station) -> Station:
    return station


class Tool:
    """Asks drive 5 for its diagnosis seven times a second, whoever holds the token."""

    def __init__(self) -> None:
        self._next = 1 * S

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        return ()

    def wake(self, now: int) -> tuple[Send, ...]:
        if now < self._next:
            return ()
        self._next = now + 143 * MS
        return (Send(now, telegram(5, 3, 0x4D, dsap=60, ssap=62)),)

    def next_wake(self) -> int:
        return self._next


class Deaf(Wrapped):
    """A master that does not hear every twentieth answer of one slave."""

    def __init__(self, inner: Station, address: int) -> None:
        super().__init__(inner)
        self.address, self.count = address, 0

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        told = parse(octets)
        if told.control is not None and not told.is_request and told.source == self.address:
            self.count += 1
            if self.count % 20 == 0:
                return ()
        return super().hear(now, octets, quiet)


class Picky(Slave):
    """A slave that takes no parameters."""

    def _parameterised(self, heard: Telegram, now: int) -> bytes:
        self.reset()
        self._fault = 0x40
        return bytes((SC,))


class Restarts(Slave):
    """A slave that loses everything every four seconds."""

    _restarted = 0

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        if now // (4 * S) > self._restarted:
            self._restarted = now // (4 * S)
            self.reset()
        return super().hear(now, octets, quiet)


class Twin(Wrapped):
    """A slave, and behind it another one with the same address and values of its own."""

    def change(self, now: int, octets: bytes, sends: tuple[Send, ...]) -> tuple[Send, ...]:
        more = []
        for send in sends:
            told = parse(send.octets)
            if len(told.data) == 32 and told.source is not None and told.destination is not None:
                behind = send.at + len(send.octets) * LINE.char + LINE.bits(20)
                more.append(Send(behind, telegram(told.destination, told.source, 0x08, bytes(32))))
        return (*sends, *more)


class Refuses(Wrapped):
    """A slave without room for every tenth of its requests."""

    count = 0

    def change(self, now: int, octets: bytes, sends: tuple[Send, ...]) -> tuple[Send, ...]:
        asked = parse(octets)
        self.count += bool(sends)
        if not sends or self.count % 10 or asked.source is None or asked.destination is None or asked.dsap is not None:
            return sends
        return (replace(sends[0], octets=telegram(asked.source, asked.destination, 0x02)),)


class FallsSilent(Wrapped):
    """A master that stops for two seconds while it holds the token, every five seconds."""

    def __init__(self, inner: Station) -> None:
        super().__init__(inner)
        self.until, self.next = 0, 4 * S

    def wake(self, now: int) -> tuple[Send, ...]:
        if now < self.until:
            return ()
        sends = self.inner.wake(now)
        if now >= self.next and sends and sends[0].octets[0] == SD2:
            self.until, self.next = now + 2 * S, now + 5 * S
        return sends

    def next_wake(self) -> int | None:
        due = self.inner.next_wake()
        return None if due is None else max(due, self.until)


class Dozes(Wrapped):
    """A master that now and then takes a token only after it was sent once more."""

    def __init__(self, inner: Station) -> None:
        super().__init__(inner)
        self.count, self.until = 0, 0

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        if parse(octets).is_token:
            self.count += 1
            if self.count % 20 == 0:
                return ()  # not heard; the next one is
        return super().hear(now, octets, quiet)


def _trouble(now: int) -> bytes:
    return b"\x80\x41\xa6" if now > 2 * S else b""


def _valve_with_trouble(station: Station) -> Station:
    return Slave(12, LINE, ident=0x80C8, configuration=VALVE, trouble=_trouble)


_SIX = ("station 6",)

PROFIBUS_CASES: tuple[Case, ...] = (
    Case("PROFIBUS station absent", partial(profibus, absent=(9,)), (("PB001", "station 9"),)),
    Case("PROFIBUS answers lost", partial(profibus, (LostResponse(0.05, ("drive 6",)),)), (("PB002", "station 6"),)),
    Case(
        "PROFIBUS master does not hear a slave",
        partial(profibus, change={"controller": partial(Deaf, address=6)}),
        (("PB003", "station 6"),),
        never=("PB002", "PB010"),
        seeds=1,
    ),
    Case(
        "PROFIBUS parameters refused",
        partial(profibus, slave=partial(Picky, 6, LINE)),
        (("PB004", "station 6"),),
        never=("PB006",),
        seeds=1,
    ),
    Case(
        "PROFIBUS other modules than configured",
        partial(profibus, slave=partial(Slave, 6, LINE, configuration=b"\x71")),
        (("PB005", "station 6"),),
        seeds=1,
    ),
    Case(
        "PROFIBUS wrong ident",
        partial(profibus, slave=partial(Slave, 6, LINE, ident=0x80AA)),
        (("PB006", "station 6"),),
        seeds=1,
    ),
    Case(
        "PROFIBUS slave is never ready",
        partial(profibus, slave=partial(NeverReady, 6, LINE)),
        (("PB022", "station 6"),),
        never=("PB001", "PB004", "PB005", "PB007"),
        seconds=10,
        seeds=1,
    ),
    Case(
        "PROFIBUS two slaves of one address at once",
        partial(profibus, also={"twin": partial(Slave, 6, LINE, ident=0x80AA, tsdr=64)}),
        (Said(("station 6",), words="at once", own_words=True),),
        never=("PB002", "PB022"),
        seconds=10,
        seeds=1,
    ),
    Case(
        "PROFIBUS slave restarts",
        partial(profibus, slave=partial(Restarts, 6, LINE, process=drive)),
        (("PB007", "station 6"),),
        seeds=1,
    ),
    Case(
        "PROFIBUS watchdog expires",
        partial(profibus, change={"drive 6": partial(Dies, at=4 * S, until=8 * S)}),
        (("PB002", "station 6"),),
        never=("PB001", "PB010"),
        seeds=1,
    ),
    Case(
        "PROFIBUS bit errors of one station",
        partial(profibus, (BitFlips(4e-3, ("drive 6",)),)),
        (("PB008", "station 6"),),
    ),
    Case(
        "PROFIBUS bit errors everywhere",
        partial(profibus, (BitFlips(3e-3),)),
        (("PB008", "bus"),),
        never=("PB010", "PB015"),
    ),
    Case(
        "PROFIBUS answers cut short",
        partial(profibus, (CutShort(0.1, ("drive 6",)),)),
        (("PB008", "station 6"),),
        never=("PB010", "PB015"),
    ),
    Case(
        "PROFIBUS line break at a channel",
        partial(profibus, change={"valve": _valve_with_trouble}),
        (("PB009", "station 12"),),
        seeds=1,
    ),
    Case("PROFIBUS address twice", partial(profibus, change={"drive 6": Twin}), (("PB010", "station 6"),), seeds=1),
    Case("PROFIBUS slave of two masters", partial(profibus, also_second=(6,)), (("PB011", "station 6"),), seeds=1),
    Case(
        "PROFIBUS master in Clear",
        partial(profibus, ring=replace(RING, is_clear=True, cycle=100 * MS)),
        (("PB012", "station 1"),),
        seeds=1,
    ),
    Case(
        "PROFIBUS token lost",
        partial(profibus, change={"second master": FallsSilent}),
        (("PB013", "bus"),),
        struck=("station 2",),
        never=("PB015",),
        seeds=1,
    ),
    Case(
        "PROFIBUS token sent again",
        partial(profibus, change={"second master": Dozes}),
        (("PB014", "station 2"),),
        never=("PB013", "PB015"),
        seeds=1,
    ),
    Case(
        "PROFIBUS master keeps the token",
        partial(profibus, change={"controller": partial(KeepsToken, at=5 * S)}),
        (("PB021", "station 1"),),
        never=("PB013", "PB015"),
        seconds=10,
        seeds=1,
    ),
    Case(
        "PROFIBUS a tool without the token",
        partial(profibus, rogue=True),
        (("PB015", "bus"),),
        struck=("station 3", "station 5"),
    ),
    Case(
        "PROFIBUS token lost, FTDI 16 ms",
        partial(profibus, change={"second master": FallsSilent}),
        (("PB013", "bus"),),
        FTDI,
        struck=("station 2",),
        never=("PB015",),
        seeds=1,
    ),
    Case(
        "PROFIBUS token lost, heard from the middle on",
        partial(profibus, change={"second master": FallsSilent}),
        (("PB013", "bus"),),
        hear=from_the_middle,
        struck=("station 2",),
        never=("PB015",),
        seeds=1,
    ),
    Case(
        "PROFIBUS slave switched off",
        partial(profibus, change={"drive 6": partial(Off, at=5 * S)}),
        (("PB002", "station 6"),),
        never=("PB001", "PB007", "PB010"),
        seeds=1,
    ),
    Case(
        "PROFIBUS slave dies beside noise",
        partial(profibus, (BitFlips(0.0003),), change={"drive 6": partial(Off, at=3 * S)}),
        (Said(("station 6",), words="none to the last", own_words=True), ("PB008", "bus")),
        seconds=8,
        seeds=2,
    ),
    Case(
        "PROFIBUS master switched off",
        partial(profibus, change={"second master": partial(Off, at=5 * S)}),
        (("PB014", "station 2"),),
        never=("PB001", "PB007", "PB015"),
        seeds=1,
    ),
    Case(
        "PROFIBUS noise between telegrams",
        partial(profibus, (NoiseInGaps(0.02, places=(Place.BETWEEN, Place.AFTER)),)),
        (Said(("bus",), ("LN203", "LN204", "PB008")),),
        never=("PB001", "PB007", "PB010", "PB013", "PB015"),
    ),
    Case(
        "PROFIBUS noise between telegrams, FTDI 16 ms",
        partial(profibus, (NoiseInGaps(0.02, places=(Place.BETWEEN, Place.AFTER)),)),
        (Said(("bus",), ("LN203", "LN204", "PB008")),),
        FTDI,
        never=("PB001", "PB007", "PB010", "PB013", "PB015"),
    ),
    Case(
        "PROFIBUS address twice, FTDI 16 ms",
        partial(profibus, change={"drive 6": Twin}),
        (("PB010", "station 6"),),
        FTDI,
        seeds=1,
    ),
    Case(
        "PROFIBUS slave restarts, FTDI 16 ms",
        partial(profibus, slave=partial(Restarts, 6, LINE, process=drive)),
        (("PB007", "station 6"),),
        FTDI,
        seeds=1,
    ),
    Case(
        "PROFIBUS bit errors everywhere, FTDI 16 ms",
        partial(profibus, (BitFlips(3e-3),)),
        (("PB008", "bus"),),
        FTDI,
        never=("PB007", "PB010", "PB013", "PB015"),
    ),
    Case("PROFIBUS GAP polls", profibus, (("PB016", "station 1"),), seeds=1),
    Case(
        "PROFIBUS requests refused", partial(profibus, change={"drive 6": Refuses}), (("PB017", "station 6"),), seeds=1
    ),
    Case(
        "PROFIBUS slow slave",
        partial(profibus, slave=partial(Slave, 6, LINE, process=drive, tsdr=200)),
        (("PB018", "station 6"),),
        seeds=1,
    ),
)
