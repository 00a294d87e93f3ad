"""N2 frames under other names: addresses renumbered; values are kept."""

from __future__ import annotations

from dissectors.checksums import sum8
from dissectors.frame import Frame
from dissectors.pseudonyms import Pseudonyms, hex_octet


class N2Renamer:
    """Renames N2 commands; answers carry no address."""

    def __init__(self) -> None:
        self.stations = Pseudonyms(range(1, 256), kept=(0,))

    def __call__(self, frame: Frame) -> bytes:
        """The frame under another name."""
        octets = frame.octets
        address = hex_octet(octets[1:3])
        if octets[:1] != b">" or address is None:
            return octets
        renamed = b"%02X" % self.stations.of(address)
        if not frame.ok or len(octets) < 6:
            return octets[:1] + renamed + octets[3:]
        body = renamed + octets[3:-3]
        return octets[:1] + body + b"%02X" % sum8(body) + octets[-1:]
