"""Pieces of a frame that a late read tore: rows that are no good frame, and put together are one. Pure, bounded.

A computer or an adapter that holds back the end of a frame shows its begin alone, behind it a silence that there never
was. Where the frame after it was read in time too, no time tells (`Frame.slack`); the octets do: no noise makes a good
frame of what stood before it.
"""

from __future__ import annotations

from typing import Final

from dissectors.frame import Chunk, Frame
from dissectors.framer import Framer
from dissectors.line import Timing
from dissectors.manifest import Dissector

PIECES: Final = 8
"""Most rows that one torn frame is."""

LONGEST: Final = 600
"""Octets; no more are put together."""


class TornPieces:
    """Fed every row that is no good frame, and told of good ones.

    `short`: octets; pieces are put together where one of them is no longer (what is long is no stray octet anyway).
    """

    def __init__(self, dissector: Dissector, timing: Timing, short: int) -> None:
        self._framer, self._timing = dissector.framer, Timing(timing.line)
        self._short = short
        self._pieces: list[bytes] = []  # since the last good frame

    def forget(self) -> None:
        """A good frame came."""
        if self._pieces:
            self._pieces = []

    def complete(self, octets: bytes) -> bool:
        """Take a row that is no good frame; whether it makes those before it a good one."""
        self._pieces.append(octets)
        if len(self._pieces) > PIECES or sum(map(len, self._pieces)) > LONGEST:
            self._pieces = []
        if len(self._pieces) < 2 or min(map(len, self._pieces)) > self._short:
            return False
        if not self._is_one_frame(b"".join(self._pieces)):
            return False
        self._pieces = []
        return True

    def _is_one_frame(self, octets: bytes) -> bool:
        framer: Framer = self._framer(self._timing)
        events = framer.feed(Chunk(len(octets) * self._timing.char, octets)) + framer.close()
        return len(events) == 1 and isinstance(events[0], Frame) and events[0].ok
