"""A bus slower than the port that listens: whether it is, and by how much. Pure.

Every bit of a bus that is `factor` times slower is `factor` bits to the listener. So all levels change at multiples of
`factor` from the begin of a character, which hardly any other octets do:

    sent        start  d0 d1 …                  stop         one character, each bit `factor` bits long
    heard       fall: 8 bits, stop bit; the next octet begins at the next fall. A stop bit at 0 is a framing error, and
                the line must rise before there is another fall.

Which characters they were is not asked: how long a level lasts behind such an error or a stop bit no octet tells, so
that several fit.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import lru_cache

from dissectors.line import LineSettings

FACTORS = (12, 8, 6, 4, 3, 2)
"""How much slower a bus may be, of those rates that are in use; the largest that fits is meant, 12 stands for more."""

LEAST_OCTETS = 12
"""So many octets must fit before it is believed: of random ones 1 in 16 does at factor 2, fewer at larger ones."""

LEAST_OF_BURST = 5
"""Octets of a burst, on average."""

_MOST_WAYS = 400  # to read a burst, at one place in it

_Partial = tuple[int, ...]
"""Bits of an octet that is being heard when a character ends, the start bit first; empty: the listener waits."""


def slower_by(bursts: Iterable[bytes], line: LineSettings) -> int:
    """How many times slower than `line` these bursts were sent, each after silence; 0 for not, or too few octets."""
    heard = [burst for burst in bursts if burst]
    octets = sum(map(len, heard))
    if octets < max(LEAST_OCTETS, LEAST_OF_BURST * len(heard)) or len(set().union(*heard)) < 2:
        return 0  # breaks and ringing are short, or always the same
    if line.stop_bits == 1.5 or line.data_bits < 7:
        return 0
    return next((factor for factor in FACTORS if all(_fits(burst, factor, line) for burst in heard)), 0)


def _fits(burst: bytes, factor: int, line: LineSettings) -> bool:
    """Whether whole characters with silence behind them are heard as these octets."""
    ways: set[tuple[int, _Partial]] = {(0, ())}
    while ways and len(ways) <= _MOST_WAYS:
        reached = {way for at, partial in ways for way in _with_one_more(burst, at, partial, factor, line)}
        if any(_is_end(burst, at, partial, line) for at, partial in reached):
            return True
        ways = {(at, partial) for at, partial in reached if at < len(burst)}
    return False


def _with_one_more(
    burst: bytes, at: int, partial: _Partial, factor: int, line: LineSettings
) -> Iterator[tuple[int, _Partial]]:
    """How far the burst is heard with each character that fits there, and what is begun then."""
    table = _table(factor, line, partial)
    for heard, then in (*table.get(burst[at], ()), *table.get(-1, ())):
        if burst.startswith(heard, at):
            yield at + len(heard), then


def _is_end(burst: bytes, at: int, partial: _Partial, line: LineSettings) -> bool:
    """Whether silence from here on leaves nothing over."""
    if not partial:
        return at == len(burst)
    return at + 1 == len(burst) and _value([*partial, *[1] * line.data_bits], line) == burst[-1]


@lru_cache(maxsize=4096)
def _table(factor: int, line: LineSettings, partial: _Partial) -> dict[int, tuple[tuple[bytes, _Partial], ...]]:
    """What is heard of a character, and what of an octet is begun as it ends; by the first octet heard, −1 for none."""
    found: dict[int, set[tuple[bytes, _Partial]]] = {}
    for octet in range(1 << line.data_bits):
        heard, then = _hear(_levels(octet, factor, line), partial, line)
        found.setdefault(heard[0] if heard else -1, set()).add((heard, then))
    return {first: tuple(ways) for first, ways in found.items()}


def _levels(octet: int, factor: int, line: LineSettings) -> list[int]:
    """The line during one character, bit by bit as the listener counts them."""
    data = [octet >> place & 1 for place in range(line.data_bits)]
    if line.parity != "N":
        data.append({"E": sum(data) & 1, "O": ~sum(data) & 1, "M": 1, "S": 0}[line.parity])
    bits = [0, *data, *[1] * int(line.stop_bits)]
    return [bit for bit in bits for _ in range(factor)]


def _hear(levels: list[int], partial: _Partial, line: LineSettings) -> tuple[bytes, _Partial]:
    """Octets that a UART makes of these levels, and what it has begun when they end."""
    needed = 2 + line.data_bits + (line.parity != "N")
    bits, heard = list(partial), bytearray()
    waits_for_rise = False
    for level in levels:
        if bits:
            bits.append(level)
            if len(bits) == needed:
                heard.append(_value(bits, line))
                waits_for_rise = not level
                bits = []
        elif waits_for_rise:
            waits_for_rise = not level
        elif not level:
            bits.append(level)
    return bytes(heard), tuple(bits)


def _value(bits: list[int], line: LineSettings) -> int:
    return sum(bit << place for place, bit in enumerate(bits[1 : 1 + line.data_bits]))
