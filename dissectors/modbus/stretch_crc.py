"""The CRC of any stretch of octets by a few look-ups: prefix CRCs, and what so many zero octets do to a CRC.

    S(i): register after the first i octets, begun with 0            register over [a, b) begun with FFFF
                                                                     = S(b) xor Z(b - a)(S(a) xor FFFF)

A CRC is linear: Z(n), what n octets of 0 make of a register, is a map that two tables of 256 entries hold. So the
prefix is computed for rows of octets at the same time, each begun with 0, and what stands before a row is added.
Source of the CRC: Modbus over Serial Line V1.02, 6.2.2. A whole good frame leaves 0.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from dissectors.modbus.lengths import MAX_FRAME, MIN_FRAME

if TYPE_CHECKING:
    import numpy.typing as npt

    from dissectors.columns import Masks, Octets, Times

    Registers = npt.NDArray[np.uint16]

ROW: Final = 256
"""Octets of a row."""

_POLYNOMIAL: Final = np.uint16(0xA001)
INITIAL: Final = np.uint16(0xFFFF)


def _after_an_octet(register: Registers) -> Registers:
    """A register after one octet of 0."""
    for _ in range(8):
        register = np.where(register & 1, register >> 1 ^ _POLYNOMIAL, register >> 1)
    return register


@lru_cache(maxsize=1)
def of_octet() -> Registers:
    """uint16[256]: the register 0 after one octet."""
    return _after_an_octet(np.arange(256, dtype=np.uint16))


@lru_cache(maxsize=1)
def _of_two() -> Registers:
    """uint16[65536]: what two octets (as one number, the first one low) make of the register 0."""
    return _after_an_octet(_after_an_octet(np.arange(1 << 16, dtype=np.uint16)))


@lru_cache(maxsize=1)
def _zeros() -> tuple[Registers, Registers]:
    """uint16[(MAX_FRAME + 1) * 256] each: what n zeros make of a low octet and of a high octet, at n * 256 + octet."""
    low = np.empty((MAX_FRAME + 1, 256), np.uint16)
    high = np.empty((MAX_FRAME + 1, 256), np.uint16)
    low[0] = np.arange(256)
    high[0] = low[0] << 8
    for count in range(MAX_FRAME):
        low[count + 1], high[count + 1] = _after_an_octet(low[count]), _after_an_octet(high[count])
    return low.ravel(), high.ravel()


def after_zeros(registers: Registers, counts: Times) -> Registers:
    """Registers after so many octets of 0 each (0 … 256)."""
    low, high = _zeros()
    base = counts << 8
    after: Registers = low[base + (registers & 0xFF)] ^ high[base + (registers >> 8)]
    return after


class StretchCrc:
    """CRC registers of stretches of some octets, each of at most 256."""

    __slots__ = ("_prefix",)

    def __init__(self, octets: Octets) -> None:
        self._prefix = _prefixes(octets)

    def registers(self, starts: Times, lengths: Times) -> Registers:
        """uint16: the register over each stretch, 0 where it is a frame with a good CRC."""
        before: Registers = self._prefix[starts] ^ INITIAL
        registers: Registers = self._prefix[starts + lengths] ^ after_zeros(before, lengths)
        return registers

    def good(self, starts: Times, lengths: Times) -> Masks:
        """Which stretches end with their own CRC."""
        good: Masks = self.registers(starts, lengths) == 0
        return good


def holds_a_good_frame(octets: bytes) -> bool:
    """Whether any stretch of at most MAX_FRAME octets in all, as long as the shortest frame, ends with its own CRC.

    All prefixes are taken as if so many octets of 0 followed that they end together; then the register over [a, b) is
    0 where those of a and b differ by what the first register becomes behind a.
    """
    of_zeros, of_initial = _listed_zeros()
    size, register, ended = len(octets), 0, [0]
    for left, octet in zip(range(size, 0, -1), octets, strict=True):
        register ^= of_zeros[left][octet]
        ended.append(register)
    behind = set()
    for begin in range(size - MIN_FRAME, -1, -1):
        behind.add(ended[begin + MIN_FRAME])
        if ended[begin] ^ of_initial[size - begin] in behind:
            return True
    return False


@lru_cache(maxsize=1)
def _listed_zeros() -> tuple[list[list[int]], list[int]]:
    """What n zeros make of each octet, and of the first register."""
    counts = np.arange(MAX_FRAME + 1)
    of_initial = after_zeros(np.full(len(counts), INITIAL), counts)
    return _zeros()[0].reshape(-1, 256).tolist(), of_initial.tolist()


def _prefixes(octets: Octets) -> Registers:
    """uint16[n + 1]: S(i)."""
    count = len(octets)
    rows = -(-count // ROW)
    padded = np.zeros(rows * ROW, np.uint8)
    padded[:count] = octets
    pairs = np.ascontiguousarray(padded.view("<u2").reshape(rows, ROW // 2).T)
    prefix = np.empty((rows, ROW // 2 + 1), np.uint16)  # at even places of each row; the last is that of the next row
    table = _of_two()
    register = np.zeros(rows, np.uint16)
    prefix[:, 0] = 0
    for place, pair in enumerate(pairs, 1):
        register = table[register ^ pair]
        prefix[:, place] = register
    before = _chained(register)
    low, high = _zeros()
    places = np.arange(0, ROW, 2) << 8
    even = prefix[:, :-1]
    even ^= low[places + (before & 0xFF)[:, None]]
    even ^= high[places + (before >> 8)[:, None]]
    whole = np.empty(rows * ROW + 1, np.uint16)
    whole[0:-1:2] = even.ravel()
    evens = whole[0:-1:2]
    whole[1::2] = of_octet()[(evens ^ padded[0::2]) & 0xFF] ^ evens >> 8
    if rows:
        last = rows * ROW - 1
        whole[-1] = of_octet()[(int(whole[last]) ^ int(padded[last])) & 0xFF] ^ int(whole[last]) >> 8
    else:
        whole[-1] = 0
    return whole[: count + 1]


def _chained(ends: Registers) -> Registers:
    """What stands before each row, from what each leaves by itself: doubling steps."""
    before = np.zeros(len(ends), np.uint16)
    before[1:] = ends[:-1]
    low, high = (table[ROW << 8 : (ROW + 1) << 8].copy() for table in _zeros())  # a row of zeros
    step = 1
    while step < len(ends):
        earlier = before[:-step].copy()
        before[step:] ^= low[earlier & 0xFF] ^ high[earlier >> 8]
        low, high = (low[table & 0xFF] ^ high[table >> 8] for table in (low, high))
        step *= 2
    return before
