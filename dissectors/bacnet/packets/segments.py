"""A message in segments as the layer behind its last one: the whole, which stands in no single frame."""

from __future__ import annotations

from typing import Any, ClassVar

from scapy.fields import Field
from scapy.packet import Packet, Raw

from dissectors.bacnet.packets.apdus import BY_TYPE
from dissectors.frame import Assembly


class _Aside(Field):
    """Something known of the frame that is not in its octets."""

    def getfield(self, pkt: Any, s: bytes) -> tuple[bytes, Any]:
        return s, self.default

    def addfield(self, pkt: Any, s: bytes, val: Any) -> bytes:
        return s

    def i2repr(self, pkt: Any, x: Any) -> str:
        return str(x)


class Assembled(Packet):
    """The message of which the frame brings the last segment; builds no octets.

    `segments`: how many were seen. `frames`: which frames brought them. `missing`: which were not seen. `message`: the
    APDU as if it had come in one piece.
    """

    name = "Assembled from segments"
    fields_desc: ClassVar[list[Any]] = [
        _Aside("segments", 0),
        _Aside("frames", ""),
        _Aside("missing", "none"),
        _Aside("octets", 0),
        _Aside("message", None),
    ]


def assembled(assembly: Assembly) -> Assembled:
    """The layer for what the tracker gathered."""
    octets = assembly.octets
    return Assembled(
        segments=len(assembly.frames),
        frames=", ".join(map(str, assembly.frames)),
        missing=", ".join(map(str, assembly.missing)) or "none",
        octets=len(octets),
        message=BY_TYPE.get(octets[0] >> 4, Raw)(octets) if octets else "not whole",
    )
