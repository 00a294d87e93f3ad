"""ASCII frames that end with CR alone: the LF behind it never came (Modbus over Serial Line V1.02, 2.5.2). Pure."""

from __future__ import annotations

from typing import Final

from dissectors.frame import Event, Frame, Header, Noise
from dissectors.line import Timing
from dissectors.modbus.bus_record import BusRecord
from dissectors.modbus.envelope import ASCII_NAME
from dissectors.modbus.gaps import sender_of
from dissectors.tracker import Placement

_CR: Final = 0x0D


class BareEnds:
    """Fed frame by frame; writes what it finds into the evidence."""

    def __init__(self, timing: Timing, seen: BusRecord) -> None:
        self._seen = seen
        self._touching = timing.char + timing.latency
        self.newest: tuple[str, int, int] | None = None  # sender, time, frame that ended with CR alone

    def see(self, no: int, frame: Frame, header: Header, placement: Placement) -> None:
        """Take the next frame: nothing stands between it and the one before."""
        self._count()
        if frame.protocol == ASCII_NAME and header.ok and frame.octets[-1] & 0x7F == _CR:
            self.newest = sender_of(placement), frame.end, no

    def hear_noise(self, noise: Event) -> None:
        """Take octets that are no frame: directly behind a CR they are an LF that was spoilt, not one left out."""
        if self.newest is not None and isinstance(noise, Noise) and noise.start - self.newest[1] <= self._touching:
            self.newest = None
        self._count()

    def _count(self) -> None:
        newest, self.newest = self.newest, None
        if newest is not None:
            sender, time, no = newest
            self._seen.gap_tally(self._seen.bare_ends, sender).add(time, no)
