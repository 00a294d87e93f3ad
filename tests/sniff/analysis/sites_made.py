"""Sites of several buses with one thing wrong between them, or nothing; written as recordings by

python -m tests.sniff.analysis.sites_made captures/sites
"""

from __future__ import annotations

import random
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from dissectors.modbus.envelope import seal_rtu
from sniff.engine.event_texts import gone
from sniff.engine.session import Adapter, Item, LineEvent, LineEventKind, Session
from sniff.recording.writer import SharedFile

S, MS = 1_000_000_000, 1_000_000
BASE = 1_772_359_200 * S
LINE = LineSettings.parse("19200,8E1")

Site = dict[str, list[Item]]


@dataclass(frozen=True, slots=True)
class Exchange:
    """A request and its answer: `at`, ns, its begin; `takes`, ns, from the end of the one to the begin of the other."""

    at: int
    request: bytes
    answer: bytes
    takes: int


def asked(station: int, register: int, value: int) -> tuple[bytes, bytes]:
    """A poll of two registers and its answer."""
    return (
        seal_rtu(bytes((station, 3, register >> 8, register & 255, 0, 2))),
        seal_rtu(bytes((station, 3, 4)) + value.to_bytes(4, "big")),
    )


def programme(
    dice: random.Random, seconds: float, stations: int = 3, pause: float = 60, jitter: float = 40, registers: int = 2
) -> Iterator[Exchange]:
    """What a master asks, one station after the other; `pause`, `jitter`: ms between exchanges."""
    now, number = BASE, 0
    while now < BASE + seconds * S:
        station = 1 + number % stations
        register = 0x100 * (1 + number // stations % registers)
        takes = int(dice.uniform(8, 16) * MS)
        request, answer = asked(station, register, dice.randrange(1 << 20))
        yield Exchange(now, request, answer, takes)
        now += takes + int((pause + dice.uniform(0, jitter)) * MS) + LINE.char * 17
        number += 1


def heard(exchanges: Iterator[Exchange] | list[Exchange], dice: random.Random, late: float = 0.5) -> list[Item]:
    """What an adapter gives of it; `late`: ms that a read may come after its last octet."""
    items: list[Item] = []
    for one in exchanges:
        asked_at = one.at + LINE.char * len(one.request)
        items.append(Chunk(asked_at + int(dice.uniform(0, late) * MS), one.request))
        if one.answer:
            end = asked_at + one.takes + LINE.char * len(one.answer)
            items.append(Chunk(end + int(dice.uniform(0, late) * MS), one.answer))
    return items


def twins(dice: random.Random) -> Site:
    """Nothing wrong: two plants built alike, with the same programme and values, each on its own."""
    return {
        name: heard([replace(one, answer=asked(one.request[0], 0, 7)[1]) for one in programme(dice, 60)], dice)
        for name in ("east", "west")
    }


def strict_twins(dice: random.Random) -> Site:
    """Nothing wrong: two controllers whose clocks are so good that their polls never move against each other."""
    made = {}
    for name, offset in (("east", 0), ("west", 31 * MS)):
        exchanges = [
            replace(one, at=BASE + offset + number * 100 * MS, takes=10 * MS, answer=asked(one.request[0], 0, 7)[1])
            for number, one in enumerate(programme(dice, 40))
        ]
        made[name] = heard(exchanges, dice)
    return made


def one_bus_stops(dice: random.Random) -> Site:
    """Nothing between the buses: one is silent for a while, the other goes on."""
    east = [one for one in programme(dice, 90) if not 40 < (one.at - BASE) / S < 52]
    return {"east": heard(east, dice), "west": heard(programme(dice, 90), dice)}


def two_stops(dice: random.Random) -> Site:
    """Both buses are silent for a while, at two times."""
    made = {}
    for name, begin in (("east", 30), ("west", 45)):
        made[name] = heard([one for one in programme(dice, 90) if not begin < (one.at - BASE) / S < begin + 11], dice)
    return made


def power_lost(dice: random.Random) -> Site:
    """The plant's supply fails for twelve seconds, and the box goes on."""
    return {
        name: heard([one for one in programme(dice, 70, stations) if not 40 < (one.at - BASE) / S < back], dice)
        for name, stations, back in (("boiler", 3, 52), ("roof", 2, 53.5), ("cellar", 4, 52.4))
    }


def stations_lost(dice: random.Random) -> Site:
    """The stations of both buses lose their supply; the masters go on asking."""

    def silenced(exchanges: Iterator[Exchange]) -> list[Exchange]:
        return [replace(one, answer=b"") if 40 < (one.at - BASE) / S < 60 else one for one in exchanges]

    return {name: heard(silenced(programme(dice, 90, 3, 200)), dice) for name in ("boiler", "roof")}


def hub_unplugged(dice: random.Random) -> Site:
    """The hub with both adapters loses its supply for five seconds."""
    made = {}
    for name in ("boiler", "roof"):
        items = heard([one for one in programme(dice, 60) if not 29.9 < (one.at - BASE) / S < 35], dice)
        went = BASE + 30 * S + dice.randrange(300 * MS)
        items.append(LineEvent(went, LineEventKind.UNPLUGGED, gone(f"/dev/{name}", "No such device")))
        items.append(LineEvent(went + 5 * S, LineEventKind.REPLUGGED, f"/dev/{name} is back"))
        made[name] = sorted(items, key=lambda item: item.time)
    return made


def line_twice(dice: random.Random) -> Site:
    """Two adapters on one line, a repeater of 2 ms between them."""
    exchanges = list(programme(dice, 40))
    return {
        "near": heard(exchanges, dice),
        "far": heard([replace(one, at=one.at + 2 * MS) for one in exchanges], dice),
    }


def one_master(dice: random.Random) -> Site:
    """A controller that runs the same programme on both of its ports, the second 20 ms after the first."""
    exchanges = list(programme(dice, 60))
    others = []
    for one in exchanges:
        answer = asked(one.request[0], 0, dice.randrange(1 << 20))[1]
        others.append(replace(one, at=one.at + 20 * MS, answer=answer, takes=int(dice.uniform(8, 16) * MS)))
    return {"east": heard(exchanges, dice), "west": heard(others, dice)}


def gateway(dice: random.Random) -> Site:
    """A gateway hands what station 1 is asked on to station 7 of another bus; it takes 5 ms to 9 ms itself."""
    front, back = [], []
    for one in programme(dice, 60, 2, 90):
        if one.request[0] == 1:
            inner, own = one.takes, int(dice.uniform(5, 9) * MS)
            request = seal_rtu(bytes((7,)) + one.request[1:-2])
            answer = seal_rtu(bytes((7,)) + one.answer[1:-2])
            begin = one.at + LINE.char * len(one.request) + own // 2
            back.append(Exchange(begin, request, answer, inner))
            whole = own + LINE.char * (len(request) + len(answer)) + inner
            front.append(replace(one, takes=whole))
        else:
            front.append(one)
    return {"plant": heard(front, dice), "meters": heard(back, dice)}


def slow_neighbour(dice: random.Random) -> Site:
    """Nothing between the buses: slow answers on one while the other is asked the same again and again."""
    front = [replace(one, takes=one.takes * 8) for one in programme(dice, 60, 1, 90, 40, 1)]
    return {"plant": heard(front, dice), "meters": heard(programme(dice, 60, 1, 5, 10, 1), dice)}


SITES: dict[str, tuple[Callable[[random.Random], Site], tuple[str, ...]]] = {
    "twins": (twins, ()),
    "strict-twins": (strict_twins, ()),
    "one-bus-stops": (one_bus_stops, ()),
    "two-stops": (two_stops, ()),
    "slow-neighbour": (slow_neighbour, ()),
    "power-lost": (power_lost, ("SB001",)),
    "stations-lost": (stations_lost, ("SB001",)),
    "hub-unplugged": (hub_unplugged, ("SB002",)),
    "line-twice": (line_twice, ("SB003",)),
    "one-master": (one_master, ("SB004",)),
    "gateway": (gateway, ("SB005",)),
}
"""What makes a site, and the codes of what is to be found about it."""


def sessions(site: Site) -> list[Session]:
    """The buses of a site."""
    adapter = Adapter("a simulated adapter", "sim", MS, "simulated", ("parity", "framing"))
    return [Session(f"/dev/{name}", LINE, "modbus-rtu", BASE, name, adapter) for name in site]


def write(path: Path, site: Site) -> None:
    """Record a site."""
    recorders = SharedFile(path, sessions(site)).recorders()
    for item, bus in sorted(
        ((item, bus) for bus, items in enumerate(site.values()) for item in items), key=lambda one: one[0].time
    ):
        if isinstance(item, Chunk):
            recorders[bus].chunk(item)
        else:
            recorders[bus].line(item)
    for recorder in recorders:
        recorder.finish()
    for recorder in recorders:
        recorder.close()


def main() -> None:
    folder = Path(sys.argv[1])
    folder.mkdir(exist_ok=True)
    for name, (make, codes) in SITES.items():
        if not codes:
            continue  # what is found of innocent ones is nothing: they are made anew for each test
        (folder / f"{name}.mcap").unlink(missing_ok=True)
        write(folder / f"{name}.mcap", make(random.Random(name)))


if __name__ == "__main__":
    main()
