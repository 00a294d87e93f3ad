"""A week of the box in simulated time: everything bad at random, every octet accounted for, the disk bounded, the
status page honest.

    python -m tests.bench.box_week [--hours 168] [--seed N]

What is injected: power cuts (what was not synced may be gone), capture processes that die, unplugs, other files that
fill the disk, a clock that is set after the start, a receiver of alerts that is not there.
"""

from __future__ import annotations

import argparse
import contextlib
import itertools
import os
import random
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from unittest import mock

from dissectors.findings import Severity
from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.box.notify import Notifier
from sniff.box.past import Closing
from sniff.box.status import BoxStatus, State
from sniff.capture import loop
from sniff.capture.config import SourceSpec
from sniff.cli import box_running
from sniff.cli.box_plan import Plan
from sniff.cli.box_running import Box
from sniff.cli.targets import Target
from sniff.recording import rotation, writer_thread
from sniff.recording.reader import buses_of
from tests.bench.box_plant import (
    BASE,
    EXCHANGE,
    MS,
    POLL,
    Killed,
    PowerCut,
    S,
    SimClock,
    SimTime,
    Wire,
    World,
    open_on,
    starter,
)

PART, KEEP, FLOOR = 100_000, 40, 400_000
UNSYNCED = 12 * S
"""What a power cut may cost: 8 s between syncs, a second to the file, beats of the loop."""


@dataclass
class Told:
    """What came of it. `cuts`, `kills`: times of power cuts and of captures that died. `counts`: what was injected and
    seen. `lost`: octets that the boxes counted as lost; `in_memory`: that waited for a disk when the power went."""

    seed: int
    hours: float
    counts: Counter[str] = field(default_factory=Counter)
    cuts: list[int] = field(default_factory=list)
    kills: list[int] = field(default_factory=list)
    lost: int = 0
    in_memory: int = 0
    most_used: int = 0


class Page:
    """A page that nobody asks for."""

    json, words, path, port = "", "", None, None


class Ear(Notifier):
    """Counts the words to the service manager."""

    def __init__(self, told: Told) -> None:
        super().__init__({})
        self._told = told

    def tell(self, *words: str) -> bool:
        self._told.counts[words[0].partition("=")[0]] += 1
        return True


class Week:
    """One run. `every`: ns between exchanges of each bus."""

    def __init__(self, folder: Path, seed: int, hours: float, every: int) -> None:
        self.told = Told(seed, hours)
        self.dice = random.Random(seed)
        names = ("boiler", "roof")
        wires = [Wire(name, every + number * 7 * MS, BASE + (number + 1) * S) for number, name in enumerate(names)]
        parts = folder / "parts"
        parts.mkdir()
        self.world = World(parts, self.dice, wires)
        self.end = BASE + int(hours * 3600 * S)
        line = LineSettings.parse("19200,8E1")
        self.targets = [Target(SourceSpec(name, line, "modbus-rtu", name)) for name in names]
        self.plan = Plan(parts / "site.mcap", f"size:{PART}", KEEP, FLOOR, None, None, None)
        self.box: Box | None = None
        self.begun = [0, 0]
        self.killed_here = 0  # captures of this box
        self.caught: list[int] = []
        self.removed: list[list[int]] = [[] for _ in names]  # what was in parts that had to make room
        (folder / "sniff485.toml").write_text('[alert]\nwebhook = "http://127.0.0.1:9/"\nevery = 0\n')

    # -- what happens ----------------------------------------------------------------------------------------------

    def plan_the_worst(self) -> None:
        """Put what happens into the calendar: of each kind some, and so many each day."""
        dice, length = self.dice, self.end - BASE
        days = max(1, length // (86_400 * S))
        for kind, least in ((self.unplug, 10), (self.fill, 6), (self.kill, 6), (self.cut, 6)):
            for _ in range(least * days):
                self.world.at(BASE + dice.randrange(length // 50, length * 9 // 10), kind)
        self.world.at(BASE + length // 100, self.set_clock)
        for number in range(1, 200 * days):
            self.world.at(BASE + length * number // (200 * days), self.look)
        self.world.at(self.end, self.stop)

    def unplug(self) -> None:
        wire = self.dice.choice(self.world.wires)
        if wire.plugged:
            self.told.counts["unplugged"] += 1
            if self.world.now - wire.unplugged_at > 10 * S:  # else nobody may have seen that it was back
                wire.down_from = self.world.now
            wire.plugged, wire.unplugged_at = False, self.world.now
            self.world.at(self.world.now + self.dice.randint(20, 900) * S, lambda: self.plug(wire))

    def plug(self, wire: Wire) -> None:
        wire.plugged = True
        wire.unplugged_at = self.world.now

    def fill(self) -> None:
        """Somebody else's file takes nearly all there is, for a while; parts cannot always make room for it."""
        self.told.counts["disk filled"] += 1
        self.world.others = self.world.capacity - self.dice.choice((2_000, FLOOR + 700_000))
        self.world.at(self.world.now + self.dice.randint(60, 1800) * S, lambda: setattr(self.world, "others", 0))

    def kill(self) -> None:
        link = self.world.links[-1] if self.world.links else None
        if self.world.on and link is not None and link.ended is None and not link.killed:
            self.told.counts["capture killed"] += 1
            self.told.kills.append(self.world.now)
            self.killed_here += 1
            raise Killed

    def cut(self) -> None:
        if self.world.on:
            self.told.counts["power cut"] += 1
            self.told.cuts.append(self.world.now)
            raise PowerCut

    def set_clock(self) -> None:
        self.told.counts["clock set"] += 1
        self.world.clock_wrong = 0

    def stop(self) -> None:
        self.caught.append(15)

    def look(self) -> None:
        """Hold the status page against the truth."""
        self.told.most_used = max(self.told.most_used, self.world.used())
        if self.box is None or not self.box._printers or not self.world.on:
            return
        status = self.box.status()
        self.told.counts["looks"] += 1
        self.honest(status)

    def honest(self, status: BoxStatus) -> None:
        world, link = self.world, self.world.links[-1]
        running = link.ended is None and not link.killed
        now = world.now
        for wire, bus, begun in zip(world.wires, status.buses, self.begun, strict=True):
            if not running:
                continue
            for_long = now - wire.unplugged_at
            if not wire.plugged and for_long > 10 * S:
                assert bus.state is State.DOWN, (bus, now)
                self.told.counts["seen down"] += 1
                since, began = bus.since - world.clock_wrong, link.clock.monotonic
                known = wire.unplugged_at, wire.down_from, began  # it may have been gone before that
                assert min(abs(since - one) for one in known) < 12 * S
            if wire.plugged and min(for_long, now - link.clock.monotonic) > 60 * S:
                assert bus.state is State.HEARD, (bus, now)
            heard = len(wire.heard) - begun
            on_the_way = 2 + self.killed_here  # what was read and not told yet went with each capture that was killed
            assert abs(bus.octets - heard * EXCHANGE) <= on_the_way * EXCHANGE, (bus, heard)
        assert not (status.recording and world.free() == 0 and status.free)
        if running:
            self.told.counts["clock seen set"] += abs(status.clock_offset) > S
            bad = {one.code for bus in status.buses for one in bus.findings if one.severity != Severity.NOTE.label}
            assert bad <= {"LN002", "LN005", "LN006"}, bad  # nobody on the bus did anything

    # -- how it runs -----------------------------------------------------------------------------------------------

    def run(self) -> Told:
        """All of it."""
        self.world.clock_wrong = -30 * 86_400 * S  # a Pi without a clock of its own, before the network came
        self.plan_the_worst()
        with self.simulated():
            while self.world.now < self.end:
                self.one_box()
        self.account()
        return self.told

    def one_box(self) -> None:
        """From power to power cut."""
        self.begun = [len(wire.heard) for wire in self.world.wires]
        self.killed_here = 0
        self.box = Box(self.plan, self.targets, Page(), Ear(self.told))  # type: ignore[arg-type]
        try:
            code = self.box.run()
            assert code in (0, 3)
        except PowerCut:
            for link in self.world.links[-1:]:
                if link.ended is None and not link.killed:
                    self.told.in_memory += sum(recorder.unwritten for recorder in link.loop.recorders)
                    link.abandon(cut=True)
            self.world.on = False
            self.world.pass_time(self.world.now + self.dice.randint(20, 600) * S)
            self.world.on = True
        self.told.counts["restarts"] += self.box._restarts
        self.told.counts["alerts in vain"] += self.box.status().alerts_failed
        self.told.counts["parts closed"] += sum(one.closed for one in self.box._recovered)
        self.told.counts["parts left"] += sum(not one.closed for one in self.box._recovered)
        self.told.lost += sum(watch.lost for watch in self.box._watches)

    @contextlib.contextmanager
    def simulated(self) -> Iterator[None]:
        world = self.world

        class Clocks:
            start = staticmethod(lambda: SimClock(world))

        def closing(*told: Any) -> Closing:
            one = Closing(*told)
            one._thread.join()  # simulated time does not pass while it works
            return one

        @contextlib.contextmanager
        def interrupted() -> Iterator[list[int]]:
            yield self.caught

        unlink = Path.unlink

        def removed(path: Path, missing_ok: bool = False) -> None:
            if path.suffix == ".mcap" and path.exists() and path.stat().st_size:
                for bus, numbers in enumerate(self.removed):
                    numbers += numbers_in(path, bus)
            unlink(path, missing_ok)

        with contextlib.ExitStack() as stack:
            for where, name, what in (
                (box_running, "time", SimTime(world)),
                (box_running, "Clock", Clocks),
                (box_running, "Closing", closing),
                (box_running, "until_interrupted", interrupted),
                (box_running.listening, "start_all", starter(world)),
                (writer_thread, "open", open_on(world)),
                (writer_thread, "MOST_WAITING", 20_000),
                (rotation, "free_octets", lambda folder: world.free()),
                (box_running, "free_octets", lambda folder: world.free()),
                (Path, "unlink", removed),
                (loop, "IDLE_BEAT", 2 * S),
                (box_running, "PAGE_EVERY", 5.0),
            ):
                stack.enter_context(mock.patch.object(where, name, what, create=True))
            stack.enter_context(mock.patch.object(sys, "stderr", open(os.devnull, "w")))  # noqa: SIM115
            stack.enter_context(contextlib.chdir(world.folder.parent))
            yield

    # -- the account -----------------------------------------------------------------------------------------------

    def account(self) -> None:
        """Every exchange that was heard is in a part, in one that was removed, counted as lost, or went with a cut."""
        parts = sorted(self.world.folder.glob("*.mcap"))
        assert not list(self.world.folder.glob(".*")), "half written files"
        assert len(parts) <= KEEP + 1
        assert self.told.most_used <= min(self.world.capacity, (KEEP + 1) * (PART + 60_000)), self.told.most_used
        for bus, wire in enumerate(self.world.wires):
            kept = list(itertools.chain.from_iterable(numbers_in(part, bus) for part in parts))
            there = kept + self.removed[bus]
            assert len(there) == len(set(there)), "octets twice"
            assert set(there) <= wire.heard, "octets that nobody heard"
            missing = sorted(wire.heard - set(there))
            unexplained = [number for number in missing if not self.explained(wire.sent_at[number])]
            self.told.counts["kept"] += len(kept)
            self.told.counts["removed for room"] += len(self.removed[bus])
            self.told.counts["gone with a cut"] += len(missing) - len(unexplained)
            self.told.counts["lost to a full disk"] += len(unexplained)
        uncounted = self.told.counts["lost to a full disk"] * (EXCHANGE - len(POLL))
        uncounted -= self.told.lost + self.told.in_memory
        assert uncounted <= 0, f"{uncounted} octets lost and not counted"

    def explained(self, time: int) -> bool:
        return any(0 <= cut - time <= UNSYNCED for cut in self.told.cuts) or any(
            0 <= kill - time <= 2 * S for kill in self.told.kills
        )


def numbers_in(part: Path, bus: int) -> Iterator[int]:
    """Numbers of the answers in a part."""
    buses = buses_of(part)
    for item in buses[bus].items() if bus < len(buses) else ():  # one that was cut in its head says less
        if isinstance(item, Chunk) and len(item.octets) == 9:
            yield int.from_bytes(item.octets[3:7], "big")


def week(folder: Path, seed: int, hours: float, every: int = 10 * S) -> Told:
    """Run it; raises AssertionError where something is not as it must be."""
    return Week(folder, seed, hours, every).run()


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--hours", type=float, default=168)
    parser.add_argument("--seed", type=int, default=random.SystemRandom().randrange(1, 1 << 31))
    args = parser.parse_args()
    print(f"seed {args.seed}, {args.hours:g} hours", flush=True)
    began = time.process_time()
    with tempfile.TemporaryDirectory(prefix="box-week-") as folder:
        told = week(Path(folder), args.seed, args.hours)
    print(f"{time.process_time() - began:.0f} s of CPU")
    print(f"{told.lost} octets counted as lost, {told.most_used} on the disk at most")
    for name, count in sorted(told.counts.items()):
        print(f"  {name:<18} {count}")


if __name__ == "__main__":
    main()
