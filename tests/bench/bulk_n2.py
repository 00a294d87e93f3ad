"""A busy N2 bus as arrays, by numpy alone: eight stations, polls and reads of analog inputs, 1 % refused."""

from __future__ import annotations

import numpy as np

from dissectors.line import LineSettings, Timing
from tests.bench import bulk_rtu

TIMING = Timing(LineSettings.parse("9600,8N1"))
HELD_BACK = Timing(LineSettings.parse("9600,8N1"), bulk_rtu.HELD_BACK.latency)

_DIGITS = np.frombuffer(b"0123456789ABCDEF", np.uint8)
_MOST = 16


def frames(count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """uint8[count, 16] and int64[count]: frames, command and answer in turn, and their lengths."""
    dice = np.random.default_rng(seed)
    pairs = -(-count // 2)
    unit, read = 1 + np.arange(pairs) % 8, dice.random(pairs) < 0.7
    refused, number = dice.random(pairs) < 0.01, dice.integers(1, 16, pairs)
    values = dice.integers(0, 16, (pairs, 8))
    table = np.zeros((2 * pairs, _MOST), np.uint8)
    asked, answered = table[0::2], table[1::2]
    asked[:, 0] = ord(">")
    asked[:, 1], asked[:, 2] = _DIGITS[unit >> 4], _DIGITS[unit & 0xF]
    asked[~read, 3:5] = np.frombuffer(b"04", np.uint8)
    asked[read, 3:5] = np.frombuffer(b"11", np.uint8)  # an analog input
    asked[read, 5], asked[read, 6] = _DIGITS[number[read] >> 4], _DIGITS[number[read] & 0xF]
    asked[read, 7:9] = np.frombuffer(b"03", np.uint8)
    answered[:, 0] = ord("A")
    carries = read & ~refused
    answered[carries, 1:9] = _DIGITS[values[carries]]
    length = np.full(2 * pairs, 2)
    length[0::2] = np.where(read, 12, 8)
    length[1::2][carries] = 12
    _seal(table, length, np.flatnonzero(length > 2))
    answered[refused, :3] = np.frombuffer(b"N11", np.uint8)
    length[1::2][refused] = 4
    rows = np.arange(2 * pairs)
    table[rows, length - 1] = 0x0D
    return table[:count], length[:count]


def _seal(table: np.ndarray, length: np.ndarray, rows: np.ndarray) -> None:
    """Put the sums of what stands between start character and check behind it."""
    check = table[rows, 1:].sum(1, dtype=np.uint8)
    table[rows, length[rows] - 3], table[rows, length[rows] - 2] = _DIGITS[check >> 4], _DIGITS[check & 0xF]
