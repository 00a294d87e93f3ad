"""A busy RTU bus of a million frames as arrays, by numpy alone: eight stations, functions 3, 6 and 16, 1 % refused.

    .venv/bin/python -m tests.bench.bulk_rtu [FRAMES]

measures kernel and pairing on it: reads with silences between, reads behind an adapter that holds back, each clean and
with 0.5 % of the frames damaged.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from time import process_time

import numpy as np

from dissectors.columns import Reads
from dissectors.line import LineSettings, Timing
from dissectors.modbus.stretch_crc import StretchCrc

TIMING = Timing(LineSettings.parse("19200,8E1"))
HELD_BACK = replace(TIMING, latency=17_000_000)

_MOST = 48
_MS = 1_000_000


def frames(count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """uint8[count, 48] and int64[count]: frames, request and answer in turn, and their lengths."""
    dice = np.random.default_rng(seed)
    pairs = -(-count // 2)
    unit = 1 + np.arange(pairs) % 8
    kind = dice.choice((3, 6, 16), pairs, p=(0.85, 0.1, 0.05))
    registers = dice.integers(1, 13, pairs)
    registers[kind == 16] = dice.integers(1, 9, int((kind == 16).sum()))
    refused = dice.random(pairs) < 0.01
    table = np.zeros((2 * pairs, _MOST), np.uint8)
    asked, answered = table[0::2], table[1::2]
    for side in (asked, answered):
        side[:, 0], side[:, 1] = unit, kind
    address = 40 * unit + dice.integers(0, 20, pairs)
    asked[:, 2], asked[:, 3] = address >> 8, address & 0xFF
    asked[:, 5] = registers
    values = dice.integers(0, 256, (pairs, 2 * 13), np.uint8)
    values[:, 0::2] //= 32
    reads, writes, many = kind == 3, kind == 6, kind == 16
    asked[writes, 4:6] = values[writes, :2]
    asked[many, 6] = 2 * registers[many]
    asked[many, 7:33] = values[many]
    answered[reads, 2] = 2 * registers[reads]
    answered[reads, 3:29] = values[reads]
    answered[~reads, 2:6] = asked[~reads, 2:6]
    answered[refused, 1] |= 0x80
    answered[refused, 2] = 2
    length = np.full(2 * pairs, 8)
    length[0::2][many] = 9 + 2 * registers[many]
    length[1::2][reads] = 5 + 2 * registers[reads]
    length[1::2][refused] = 5
    _seal(table, length)
    return table[:count], length[:count]


def _seal(table: np.ndarray, length: np.ndarray) -> None:
    flat = table.ravel()
    for begin in range(0, len(table), 1 << 16):
        rows = np.arange(begin, min(begin + (1 << 16), len(table)))
        crc = StretchCrc(flat[rows[0] * _MOST : (rows[-1] + 1) * _MOST])
        check = crc.registers((rows - rows[0]) * _MOST, length[rows] - 2)
        table[rows, length[rows] - 2] = check & 0xFF
        table[rows, length[rows] - 1] = check >> 8


def damaged(table: np.ndarray, length: np.ndarray, share: float, seed: int = 1) -> np.ndarray:
    """The same frames with one octet changed in some."""
    dice = np.random.default_rng(seed)
    table = table.copy()
    which = np.flatnonzero(dice.random(len(table)) < share)
    table[which, dice.integers(0, length[which])] ^= dice.integers(1, 256, len(which), np.uint8)
    return table


def bus(table: np.ndarray, length: np.ndarray, timing: Timing) -> Reads:
    """The frames as an adapter reads them: one read each; held back for 16 ms, or until 62 octets are there."""
    octets = table[np.arange(table.shape[1]) < length[:, None]]
    pause = np.where(np.arange(len(table)) & 1, 5 * _MS, 9 * _MS)
    end = np.cumsum(pause + length * timing.char)
    if not timing.latency:
        return Reads(octets, end, length.astype(np.int64), np.zeros(len(table), bool))
    behind = np.arange(len(octets)) - np.repeat(np.cumsum(length), length) + 1
    tick = (np.repeat(end, length) + behind * timing.char) // (16 * _MS)
    first = np.flatnonzero(np.append(True, tick[1:] != tick[:-1]))
    count = np.diff(np.append(first, len(octets)))
    return Reads(octets, (tick[first] + 1) * 16 * _MS, count, np.zeros(len(first), bool))


def blocks(reads: Reads, octets: int) -> Iterator[Reads]:
    """The same reads in blocks of about so many octets."""
    begins = reads.begins
    cuts = np.unique(np.searchsorted(begins, np.arange(0, len(reads.octets), octets)))
    for first, end in pairwise([*cuts.tolist(), len(reads)]):
        before = int(reads.times[first - 1]) if first else None
        part = slice(first, end)
        yield Reads(
            reads.octets[begins[first] : begins[end]],
            reads.times[part],
            reads.lengths[part],
            reads.marked[part],
            before,
        )


def main(count: int) -> None:
    """CPU seconds of kernel and pairing, in one go and in blocks of half a MiB, and the share of frames that they tell.

    The pairing is that of a bus of which the response times are known where a run begins.
    """
    from dissectors.modbus.exchange_columns import exchanges, placed
    from dissectors.modbus.exchange_memory import Known, holding, passed
    from dissectors.modbus.kernel import kernel

    table, length = frames(count)
    kernel(bus(table[:1000], length[:1000], TIMING), TIMING)
    known = Known(None, False, dict.fromkeys(range(1, 9), (5 * _MS,) * 16))
    for name, timing in (("with gaps", TIMING), ("held back", HELD_BACK)):
        for share in (0.0, 0.005):
            spoilt = damaged(table, length, share) if share else table
            reads = bus(spoilt, length, timing)
            begin = process_time()
            columns = kernel(reads, timing)
            whole = process_time()
            parts = sum(len(kernel(part, timing)) for part in blocks(reads, 1 << 19))
            by_blocks = process_time()
            found = exchanges(columns, reads.octets, timing)
            placed(found, columns, slice(0, len(found)), np.arange(len(columns)), 1, timing)
            paired = process_time()
            place, seams, held = 0, 0, 0
            while place < len(found):
                end = holding(found, columns, place, known, timing)
                passed(found, columns, place, end)
                held, place, seams = held + end - place, max(end, place + 1), seams + 1
            print(
                f"{name}, {share:.1%} damaged: kernel {whole - begin:.2f} s ({len(columns) / count:.2%}), "
                f"in blocks {by_blocks - whole:.2f} s ({parts / count:.2%}), pairing {paired - by_blocks:.2f} s, "
                f"{seams} seams {process_time() - paired:.2f} s ({2 * held / count:.2%})"
            )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000)
