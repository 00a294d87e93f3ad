"""The real program on a bus whose octets depend on the line settings, as on a pair of wires; run as a script.

    python line_bus.py record line-bus:PLAN -s auto …      what `sniff485 record …` does, with the source below
    python line_bus.py --capture                           the capture process that the first one starts

PLAN is `protocol,line,silence`: what stations say, with what they talk, and seconds of silence before. What they send
is turned into bits and read by a receiver with the settings in force, line errors and all. The capture's seconds are
shorter than ours (SPEED), so that nobody waits for a bus that is only simulated.
"""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from dissectors.frame import Chunk  # noqa: E402
from dissectors.line import LineSettings  # noqa: E402
from sniff.capture import link  # noqa: E402
from sniff.capture.spawn import Spawned  # noqa: E402
from sniff.capture.waiting import Call, Waiting  # noqa: E402
from sniff.engine.event_texts import SettingsChange  # noqa: E402
from sniff.engine.session import Adapter, Item, LineEvent, LineEventKind  # noqa: E402
from sniff.simulation.collision import low_times, receive  # noqa: E402
from sniff.simulation.scenarios import bursts, scenario  # noqa: E402
from sniff.simulation.wire import Burst  # noqa: E402
from sniff.sources.clock import Clock  # noqa: E402

PREFIX = "line-bus:"
SPEED = 4
"""Seconds of the capture in one of ours."""


class FastClock(Clock):
    """The capture's clock, ahead of the wall from its anchor on; nobody is told that they drift apart."""

    def now(self) -> int:
        return self.at(time.monotonic_ns())

    def at(self, monotonic: int) -> int:
        return self.wall + SPEED * (monotonic - self.monotonic)

    def drift(self) -> int:
        return 0


class FastWaiting(Waiting):
    """Waits as long as the fast clock takes for a time."""

    def wait(self, seconds: float) -> list[tuple[int, Call]]:
        return super().wait(seconds / SPEED)


def plan_of(spec: str) -> tuple[str, LineSettings, float]:
    """protocol, line and s of silence; a / stands for the comma of the line."""
    protocol, line, silence = spec.removeprefix(PREFIX).split("+")
    return protocol, LineSettings.parse(line), float(silence)


def sent(spec: str, seconds: float = 60) -> list[Burst]:
    """What the stations send; times from 0 on."""
    protocol, line, _ = plan_of(spec)
    return [burst for burst in bursts(scenario(protocol, 1, False, line), seconds) if burst.octets]


class LineBusSource:
    """A source of the bus; whatever is due comes with the settings in force then."""

    def __init__(self, spec: str, line: LineSettings, clock: Clock) -> None:
        self.line = line
        self._clock = clock
        self._true = plan_of(spec)[1]
        self._bursts = sent(spec)
        self._began = clock.now() + int(plan_of(spec)[2] * 1e9)
        self._pending: list[Item] = []
        self.session_adapter = Adapter("a simulated line", "line-bus", 0, "exact", ("parity", "framing", "break"))
        self.ended = False

    def fileno(self) -> int | None:
        return None

    def deadline(self) -> int | None:
        return self._began + self._bursts[0].ends[-1] if self._bursts else None

    def read(self) -> list[Item]:
        items, self._pending = self._pending, []
        now = self._clock.now()
        while self._bursts and self._began + self._bursts[0].ends[-1] <= now:
            burst = self._bursts.pop(0)
            time = self._began + burst.ends[-1]
            if self.line == self._true:
                items.append(Chunk(time, bytes(burst.octets), tuple(burst.marks)))
                continue
            lows = low_times(self._true, burst.ends[0] - self._true.char, burst.octets, {})
            heard = receive(self.line, lows)
            if heard.octets:
                items.append(Chunk(time, heard.octets, heard.marks))
        return items

    def now(self) -> int:
        return self._clock.now()

    def reconfigure(self, line: LineSettings) -> None:
        self.line = line
        self._pending.append(LineEvent(self._clock.now(), LineEventKind.SETTINGS, str(SettingsChange(line))))

    def close(self) -> None:
        self.ended = True


def spawn(words: Sequence[str]) -> Spawned:
    """Start this script as the capture process."""
    ours, theirs = socket.socketpair()
    errors = tempfile.TemporaryFile()  # noqa: SIM115
    command = [sys.executable, __file__, "--capture", *words]
    with theirs:
        process = subprocess.Popen(command, stdin=theirs.fileno(), start_new_session=True, stdout=errors, stderr=errors)
    return Spawned(process, ours, errors)


def main(arguments: list[str]) -> int:
    """The program, or its capture process."""
    if arguments[:1] == ["--capture"]:
        from sniff.capture import loop, process

        process.open_source = LineBusSource
        process.Clock = FastClock
        loop.Waiting = FastWaiting
        return process.main()
    from sniff.cli import main as sniff485

    link.spawn = spawn
    return sniff485(arguments)


if __name__ == "__main__":
    os.environ.setdefault("PYTHONPATH", str(ROOT))
    sys.exit(main(sys.argv[1:]))
