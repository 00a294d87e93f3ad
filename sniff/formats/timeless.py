"""Octets whose file has no times: pieces laid behind one another, with a silence between that nobody measured. Pure."""

from __future__ import annotations

from dissectors.line import MS, LineSettings

LINE_END = 10 * MS
"""Silence that stands for the end of a piece where nobody says how long it was: longer than the gap between frames at
the usual rates, shorter than what an adapter may hold back, so that it is no proof of two frames."""

SLOW = LineSettings.parse("9600,8E1")
"""Octets without times are laid so far apart at least, so that they do not lie over one another at a usual rate."""

LONGEST_FRAME = 260

IN_PACKETS = LINE_END + LONGEST_FRAME * SLOW.char
"""ns by which nobody knows when an octet of a packet without a time came."""


class Laid:
    """Where pieces lie that follow one another."""

    def __init__(self) -> None:
        self._end = 0

    def end_of(self, octets: int) -> int:
        """When the next piece of so many octets ends, ns."""
        self._end += (LINE_END if self._end else 0) + octets * SLOW.char
        return self._end
