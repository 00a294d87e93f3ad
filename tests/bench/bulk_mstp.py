"""An MS/TP bus as columns of reads, a million frames in a second: 24 masters in a ring, ReadProperty with answers.

    python -m tests.bench.bulk_mstp [FRAMES [DAMAGED …]]     seconds of kernel and pairing (1000000, 0 and 0.005)

Tokens are some 73 % of the frames, polls 8 %, requests and answers the rest; one read a frame, at times as on a line of
38400 Bd. Whole frames are drawn from a pool and laid behind one another, so no frame costs a Python object.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from dissectors.bacnet.envelope import frame
from dissectors.bacnet.kernel import kernel
from dissectors.bacnet.pairing import Pairing, prepare
from dissectors.bacnet.tracker import MstpTracker
from dissectors.columns import FrameColumns, Reads
from dissectors.line import LineSettings, Timing
from tests.property.kernel_equality import frame_at

LINE = LineSettings.parse("38400,8N1")
TIMING = Timing(LINE)
BASE = 1_772_359_200_000_000_000
MS = 1_000_000
MASTERS = 24
_VARIANTS = 256  # invoke ids, with as many values

Places = npt.NDArray[np.int64]


class Pool:
    """Frames that stations may say, laid behind one another. `begins`, `lengths`: places and sizes, by number."""

    def __init__(self) -> None:
        self._frames: list[bytes] = []

    def add(self, octets: bytes) -> int:
        """The number of a further frame."""
        self._frames.append(octets)
        return len(self._frames) - 1

    def lay(self, which: Places) -> tuple[npt.NDArray[np.uint8], Places]:
        """The octets of those frames in order, and the length of each."""
        pool = np.frombuffer(b"".join(self._frames), np.uint8)
        sizes = np.array([len(one) for one in self._frames], np.int64)
        lengths = sizes[which]
        first = (np.cumsum(sizes) - sizes)[which]
        begins = np.cumsum(lengths) - lengths
        return pool[np.arange(int(lengths.sum())) + np.repeat(first - begins, lengths)], lengths


def _request(invoke: int, instance: int) -> bytes:
    return bytes((1, 4, 0x02, 0x75, invoke, 12, 0x0C, 0, instance >> 16, instance >> 8 & 255, instance & 255, 0x19, 85))


def _answer(invoke: int, instance: int, value: int) -> bytes:
    name = bytes((0x0C, 0, instance >> 16, instance >> 8 & 255, instance & 255, 0x19, 85))
    return bytes((1, 0, 0x30, invoke, 12)) + name + bytes((0x3E, 0x44)) + value.to_bytes(4, "big") + b"\x3f"


def reads(frames: int, seed: int = 1, damaged: float = 0.0, answered: float = 1.0) -> Reads:
    """About so many frames, one a read. `damaged`: part of them with one bit wrong, anywhere behind the preamble's
    first octet. `answered`: part of the requests that are."""
    dice = np.random.default_rng(seed)
    pool = Pool()
    tokens = np.array([pool.add(frame(0, (at + 1) % MASTERS, at)) for at in range(MASTERS)])
    polls = np.array([pool.add(frame(1, at + MASTERS, at)) for at in range(MASTERS)])
    poll_replies = np.array([pool.add(frame(2, at, at + MASTERS)) for at in range(MASTERS)])
    requests, answers = np.empty((2, MASTERS, _VARIANTS), np.int64)
    for at in range(MASTERS):
        for invoke in range(_VARIANTS):
            other = (at + 1 + invoke % (MASTERS - 1)) % MASTERS
            instance = 1000 * other + invoke
            value = int(dice.integers(1 << 32))
            requests[at, invoke] = pool.add(frame(5, other, at, _request(invoke, instance)))
            answers[at, invoke] = pool.add(frame(6, at, other, _answer(invoke, instance, value)))

    turns = max(1, int(frames * 0.73))
    holder = np.arange(turns) % MASTERS
    asks = dice.random(turns) < 0.13
    replied = asks & (dice.random(turns) < answered)
    looks = dice.random(turns) < 0.11
    met = looks & (dice.random(turns) < 0.01)
    invoke = (np.cumsum(asks) // 3) % _VARIANTS
    columns = (asks, replied, looks, met, np.ones(turns, bool))
    said = (requests[holder, invoke], answers[holder, invoke], polls[holder], poll_replies[holder], tokens[holder])
    pauses = ((2, 8), (6, 40), (2, 8), (1, 8), (21, 30))  # ms: least and most before each of them
    before = np.stack([dice.integers(least * MS, most * MS, turns) for least, most in pauses], 1)
    before[:, 4] = np.where(looks & ~met, before[:, 4], before[:, 0])
    before[:, 4] += np.where(asks & ~replied & ~looks, 255 * MS, 0)
    before[:, 2] += np.where(asks & ~replied, 255 * MS, 0)
    chosen = np.stack(columns, 1).ravel()
    octets, lengths = pool.lay(np.stack(said, 1).ravel()[chosen])
    if damaged:
        octets = _spoil(octets, lengths, damaged, dice)
    times = BASE + np.cumsum(before.ravel()[chosen] + lengths * TIMING.char)
    return Reads(octets, times, lengths, np.zeros(len(lengths), bool))


def _spoil(
    octets: npt.NDArray[np.uint8], lengths: Places, part: float, dice: np.random.Generator
) -> npt.NDArray[np.uint8]:
    which = np.flatnonzero(dice.random(len(lengths)) < part)
    begins = np.cumsum(lengths) - lengths
    at = begins[which] + dice.integers(1, lengths[which])
    spoilt = octets.copy()
    spoilt[at] ^= np.left_shift(1, dice.integers(0, 8, len(at))).astype(np.uint8)
    return spoilt


def track(columns: FrameColumns, bus: Reads) -> tuple[int, int]:
    """Pair all frames, by columns where that is certain and else by a tracker; rows by columns, and stretches."""
    tracker = MstpTracker(TIMING)
    pairing = Pairing(columns, bus.octets, TIMING, prepare(tracker))
    row = decided = stretches = 0
    while row < len(columns):
        run = pairing.run(tracker, row, row + 1) if row else None
        if run is None:
            event, header = frame_at(columns, row, bus.octets, "mstp", TIMING.latency)
            tracker.track(row + 1, event, header)
            row += 1
        else:
            decided, stretches, row = decided + run.end - run.begin, stretches + 1, run.end
    return decided, stretches


def main(frames: int, shares: list[float]) -> None:
    """Print how long kernel and pairing take, best of five and three."""
    for share in shares:
        bus = reads(frames, damaged=share)
        kernel(reads(1000), TIMING)
        columns = kernel(bus, TIMING)
        framing = min(_seconds(kernel, bus, TIMING) for _ in range(5))
        pairing = min(_seconds(track, columns, bus) for _ in range(3))
        decided, stretches = track(columns, bus)
        print(
            f"{len(bus)} frames, {share:.1%} damaged: kernel {framing:.3f} s, {len(columns) / len(bus):.2%} by columns "
            f"in {int((~columns.chained).sum())} chains; pairing {pairing:.3f} s, {decided / len(bus):.2%} by columns "
            f"in {stretches} runs"
        )


def _seconds(work: Callable[..., object], *arguments: object) -> float:
    begin = time.process_time()
    work(*arguments)
    return time.process_time() - begin


if __name__ == "__main__":
    numbers = sys.argv[1:]
    main(int(numbers[0]) if numbers else 1_000_000, [float(share) for share in numbers[1:]] or [0.0, 0.005])
