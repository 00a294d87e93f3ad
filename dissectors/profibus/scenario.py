"""The simulated bus of PROFIBUS: two masters in a ring, two drives, a valve, and a slave that is absent."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from dissectors.frame import Place
from dissectors.line import MS, LineSettings
from dissectors.profibus.f510 import RUN, drive, outputs
from dissectors.profibus.simulated_master import Job, Master, RingBehaviour
from dissectors.profibus.simulated_slave import Slave
from dissectors.simulated import Party, SimulatedBus
from dissectors.simulated_faults import BitFlips, LostResponse, NoiseInGaps

LINE = "187500,8E1"


def scenarios() -> Mapping[str, SimulatedBus]:
    """The one bus, by its name."""
    bus = SimulatedBus(
        parties=_parties,
        line=LINE,
        faults=(BitFlips(2e-5), LostResponse(0.002), NoiseInGaps(0.002, places=(Place.BETWEEN, Place.AFTER))),
        devices=dict.fromkeys((5, 6), "teco-f510"),
        text="a controller with two TECO F510 drives, a second master with a valve; slave 9 is absent",
    )
    return {"profibus": bus}


def _parties(line: LineSettings, faults: bool) -> list[Party]:
    jobs = [Job(5, outputs=partial(running, 45.0)), Job(6, outputs=partial(running, 30.0))]
    if faults:
        jobs.append(Job(9))
    ring = RingBehaviour(cycle=max(20 * MS, 400 * line.char))
    controller = Master(1, line, jobs, others=(2,), ring=ring)
    second = Master(2, line, [Job(12, 0x80C8, b"\x11\x20", valve, user=b"")], others=(1,), ring=ring)
    trouble: Callable[[int], bytes] = line_break if faults else no_trouble
    return [
        Party("controller", controller, answers=False),
        Party("second master", second, answers=False),
        Party("drive 5", Slave(5, line, process=drive, tsdr=40)),
        Party("drive 6", Slave(6, line, process=drive, tsdr=55)),
        Party("valve", Slave(12, line, ident=0x80C8, configuration=b"\x11\x20", trouble=trouble)),
    ]


def running(hertz: float, now: int) -> bytes:
    """Outputs of a drive that runs."""
    return outputs(RUN, hertz)


def valve(now: int) -> bytes:
    """One octet that changes once a second."""
    return bytes((now // 1_000_000_000 & 0xFF,))


def no_trouble(now: int) -> bytes:
    """All is well."""
    return b""


def line_break(now: int) -> bytes:
    """A channel that has a broken line for two of every eight seconds."""
    return b"\x80\x41\xa6" if now // 1_000_000_000 % 8 >= 6 else b""
