"""Days of recording in minutes: everything bad at random, and every octet accounted for. Not in the suite.

`ENDURANCE_HOURS=24 ENDURANCE_FULL_HOURS=1 make bench ARGS="-k endurance -s"` of simulated time, by default half an hour
and six minutes; ENDURANCE_SEED (random, printed). What is injected: unplugs, a full disk, a disk that hangs, a main
process that dies and is begun again, files that are removed.
"""

from __future__ import annotations

import os
import random
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from dissectors.frame import Chunk
from sniff.bus.live import LiveBus
from sniff.capture.ipc import ReceivedMessage, Tick
from sniff.engine.session import LineEvent, LineEventKind
from sniff.formats import read
from sniff.recording import writer_thread
from sniff.recording.rotation import Rotation
from sniff.recording.writer import Recorder
from tests.bench.recorded_bus import BASE, BEAT, SESSION, Link, polls

S = 1_000_000_000
SEED = int(os.environ.get("ENDURANCE_SEED", "0")) or random.SystemRandom().randrange(1, 1 << 31)


class Disk:
    """Between the recorder and its file: full, or hanging, as it is told."""

    def __init__(self) -> None:
        self.full = False
        self.answers = threading.Event()
        self.answers.set()

    def behind(self, stream: Any) -> Any:
        disk = self

        class File:
            def write(self, octets: bytes) -> int:
                disk.answers.wait()
                if disk.full:
                    raise OSError(28, "No space left on device")
                return int(stream.write(octets))

            def __getattr__(self, name: str) -> object:
                return getattr(stream, name)

        return File()


def memory() -> float:
    """MB of this process."""
    with open("/proc/self/statm", encoding="ascii") as statm:
        return int(statm.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


class Run:
    """A recording on a clock of its own. `injected`: what was done to it, by kind."""

    def __init__(self, folder: Path, decode: bool) -> None:
        self.folder, self.decode = folder, decode
        self.dice = random.Random(SEED)
        self.disk = Disk()
        self.recorder = Recorder(folder / "x.mcap", SESSION, Rotation.parse("size:500kB"))
        self._wrap()
        self.injected: dict[str, int] = {}
        self.removed = 0
        self.unplugged = False
        self.front: tuple[Link, LiveBus] | None = None
        self.given = self.heard = 0
        self.memory: list[float] = []

    def _wrap(self) -> None:
        part = self.recorder._keeper._part
        if type(part.stream).__name__ != "File":
            part.stream = self.disk.behind(part.stream)

    def _front(self) -> None:
        link = Link(self.recorder, lambda _: True)
        self.front = link, LiveBus(link)  # type: ignore[arg-type]

    def run(self, chunks: Iterator[Chunk], hours: float) -> None:
        due, hour, over = BASE, BASE, 0
        ends: list[tuple[int, str]] = []
        for chunk in chunks:
            while chunk.time > due:
                self._tick(due)
                if due >= over:
                    over = due + 60 * S
                    if self.dice.random() < 0.2:
                        ends.append((due + self.dice.randrange(5, 55) * S, self._begin(due)))
                for when, what in [one for one in ends if one[0] <= due]:
                    ends.remove((when, what))
                    self._end(what, due)
                if due >= hour:
                    hour += int(hours * 3600 * S / 12)
                    self.memory.append(memory())
                due = min(due + BEAT, max(self.recorder.due or due + BEAT, due + 1))
            if self.unplugged:
                continue
            self.heard += len(chunk.octets)
            self.recorder.chunk(chunk)
            if self.front is not None:
                self.front[0].messages.append(ReceivedMessage(0, chunk))
        for _, what in ends:
            self._end(what, due)
        self.recorder.close()

    def _tick(self, now: int) -> None:
        self.recorder.tick(now)
        self.recorder.notices.clear()
        orders = self.recorder._keeper.orders
        while self.disk.answers.is_set() and orders.qsize() > 20:  # a real clock gives it as much time as it needs
            time.sleep(0.0005)
        self._wrap()
        if self.front is not None:
            link, live = self.front
            link.messages.append(Tick(0, now))
            while link.messages or live._pending:
                live.poll()
        elif self.decode and "killed front" not in self.injected:
            self._front()

    def _begin(self, now: int) -> str:
        kinds = ("unplug", "full disk", "disk hangs", "killed front", "removed file")
        (what,) = self.dice.choices(kinds, (5, 5, 5, 5, 1))
        self.injected[what] = self.injected.get(what, 0) + 1
        if what == "unplug":
            self.unplugged = True
            self.recorder.line(LineEvent(now, LineEventKind.UNPLUGGED, "gone"))
        elif what == "full disk":
            self.disk.full = True
        elif what == "disk hangs":
            self.disk.answers.clear()
        elif what == "killed front":
            self.front = None
        elif self.disk.answers.is_set():
            while not self.recorder._keeper.orders.empty():
                time.sleep(0.001)
            self.recorder.path.unlink(missing_ok=True)
        return what

    def _end(self, what: str, now: int) -> None:
        if what == "unplug":
            self.unplugged = False
            self.recorder.line(LineEvent(now, LineEventKind.REPLUGGED, "back"))
        elif what == "full disk":
            self.disk.full = False
        elif what == "disk hangs":
            self.disk.answers.set()
        elif what == "killed front" and self.decode:
            self._front()


def full_bus(seconds: float) -> Iterator[Chunk]:
    """115200 Bd without a gap, as a CH340 gives it: 32 octets at a time."""
    dice, now = random.Random(SEED), BASE
    for _ in range(int(seconds * 11_520 / 32)):
        now += 32 * S // 11_520
        yield Chunk(now, dice.randbytes(32))


@pytest.mark.timeout(0)
@pytest.mark.benchmark(group="endurance")
@pytest.mark.parametrize("kind", ["50 frames a second", "full 115200 Bd"])
def test_endurance(benchmark: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    if kind.startswith("full"):
        hours = float(os.environ.get("ENDURANCE_FULL_HOURS", "0.1"))
        monkeypatch.setattr(writer_thread, "MOST_WAITING", 500_000)  # so that something is lost at all
        run, chunks = Run(tmp_path, decode=False), full_bus(hours * 3600)
    else:
        hours = float(os.environ.get("ENDURANCE_HOURS", "0.5"))
        monkeypatch.setattr(writer_thread, "MOST_WAITING", 60_000)
        run, chunks = Run(tmp_path, decode=True), polls(hours * 3600)
    benchmark.pedantic(run.run, (chunks, hours), rounds=1)
    paths = sorted(tmp_path.glob("*.mcap"))
    there = said = 0
    for path in paths:
        for item in read(path).items():
            there += len(item.octets) if isinstance(item, Chunk) else 0
            said += item.count if isinstance(item, LineEvent) and item.kind is LineEventKind.DROPPED else 0
    lost = run.recorder.lost_octets
    figures = (
        f"{run.heard} octets heard = {there} in {len(paths)} files + {lost} counted as lost",
        f"{said} of them where they are missing",
        f"injected {run.injected}",
        f"memory {' '.join(f'{mb:.0f}' for mb in run.memory)} MB",
    )
    print(f"\n  {kind}, {hours:g} simulated hours, seed {SEED}: {'; '.join(figures)}")
    assert there + lost == run.heard
    settled = run.memory[2:]
    assert max(settled) - min(settled) < 30
