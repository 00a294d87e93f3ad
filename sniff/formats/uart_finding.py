"""Baud rate, polarity and character format of a line, from the edges of its level. Pure.

1. The shortest pulses are a bit, or what is left of one. Each usual rate near them, and the rate they have, is tried.
2. A right reading has its stop bits where they belong and its edges between bits. Seven, eight or nine bits between
   start and stop, both polarities: the best wins, eight where it does not matter.
3. The ninth bit is a parity when it goes with the others; so is the eighth, when many different characters agree.

What no listener can tell: a second stop bit from the silence after one. One is taken, and `second_stop` says so.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dissectors.line import FASTEST, NS_PER_S, SLOWEST, LineSettings
from sniff.formats.uart import FRAMING, Characters, Decoder, Uart
from sniff.formats.usual_rates import USUAL

if TYPE_CHECKING:
    import numpy.typing as npt

    from dissectors.columns import Times

SAMPLE = 20_000
"""Edges that are looked at."""
LEAST_CHARACTERS = 4
GOOD_LEAST = 0.8
"""Share of characters and edges that are where they belong, below which a channel holds no characters."""
_NEAR, _SAME_RATE = 0.15, 0.03
_BETWEEN = 0.3  # of a bit: an edge farther from where a bit begins is none of this rate
_OTHERS = 0.02
_WIDTHS = (8, 9, 7)  # in the order of liking


@dataclass(frozen=True, slots=True)
class Candidate:
    """One way to read a line, and how well it goes: 0 … 1."""

    uart: Uart
    score: float
    characters: Characters


def find(edges: Times, level: int) -> Uart | None:
    """How to read a channel that has these edges; None when they are no characters. `level`: before the first."""
    edges = edges[:SAMPLE]
    if len(edges) < 2 * LEAST_CHARACTERS:
        return None
    tried = [_tried(edges, level, bit, inverted) for bit in _bits(edges) for inverted in (False, True)]
    if not tried:
        return None
    best = max(tried, key=lambda one: one.score)
    if best.score < GOOD_LEAST or len(best.characters) < LEAST_CHARACTERS:
        return None
    if len(np.unique(best.characters.bits)) < 2:  # a clock
        return None
    bit = _measured(edges, best)
    again = _tried(edges, level, bit, best.uart.inverted)
    if again.score < best.score:
        again, bit = best, best.uart.bit
    return Uart(_line(again, bit), bit, best.uart.inverted)


def decoded(uart: Uart, edges: Times, level: int) -> Characters:
    """All characters of a channel whose edges are all there."""
    return Decoder(uart, level).feed(edges, int(edges[-1]) + 1 if len(edges) else 0)


def _bits(edges: Times) -> list[float]:
    """What a bit may last, ns."""
    widths = np.diff(edges)
    widths = widths[widths > 0]
    if not len(widths):
        return []
    found: dict[float, None] = {}
    for width in np.quantile(widths, (0.02, 0.1, 0.3)).tolist():
        for parts in (1, 2):
            rate = NS_PER_S * parts / width
            near = [usual for usual in USUAL if abs(usual / rate - 1) < _NEAR]
            found.update({NS_PER_S / usual: None for usual in near})
            if parts == 1:
                found.setdefault(float(width))
    return [bit for bit in found if 50 <= NS_PER_S / bit <= 10_500_000]


def _tried(edges: Times, level: int, bit: float, inverted: bool) -> Candidate:
    tried = [_read(edges, level, bit, inverted, width) for width in _WIDTHS]
    best = max(one.score for one in tried)
    return next(one for one in tried if one.score >= best - _OTHERS)


def _read(edges: Times, level: int, bit: float, inverted: bool, width: int) -> Candidate:
    line = LineSettings(9600, min(8, width), "M" if width == 9 else "N")
    uart = Uart(line, bit, inverted)
    found = decoded(uart, edges, level)
    if not len(found):
        return Candidate(uart, 0.0, found)
    framed = 1 - float((found.errors & FRAMING != 0).mean())
    offsets = _offsets(edges, found, bit)
    inside = offsets[(offsets > 0.1) & (offsets < width + 1.5)]
    fitting = float((np.abs(inside - np.rint(inside)) < _BETWEEN).mean()) if len(inside) else 0.0
    within = len(inside) + len(found)  # edges that are in a character or begin one
    return Candidate(uart, framed * fitting * min(1.0, within / len(edges) + _NEAR), found)


def _offsets(edges: Times, found: Characters, bit: float) -> npt.NDArray[np.float64]:
    """Where edges are in their characters, bits."""
    which = np.searchsorted(found.starts, edges, "right") - 1
    some = edges[which >= 0]
    return np.asarray((some - found.starts[which[which >= 0]]) / bit)


def _measured(edges: Times, best: Candidate) -> float:
    """ns of a bit, by the edges that are farthest from the begin of their characters."""
    bit = best.uart.bit
    offsets = _offsets(edges, best.characters, bit)
    inside = offsets[(offsets > 3.5) & (offsets < best.uart.width + 1.5)]
    return bit * float(np.median(inside / np.rint(inside))) if len(inside) >= LEAST_CHARACTERS else bit


def _line(found: Candidate, bit: float) -> LineSettings:
    rate = NS_PER_S / bit
    nearest = min(USUAL, key=lambda usual: abs(usual / rate - 1))
    baud = nearest if abs(nearest / rate - 1) <= _SAME_RATE else max(SLOWEST, min(FASTEST, round(rate)))
    width, characters = found.uart.width, found.characters
    good = characters.bits[characters.errors & FRAMING == 0]
    ones = (good[:, None] >> np.arange(width) & 1).sum(axis=1) & 1
    odd = float(ones.mean()) if len(good) else 0.5
    data, parity = min(8, width), "N"
    if width == 9:
        ninth = float((good >> 8 & 1).mean()) if len(good) else 1.0
        parity = "E" if odd <= 0.1 else "O" if odd >= 0.9 else "M" if ninth > 0.5 else "S"
    elif width == 8 and (odd <= 0.02 or odd >= 0.98) and len(np.unique(good)) >= 8:
        data, parity = 7, "E" if odd < 0.5 else "O"
    return LineSettings(baud, data, parity)


def second_stop(uart: Uart, characters: Characters) -> bool:
    """Whether there may be a second stop bit: nothing follows sooner, and most of what follows closely just then."""
    apart = np.diff(characters.starts) / uart.bit - 1 - uart.width
    close = apart[apart < 3]
    return len(close) >= 8 and float((close > 1.6).mean()) > 0.98 and float((close < 2.4).mean()) > 0.5
