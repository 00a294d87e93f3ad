"""Line settings ("19200,8E1"), character times and the gap rules that follow from them."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import lru_cache

from dissectors.quick_values import quickly_made

NS_PER_S = 1_000_000_000
MS = 1_000_000
"""ns in a millisecond."""

SLOWEST, FASTEST = 50, 12_000_000
"""bit/s; the fastest is that of PROFIBUS (IEC 61158-2)."""

_TOKEN = re.compile(r"(?P<baud>\d{2,8})(?:,(?P<data>[5-8])(?P<parity>[NEOMS])(?P<stop>1\.5|1|2))?", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class LineSettings:
    """Baud rate and character format of a line.

    `baud`: bit/s, SLOWEST … FASTEST. `data_bits` 5 … 8. `parity` one of N E O M S. `stop_bits` 1, 1.5 or 2.
    `char`: time of one character, ns, rounded down; it follows from the others and is asked for with every frame.
    """

    baud: int = 9600
    data_bits: int = 8
    parity: str = "N"
    stop_bits: float = 1
    char: int = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "char", _char(self.baud, self.data_bits, self.parity, self.stop_bits))

    @classmethod
    def parse(cls, token: str) -> LineSettings:
        """Read "19200,8E1" or "19200" (then 8N1).

        Raises ValueError with what was expected.
        """
        match = _TOKEN.fullmatch(token.strip())
        if match is None:
            raise ValueError(
                f"line settings {token!r}: expected baud rate, data bits, parity (N E O M S) and stop bits as 19200,8E1"
            )
        baud = int(match["baud"])
        if not SLOWEST <= baud <= FASTEST:
            raise ValueError(f"line settings {token!r}: baud rate {baud} is outside {SLOWEST} … {FASTEST}")
        if match["data"] is None:
            return cls(baud)
        return cls(baud, int(match["data"]), match["parity"].upper(), float(match["stop"]))

    def __str__(self) -> str:
        return f"{self.baud},{self.data_bits}{self.parity}{self.stop_bits:g}"

    @property
    def bits_per_char(self) -> float:
        """Bits on the wire for one character: start, data, parity, stop."""
        return _bits(self.data_bits, self.parity, self.stop_bits)

    def bits(self, count: float) -> int:
        """Time of `count` bits, ns."""
        return int(count * NS_PER_S // self.baud)


def _bits(data: int, parity: str, stop: float) -> float:
    return 1 + data + (parity != "N") + stop


@lru_cache(256)  # lines are made again and again
def _char(baud: int, data: int, parity: str, stop: float) -> int:
    return int(_bits(data, parity, stop) * NS_PER_S // baud)


@quickly_made
@dataclass(frozen=True, slots=True)
class Timing:
    """A line and how far its times can be trusted.

    `latency`: ns that adapter and host may hold an octet back (FTDI: latency timer + 1 ms); 0 for exact times.
    `is_told`: whether that is known; else it is what the reads seem to say, and single times may be later still.
    `has_rate`: whether the baud rate of `line` is the bus's; else it is what such a bus normally runs at. `has_times`:
    whether the capture says when anything came; else its octets are laid one behind the other.
    """

    line: LineSettings = LineSettings()
    latency: int = 0
    is_told: bool = True
    has_rate: bool = True
    has_times: bool = True

    @property
    def char(self) -> int:
        """Time of one character, ns."""
        return self.line.char

    @property
    def t15(self) -> int:
        """Longest silence allowed inside an RTU frame, ns (Modbus over Serial Line V1.02, 2.5.1.1)."""
        return self._chars(1.5, 750_000)

    @property
    def t35(self) -> int:
        """Shortest silence between RTU frames, ns (same clause); fixed 1.75 ms above 19200 Bd.

        Counted in characters as configured: a 10-bit character makes it shorter than the standard's 11-bit table,
        which is what devices on such a line do.
        """
        return self._chars(3.5, 1_750_000)

    def _chars(self, count: float, fixed: int) -> int:
        return fixed if self.line.baud > 19200 else int(count * self.line.char)
