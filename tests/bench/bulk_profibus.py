"""A PROFIBUS DP line as columns of reads, a million telegrams in a second: two masters that pass the token, each with
its slaves in data exchange.

    python -m tests.bench.bulk_profibus [FRAMES [DAMAGED …]]     seconds of kernel and tables (1000000, 0 and 0.005)

Requests and answers of data exchange are some 85 % of the telegrams, tokens 9 %, GAP polls 2 %, one Global_Control and
one Slave_Diag in a while; one telegram a read. Whole telegrams are drawn from a pool, so none costs a Python object.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import numpy as np

from dissectors.columns import Reads
from dissectors.line import LineSettings, Timing
from dissectors.profibus.kernel import kernel
from dissectors.profibus.telegram import telegram, token
from sniff.engine.blocks import Block
from sniff.engine.bulk import tables
from sniff.engine.session import Session
from tests.bench.bulk_mstp import BASE, Pool

LINE = LineSettings.parse("500000,8E1")
TIMING = Timing(LINE)
MASTERS = {2: (5, 6, 7, 8, 9), 3: (20, 21, 22, 23)}
_VARIANTS = 64
_US = 1000


def reads(frames: int, seed: int = 1, damaged: float = 0.0, answered: float = 1.0) -> Reads:
    """About so many telegrams, one a read. `damaged`: part of them with one bit wrong. `answered`: part of the requests
    that are."""
    dice = np.random.default_rng(seed)
    pool = Pool()
    rounds = -(-frames // sum(2 * len(slaves) + 1.3 for slaves in MASTERS.values()).__int__())
    said, present, pauses = [], [], []

    def add(which: np.ndarray, is_said: np.ndarray | bool, least: int, most: int) -> None:
        said.append(which)
        present.append(np.broadcast_to(is_said, rounds))
        pauses.append(dice.integers(least * _US, most * _US, rounds))

    turn = np.arange(rounds)
    for master, slaves in MASTERS.items():
        other = next(one for one in MASTERS if one != master)
        for place, slave in enumerate(slaves):
            asks = _exchanges(pool, dice, slave, master, True).reshape(2, _VARIANTS)[turn & 1, turn % _VARIANTS]
            answers = _exchanges(pool, dice, master, slave, False)[dice.integers(0, 2 * _VARIANTS, rounds)]
            diagnosis = dice.random(rounds) < 0.002
            told = (
                pool.add(telegram(slave, master, 0x5D, dsap=60, ssap=62)),
                pool.add(telegram(master, slave, 0x08, bytes((0, 12, 0, master, 0xF5, 0x10)), dsap=62, ssap=60)),
            )
            if place == len(slaves) - 1:  # without inputs
                answers = np.full(rounds, pool.add(b"\xe5"))
            add(np.where(diagnosis, told[0], asks), True, 100, 150)
            add(np.where(diagnosis, told[1], answers), dice.random(rounds) < answered, 40, 90)
        gap = np.array([pool.add(telegram(address, master, 0x49)) for address in range(4, 5 + master)])
        add(gap[turn % len(gap)], turn % 8 == 0, 100, 150)
        add(np.full(rounds, pool.add(telegram(127, master, 0x46, b"\0\0", dsap=58, ssap=62))), turn % 50 == 0, 300, 400)
        add(np.full(rounds, pool.add(token(other, master))), True, 600, 700)
    chosen = np.stack(present, 1).ravel()
    octets, lengths = pool.lay(np.stack(said, 1).ravel()[chosen])
    if damaged:
        which = np.flatnonzero(dice.random(len(lengths)) < damaged)
        at = (np.cumsum(lengths) - lengths)[which] + dice.integers(0, lengths[which])
        octets[at] ^= np.left_shift(1, dice.integers(0, 8, len(at))).astype(np.uint8)
    times = BASE + np.cumsum(np.stack(pauses, 1).ravel()[chosen] + lengths * TIMING.char)
    return Reads(octets, times, lengths, np.zeros(len(lengths), bool))


def _exchanges(pool: Pool, dice: np.random.Generator, to: int, source: int, is_request: bool) -> np.ndarray:
    """Telegrams with outputs or inputs; requests with the frame count bit clear, then set."""
    controls = (0x5D, 0x7D) if is_request else (0x08, 0x08)
    data = [dice.bytes(8) for _ in range(_VARIANTS)]
    return np.array([pool.add(telegram(to, source, control, one)) for control in controls for one in data])


def main(frames: int, shares: list[float]) -> None:
    """Print how long the kernel and whole tables take, best of three and two."""
    session = Session("x", LINE, "profibus")
    for share in shares:
        bus = reads(frames, damaged=share)
        kernel(reads(1000), TIMING)
        columns = kernel(bus, TIMING)
        framing = min(_seconds(kernel, bus, TIMING) for _ in range(3))
        whole = min(_seconds(_tabulate, bus, session) for _ in range(2))
        print(
            f"{len(bus)} telegrams, {share:.1%} damaged: kernel {framing:.3f} s, {len(columns) / len(bus):.2%} "
            f"by columns in {int((~columns.chained).sum())} chains; tables {whole:.3f} s"
        )


def blocks(bus: Reads, count: int = 20_000) -> list[Block]:
    """The same, so many reads a block."""
    begins, made = bus.begins, []
    for begin in range(0, len(bus), count):
        end = min(begin + count, len(bus))
        octets = bus.octets[begins[begin] : begins[end]]
        made.append(Block(Reads(octets, bus.times[begin:end], bus.lengths[begin:end], bus.marked[begin:end])))
    return made


def _tabulate(bus: Reads, session: Session) -> None:
    for _ in tables(blocks(bus), session):
        pass


def _seconds(work: Callable[..., object], *arguments: object) -> float:
    begin = time.process_time()
    work(*arguments)
    return time.process_time() - begin


if __name__ == "__main__":
    numbers = sys.argv[1:]
    main(int(numbers[0]) if numbers else 1_000_000, [float(share) for share in numbers[1:]] or [0.0, 0.005])
