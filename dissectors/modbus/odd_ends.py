"""ASCII frames that are whole and do not end with CR LF (Modbus over Serial Line V1.02, 2.5.2). Pure."""

from __future__ import annotations

from enum import Enum
from typing import Final

from dissectors.findings import Tally
from dissectors.frame import Check, Damage, Event, Frame, Header, Noise
from dissectors.line import Timing
from dissectors.modbus.bus_record import BusRecord
from dissectors.modbus.envelope import ASCII_NAME
from dissectors.modbus.gaps import sender_of
from dissectors.tracker import Placement

_CR: Final = b"\r"
_LF: Final = b"\n"


class OddEnd(Enum):
    """What stands where CR LF should; the value says it behind "frames end with"."""

    CR_ALONE = "CR alone"
    LF_ALONE = "LF alone"
    LF_CR = "LF CR, the wrong way round"
    CR_CR_LF = "CR CR LF"

    @property
    def is_damage(self) -> bool:
        """Whether such a frame is not read as good: who waits for CR never sees its end."""
        return self in (OddEnd.LF_ALONE, OddEnd.LF_CR)


class OddEnds:
    """Fed frame by frame; writes what it finds into the evidence."""

    def __init__(self, timing: Timing, seen: BusRecord) -> None:
        self._seen = seen
        self._touching = timing.char + timing.latency
        self.newest: tuple[OddEnd, str, int, int] | None = None  # how, sender, time, frame

    def see(self, no: int, frame: Frame, header: Header, placement: Placement) -> None:
        """Take the next frame: nothing stands between it and the one before."""
        self._count()
        end = _end_of(frame, header)
        if end is not None:
            self.newest = end, sender_of(placement), frame.end, no

    def hear_noise(self, noise: Event) -> None:
        """Take octets that are no frame: directly behind a frame they belong to its end, or spoil it."""
        newest = self.newest
        if newest is not None and isinstance(noise, Noise) and noise.start - newest[2] <= self._touching:
            whole = _WITH_NOISE.get((newest[0], bytes(octet & 0x7F for octet in noise.octets[:3])))
            self.newest = None if whole is None else (whole, *newest[1:])
        self._count()

    def _count(self) -> None:
        newest, self.newest = self.newest, None
        if newest is not None:
            end, sender, time, no = newest
            self._seen.odd_ends.setdefault((end, sender), Tally()).add(time, no)


_WITH_NOISE: Final = {(OddEnd.CR_ALONE, _CR + _LF): OddEnd.CR_CR_LF, (OddEnd.LF_ALONE, _CR): OddEnd.LF_CR}
"""Ends that the framer cuts in two."""


def _end_of(frame: Frame, header: Header) -> OddEnd | None:
    if frame.protocol != ASCII_NAME:
        return None
    last = bytes(octet & 0x7F for octet in frame.octets[-2:])
    if header.ok:
        return OddEnd.CR_ALONE if last[1:] == _CR else None
    is_whole = frame.check is Check.GOOD and frame.damage is Damage.FORM and frame.repair is None
    return OddEnd.LF_ALONE if is_whole and last[1:] == _LF and last[:1] != _CR else None
