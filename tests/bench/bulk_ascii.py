"""The bus of `bulk_rtu.py` in ASCII: the same messages as hex pairs, with LRC, CR and LF, by numpy alone."""

from __future__ import annotations

import numpy as np

from dissectors.line import LineSettings, Timing
from tests.bench import bulk_rtu

TIMING = Timing(LineSettings.parse("19200,7E1"))
HELD_BACK = Timing(LineSettings.parse("19200,7E1"), bulk_rtu.HELD_BACK.latency)

_DIGITS = np.frombuffer(b"0123456789ABCDEF", np.uint8)


def frames(count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """uint8[count, most] and int64[count]: frames, request and answer in turn, and their lengths."""
    table, length = bulk_rtu.frames(count, seed)
    body = length - 2
    table[np.arange(table.shape[1]) >= body[:, None]] = 0
    rows = np.arange(count)
    table[rows, body] = -table.sum(1, dtype=np.uint8)
    pairs = body + 1
    text = np.zeros((count, 2 * table.shape[1] + 3), np.uint8)
    text[:, 0] = ord(":")
    text[:, 1:-2:2], text[:, 2:-1:2] = _DIGITS[table >> 4], _DIGITS[table & 0xF]
    text[rows, 1 + 2 * pairs], text[rows, 2 + 2 * pairs] = 0x0D, 0x0A
    return text, 3 + 2 * pairs
