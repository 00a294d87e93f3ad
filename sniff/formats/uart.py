"""Characters of a serial line out of the edges of its level, as columns. Pure.

A character begins with an edge away from the idle level; its bits are looked at in their middles, and the next one is
looked for from the middle of the stop bit on, as a receiver does. What is no start bit half a bit later is a spike.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dissectors.frame import LineError
from dissectors.line import NS_PER_S, LineSettings

if TYPE_CHECKING:
    from dissectors.columns import Octets, Times

LONGEST = 13
"""Bits from the begin of a character behind which nothing tells of it."""
PARITY, FRAMING, BREAK = LineError.PARITY.value, LineError.FRAMING.value, LineError.BREAK.value


@dataclass(frozen=True, slots=True)
class Uart:
    """How to read a line. `bit`: ns as measured, which need not be what `line` says. `inverted`: idle is low."""

    line: LineSettings
    bit: float
    inverted: bool = False

    @property
    def width(self) -> int:
        """Bits between start and stop: data and parity."""
        return self.line.data_bits + (self.line.parity != "N")

    @property
    def char(self) -> int:
        """ns of a character as measured."""
        return int(self.line.bits_per_char * self.bit)

    @property
    def baud(self) -> float:
        """Bits a second as measured."""
        return NS_PER_S / self.bit


@dataclass(frozen=True, slots=True)
class Characters:
    """Characters in order: begin and end, ns; `bits` as they came (data, then parity); octets; `errors`: values of
    LineError.
    """

    starts: Times
    ends: Times
    bits: Times
    octets: Octets
    errors: Octets

    def __len__(self) -> int:
        return len(self.starts)


class Decoder:
    """Reads the edges of one channel, in pieces. `level`: 0 or 1, before the first edge."""

    def __init__(self, uart: Uart, level: int) -> None:
        self.uart = uart
        self._level = level ^ uart.inverted  # before the edges that are held
        self._edges = np.zeros(0, np.int64)
        self._from = -(1 << 62)  # no character begins before
        self.spikes = 0

    def feed(self, edges: Times, before: int) -> Characters:
        """The characters that begin before `before`, ns; `edges`: those since the last call, ascending, up to LONGEST
        bits after that time or more."""
        uart = self.uart
        bit, width = uart.bit, uart.width
        edges = np.concatenate((self._edges, edges)) if len(self._edges) else edges
        falls = edges[1 - self._level :: 2]
        first, usable = np.searchsorted(falls, [self._from, before]).tolist()
        chosen, last = self._chain(edges, falls, first, usable)
        starts = falls[chosen]
        # where a character may still begin is where what is held begins
        held = 2 * last + 1 - self._level
        level, self._level = self._level, 1 if held < len(edges) else self._level ^ (len(edges) & 1)
        self._edges = edges[held:]
        if len(starts):
            self._from = int(starts[-1] + (width + 1.5) * bit)
        return self._characters(edges, level, starts)

    def _chain(self, edges: Times, falls: Times, first: int, usable: int) -> tuple[Times, int]:
        """Which of the falls begin a character, of those from `first` on and before `usable`; the next to look at."""
        bit = self.uart.bit
        some = falls[:usable]
        after = np.searchsorted(edges, (some + bit / 2).astype(np.int64), "right")
        is_start = ((after & 1) ^ self._level) == 0
        following = np.searchsorted(falls, (some + (self.uart.width + 1.5) * bit).astype(np.int64))
        following = np.where(is_start, following, 0)
        following = np.maximum(following, np.arange(1, len(some) + 1))  # on to the next, whatever the times are
        jumps, is_first = following.tolist(), is_start.tolist()
        chosen: list[int] = []
        at = first
        while at < usable:
            if is_first[at]:
                chosen.append(at)
            else:
                self.spikes += 1
            at = jumps[at]
        return np.array(chosen, np.int64), at

    def _characters(self, edges: Times, level: int, starts: Times) -> Characters:
        uart = self.uart
        data, width = uart.line.data_bits, uart.width
        middles = starts[:, None] + ((1.5 + np.arange(width + 1)) * uart.bit).astype(np.int64)
        levels = (np.searchsorted(edges, middles.ravel(), "right") & 1 ^ level).reshape(-1, width + 1)
        payload = levels[:, :width]
        bits = (payload << np.arange(width)).sum(axis=1)
        errors = np.zeros(len(starts), np.uint8)
        stopped = levels[:, width] == 1
        errors[~stopped] |= FRAMING
        errors[~stopped & (bits == 0)] = FRAMING | BREAK
        expected = {"E": 0, "O": 1}.get(uart.line.parity)
        if expected is not None:
            errors[stopped & (payload.sum(axis=1) & 1 != expected)] |= PARITY
        elif uart.line.parity in "MS":
            errors[stopped & (payload[:, data] != (uart.line.parity == "M"))] |= PARITY
        ends = starts + uart.char
        ends[:-1] = np.minimum(ends[:-1], starts[1:])  # a fast clock
        return Characters(starts, ends, bits, (bits & ((1 << data) - 1)).astype(np.uint8), errors)
