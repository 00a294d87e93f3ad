"""Answers that begin in place of one answer and end in place of the next, behind another request. Pure.

    request ── 01 03 04 00 D7 00        a program takes seven octets of nine …
    request ── 1A CB C0 01 03 04 00     … and finds the rest of them at its next read
    request ── D7 00 1A CB C0 01 03

On a line nothing waits so: who logs its own reads does, or a device that holds the end of its answer back. Put together
they are good frames, and no damage makes one.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import Final

from dissectors.checksums import crc16_modbus
from dissectors.findings import Tally
from dissectors.modbus.functions import answer_length
from dissectors.modbus.lengths import MAX_FRAME

_REQUESTS_KEPT: Final = 4
_LEAST: Final = 2  # of them, each with a check that agrees
_HEAD: Final = 2  # octets of an answer that say whose it is, and of what


@dataclass(slots=True)
class CarriedOver:
    """Fed the octets behind each request that got no good answer. `units`: whose answers they were; `is_across`: one of
    them began behind a request to one station and ended behind one to another."""

    tally: Tally = field(default_factory=Tally)
    units: set[int] = field(default_factory=set)
    is_across: bool = False
    _before: bytes = b""  # what no answer was made of yet
    _asked: deque[bytes] = field(default_factory=lambda: deque(maxlen=_REQUESTS_KEPT))

    def hear(self, request: bytes, octets: bytes, time: int, *frames: int | None) -> None:
        """Take what came behind the next request."""
        self._asked.append(request)
        joined = self._before + octets
        end = self._end_of_one(joined)
        if end is not None:
            unit = joined[end[0]]
            self.tally.add(time, *frames)
            self.units.add(unit)
            self.is_across |= unit != request[0]
        self._before = joined[end[1] :] if end is not None else joined[-MAX_FRAME:]

    def begin_anew(self) -> None:
        """A request had its own answer: nothing is left of those before."""
        self._before = b""

    def is_habit(self, damaged: int) -> bool:
        """Whether most of so many damaged answers are such."""
        return self.tally.count >= _LEAST and 2 * self.tally.count >= damaged

    def _end_of_one(self, joined: bytes) -> tuple[int, int] | None:
        """Where an answer begins in what came before, and where it ends in what came now."""
        begun = len(self._before)
        lengths = {request[:_HEAD]: answer_length(request) for request in self._asked}
        for start in range(begun):
            length = lengths.get(joined[start : start + _HEAD])
            end = start + length if length is not None else 0
            if begun < end <= len(joined) and crc16_modbus(joined[start:end]) == 0:
                return start, end
        return None
