"""N2 frames under other names: addresses renumbered, damaged ones with what is wrong with them; values are kept."""

from __future__ import annotations

from dissectors.checksums import sum8
from dissectors.frame import Flaw, Frame
from dissectors.pseudonyms import Pseudonyms, hex_octet, inflicted

_SHORTEST = 7  # octets of a command: > A A C K K CR


class N2Renamer:
    """Renames N2 commands; answers carry no address."""

    def __init__(self) -> None:
        self.stations = Pseudonyms(range(1, 256), kept=(0,))

    def __call__(self, frame: Frame) -> bytes:
        """The frame under another name."""
        if frame.repair is None:
            return self._renamed(frame.octets, is_sure=frame.ok)
        whole = frame.repair.octets
        renamed = self._renamed(whole)
        if frame.repair.flaw is not Flaw.CHECK_SWAPPED or whole[:1] != b">":
            return inflicted(frame.octets, whole, renamed)
        swapped = renamed[:-3] + renamed[-2:-1] + renamed[-3:-2] + renamed[-1:]
        return swapped if swapped != renamed else self._renamed(frame.octets)  # of two digits alike nothing shows

    def _renamed(self, octets: bytes, *, is_sure: bool = True) -> bytes:
        """The octets of a command with another address; its sum is right as before, or wrong by as much."""
        address = hex_octet(octets[1:3])
        if octets[:1] != b">" or address is None:
            return octets
        name = b"%02X" % (self.stations.of(address) if is_sure else self.stations.of_doubtful(address))
        sent = hex_octet(octets[-3:-1])
        if len(octets) < _SHORTEST or octets[-1:] != b"\r" or sent is None:
            return octets[:1] + name + octets[3:]
        moved = sum8(name) - sum8(octets[1:3])
        return octets[:1] + name + octets[3:-3] + b"%02X" % (sent + moved & 0xFF) + octets[-1:]
