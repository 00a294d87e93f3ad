"""A virtual RS-485 bus: parties on pseudo-terminals (or in memory), paced at the baud rate, with faults.

    with VirtualBus(LineSettings.parse("19200,8E1")) as bus:
        client = bus.attach("client")     # "/dev/pts/5": open it like a serial port
        server = bus.attach("server")
        tap = bus.tap()                   # hears everything, is heard by nobody
        ...
        bus.report().tap_octets           # 0, or the tap was not passive

The bus is a process of its own (`hub.py`), so that a busy main program does not disturb its timing.
"""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Sequence
from types import TracebackType
from typing import Any

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from dissectors.simulated_faults import Fault
from sniff.simulation import hub
from sniff.simulation.hub import NO_STATIONS, HubPlan, HubReport
from sniff.simulation.ports import HAS_PTY, Port
from sniff.simulation.scenarios import Scenario
from sniff.simulation.wire import Factory, Sent

PATIENCE = 60.0  # s for the process to answer or to end: it starts an interpreter, and the machine may be busy
SLICE = 1_000_000
WHOLE = 1 << 60
"""As `slice`: a burst is handed out in one piece when it ends. On a host so busy that the kernel holds octets of a
pseudo-terminal back for milliseconds (seen at a load of four processes a core), nothing then tears a frame apart."""


class BusFailed(RuntimeError):
    """The bus's process ended or does not answer."""


class VirtualBus:
    """One bus, from `__enter__` (or `open`) to `__exit__` (or `close`).

    `stations`: makes the simulated parties; a module-level function or a partial of one, called in the bus's process.
    `faults` strike every transmission in their order, repeatable by `seed`. `gap`: ns of silence that the protocol
    wants before a frame: stations are told whether it was kept (`quiet`), and parties outside are made to keep it,
    because a program answers in less than that and no device does. `slice`: ns, how finely octets of a burst are
    handed out (WHOLE: not before it ends). `paused`: the clock stands, and no octet moves, until `begin` is called.
    """

    def __init__(
        self,
        line: LineSettings,
        stations: Factory = NO_STATIONS,
        faults: Sequence[Fault] = (),
        seed: int = 0,
        gap: int = 0,
        slice: int = SLICE,
        paused: bool = False,
    ) -> None:
        self.line = line
        self._plan = HubPlan(line, stations, tuple(faults), seed, gap, slice)
        self._paused = paused
        self._process: multiprocessing.process.BaseProcess | None = None
        self._control: Any = None

    @classmethod
    def from_scenario(cls, plan: Scenario, slice: int = SLICE, paused: bool = False) -> VirtualBus:
        """The bus of a scenario, in real time."""
        return cls(plan.line, plan.stations, plan.faults, plan.seed, plan.gap, slice, paused)

    def open(self) -> None:
        """Start the process; harmless when it runs already. Raises BusFailed."""
        if self._process is not None:
            return
        context = multiprocessing.get_context("spawn")
        control, other = context.Pipe()
        process = context.Process(target=hub.main, args=(self._plan, other), name="virtual-bus", daemon=True)
        try:
            process.start()
        except BaseException:
            control.close()
            raise
        finally:
            other.close()
        self._process, self._control = process, control
        if not self._paused:
            try:
                self.begin()
            except BaseException:
                self.close()
                raise

    def close(self) -> None:
        """Stop the process and wait for it; harmless when called twice."""
        process, control = self._process, self._control
        self._process = self._control = None
        if process is None:
            return
        control.close()  # its loop ends when this end is gone
        process.join(PATIENCE)
        if process.is_alive():
            process.kill()
            process.join()
        process.close()

    def __enter__(self) -> VirtualBus:
        self.open()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def pid(self) -> int | None:
        """The process's id, None when closed."""
        return self._process.pid if self._process is not None else None

    def begin(self) -> None:
        """Let the clock run (at once unless `paused`)."""
        self._ask("begin")

    def attach(self, name: str, echo: bool = False, answers: bool = False, link: str = "") -> str:
        """Put a party on the bus; give the path of its pseudo-terminal.

        `echo`: it hears itself, as many adapters do. `answers`: faults of answers may strike it. `link`: a symbolic
        link to make for it and to give back instead; it is removed when the party leaves.
        The pseudo-terminal takes any baud rate but, as the kernel has it, only 8 data bits without parity: open it so,
        whatever the bus's line is.
        Raises OSError where the system has no pseudo-terminals (use `connect`), or where the link cannot be made.
        """
        return str(self._ask("attach", "pty", link, Port(name, False, echo, answers)))

    def tap(self, name: str = "tap", link: str = "") -> str:
        """Put a listener on the bus; give what a program opens. What it writes is counted, not sent.

        That is the path of a pseudo-terminal (or `link`, a symbolic link to it), or, where the system has none, the
        URL of a gateway.
        """
        if not HAS_PTY:
            return self.gateway(name)
        return str(self._ask("attach", "pty", link, Port(name, True)))

    def gateway(self, name: str = "gateway") -> str:
        """Put a listener on the bus that is reached over the network; give its URL ("socket://127.0.0.1:40001")."""
        return str(self._ask("attach", "gateway", "", Port(name, True)))

    def connect(self, name: str, echo: bool = False, answers: bool = False) -> MemoryPort:
        """Put a party on the bus without a pseudo-terminal."""
        self._ask("attach", "memory", "", Port(name, False, echo, answers))
        return MemoryPort(self, name)

    def memory_tap(self, name: str = "memory-tap") -> MemoryPort:
        """Put a listener on the bus without a pseudo-terminal; it gets line errors too."""
        self._ask("attach", "memory", "", Port(name, True))
        return MemoryPort(self, name)

    def detach(self, name: str) -> None:
        """Take a party or a tap off the bus, as if its adapter were unplugged."""
        self._ask("detach", name)

    def switch(self, faults: Sequence[Fault]) -> None:
        """Let these faults strike from now on, and no others."""
        self._ask("switch", tuple(faults))

    def truth(self) -> list[Sent]:
        """What was transmitted since the last call (at most 200 000), and what became of it.

        Times are ns on the host's monotonic clock.
        """
        truths: list[Sent] = self._ask("truth")
        return truths

    def report(self) -> HubReport:
        """Counts so far."""
        report: HubReport = self._ask("report")
        return report

    def _ask(self, *request: Any) -> Any:
        if self._control is None:
            raise BusFailed("the virtual bus is not open")
        try:
            self._control.send(request)
            if not self._control.poll(PATIENCE):
                raise BusFailed(f"the virtual bus does not answer {request[0]!r}")
            verdict, value = self._control.recv()
        except (EOFError, BrokenPipeError, ConnectionResetError) as gone:
            raise BusFailed("the virtual bus's process has ended") from gone
        if verdict == "error":
            raise OSError(value)
        return value


class MemoryPort:
    """A party or a tap in this program: chunks with line errors, timed at the end of their last octet."""

    def __init__(self, bus: VirtualBus, name: str) -> None:
        self._bus = bus
        self.name = name

    def read(self, timeout: float = 0.0) -> list[Chunk]:
        """What came since the last call; waits up to `timeout` seconds for the first of it."""
        until = time.monotonic() + timeout
        while True:
            chunks: list[Chunk] = self._bus._ask("read", self.name)
            if chunks or time.monotonic() >= until:
                return chunks
            time.sleep(0.002)

    def write(self, octets: bytes) -> None:
        """Transmit."""
        self._bus._ask("write", self.name, octets)

    def close(self) -> None:
        """Leave the bus."""
        self._bus.detach(self.name)
