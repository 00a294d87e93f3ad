"""Collisions: what a receiver gets when drivers talk over each other, bits mixed in time, sampled like a UART does.

Used only where transmissions overlap or the line is held low; a transmission that is alone needs no bits. The model:
a driver that is off leaves the line at 1 (fail-safe bias), and where two drivers disagree the 0 wins. Real drivers
fight to an undefined level; that the outcome is garbage with framing errors is what matters here.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from dissectors.frame import LineError, Mark
from dissectors.line import LineSettings

Low = tuple[int, int]
"""A time [begin, end), ns, in which a driver holds the line at 0."""


class ReceivedOctets(NamedTuple):
    """Octets as a receiver got them, the end of each (ns, ascending), and what its UART said of them."""

    octets: bytes
    ends: Sequence[int]
    marks: tuple[Mark, ...]


def low_times(line: LineSettings, start: int, octets: bytes, flips: dict[int, int]) -> list[Low]:
    """When one transmission holds the line low.

    `flips`: octet offset → mask over its data bits (from bit 0) and its parity bit (bit `line.data_bits`).
    """
    lows: list[Low] = []
    bit = line.char / line.bits_per_char
    for index, octet in enumerate(octets):
        begin = start + index * line.char
        for place, level in enumerate((0, *_bits(line, octet, flips.get(index, 0)))):
            if not level:
                lows.append((begin + round(place * bit), begin + round((place + 1) * bit)))
    return lows


def receive(line: LineSettings, lows: Iterable[Low]) -> ReceivedOctets:
    """Read the mixed line with a UART: start edge, samples in the middle of each bit, stop bit.

    A stop bit at 0 is a framing error, all bits at 0 a break; the receiver then waits for the line to rise.
    """
    merged = _merge(lows)
    begins = [begin for begin, _ in merged]
    bit = line.char / line.bits_per_char
    octets = bytearray()
    ends: list[int] = []
    marks: list[Mark] = []

    def low_at(time: float) -> bool:
        place = bisect_right(begins, time) - 1
        return place >= 0 and time < merged[place][1]

    time = merged[0][0] if merged else 0
    while (edge := _next_fall(merged, begins, time)) is not None:
        levels = [not low_at(edge + (place + 0.5) * bit) for place in range(1, _framed_bits(line) + 1)]
        value = sum(1 << place for place in range(line.data_bits) if levels[place])
        error = _error(line, levels, value)
        if error:
            marks.append(Mark(len(octets), error))
        octets.append(value)
        ends.append(edge + line.char)
        time = edge + int((_framed_bits(line) + 0.5) * bit)
        if not levels[-1]:  # still low: no new start bit before the line rises
            time = merged[bisect_right(begins, time) - 1][1] if low_at(time) else time
    return ReceivedOctets(bytes(octets), ends, tuple(marks))


def parity_bit(line: LineSettings, octet: int) -> int | None:
    """The parity bit that a driver adds to `octet`, None where the line has none."""
    if line.parity == "N":
        return None
    odd_ones = (octet & ((1 << line.data_bits) - 1)).bit_count() & 1
    return {"E": odd_ones, "O": odd_ones ^ 1, "M": 1, "S": 0}[line.parity]


def _bits(line: LineSettings, octet: int, flip: int) -> list[int]:
    """Data bits, least significant first, then the parity bit."""
    bits = [(octet ^ flip) >> place & 1 for place in range(line.data_bits)]
    parity = parity_bit(line, octet)
    if parity is not None:
        bits.append(parity ^ (flip >> line.data_bits & 1))
    return bits


def _framed_bits(line: LineSettings) -> int:
    """Bits that a receiver samples after the start bit: data, parity, one stop bit."""
    return line.data_bits + (line.parity != "N") + 1


def _error(line: LineSettings, levels: list[bool], value: int) -> LineError:
    if not any(levels):
        return LineError.BREAK
    error = LineError(0)
    if not levels[-1]:
        error |= LineError.FRAMING
    parity = parity_bit(line, value)
    if parity is not None and parity != levels[line.data_bits]:
        error |= LineError.PARITY
    return error


def _merge(lows: Iterable[Low]) -> list[Low]:
    merged: list[Low] = []
    for begin, end in sorted(lows):
        if merged and begin <= merged[-1][1]:
            merged[-1] = (merged[-1][0], max(end, merged[-1][1]))
        else:
            merged.append((begin, end))
    return merged


def _next_fall(merged: list[Low], begins: list[int], time: int) -> int | None:
    """First moment from `time` on at which the line is low."""
    place = bisect_right(begins, time) - 1
    if place >= 0 and time < merged[place][1]:
        return time
    return begins[place + 1] if place + 1 < len(begins) else None
