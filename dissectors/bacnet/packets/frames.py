"""The MS/TP frame as a scapy packet, whole or in pieces (ANSI/ASHRAE 135, 9.3)."""

from __future__ import annotations

import struct
from typing import Any, ClassVar

from scapy.fields import (
    ByteEnumField,
    ByteField,
    Field,
    ShortField,
    TrailerField,
    XByteField,
    XShortField,
    XStrField,
    XStrLenField,
)
from scapy.packet import Packet, Raw

from dissectors.bacnet import cobs, frame_types
from dissectors.bacnet.frame_types import CARRIES_NPDU, HEADER, PROPRIETARY, data_length, is_encoded, total
from dissectors.bacnet.packets.network import NPDU
from dissectors.checksums import crc8_mstp, crc16_x25


class _OptionalTrailer(TrailerField):
    """A trailer that only some frames have; absent is None."""

    __slots__ = ("size",)

    def __init__(self, field: Field, size: Any) -> None:
        super().__init__(field)
        self.size = size

    def getfield(self, pkt: Any, s: bytes) -> tuple[bytes, Any]:
        return super().getfield(pkt, s) if self.size(pkt) > 0 else (s, None)

    def addfield(self, pkt: Any, s: bytes, val: Any) -> bytes:
        return super().addfield(pkt, s, val) if val is not None else s


def _pad_size(pkt: Any) -> int:
    return max(0, len(pkt.original) - total(pkt.length or 0))


def _crc_size(pkt: Any) -> int:
    return 2 if pkt.length and not is_encoded(pkt.frame_type) else 0


class MSTP(Packet):
    """A whole MS/TP frame. `length`, `header_crc`, `data_crc` None: computed."""

    name = "MS/TP"
    fields_desc: ClassVar[list[Any]] = [
        XShortField("preamble", 0x55FF),
        ByteEnumField("frame_type", 0, {n: frame_types.title(n) for n in range(256)}),
        ByteField("destination", 255),
        ByteField("source", 0),
        ShortField("length", None),
        XByteField("header_crc", None),
        _OptionalTrailer(XStrLenField("pad", None, length_from=_pad_size), _pad_size),
        _OptionalTrailer(XShortField("data_crc", None), _crc_size),
    ]

    def pre_dissect(self, s: bytes) -> bytes:
        """Encoded data are decoded first, so that what follows the header is plain."""
        if len(s) >= HEADER and is_encoded(s[2]):
            length = data_length(s)
            data = cobs.decode_body(s[HEADER : HEADER + length + 2])
            if data is not None:
                return s[:HEADER] + data + s[total(length) :]
        return s

    def post_dissect(self, s: bytes) -> bytes:
        self.raw_packet_cache = None  # the octets of this layer are not contiguous: it is always built anew
        return s

    def post_build(self, pkt: bytes, pay: bytes) -> bytes:
        pad = self.pad or b""
        body = pay[: len(pay) - len(pad)] if pad else pay
        if is_encoded(self.frame_type):
            body = cobs.encode_body(body) if body else b""
        elif body and self.data_crc is None:
            body += struct.pack("<H", crc16_x25(body))
        if self.length is None:
            pkt = pkt[:5] + struct.pack(">H", max(0, len(body) - 2)) + pkt[7:]
        if self.header_crc is None:
            pkt = pkt[:7] + bytes((crc8_mstp(pkt[2:7]),)) + pkt[8:]
        return pkt + body + pad

    def guess_payload_class(self, payload: bytes) -> Any:
        if self.frame_type in CARRIES_NPDU:
            return NPDU
        return Proprietary if self.frame_type >= PROPRIETARY else Raw

    def mysummary(self) -> str:
        return f"{frame_types.title(self.frame_type)} {self.source} → {self.destination}"


class _Tolerant(Field):
    """An unsigned number of one or two octets that may be cut off; then it is None and takes no octets."""

    def getfield(self, pkt: Any, s: bytes) -> tuple[bytes, Any]:
        return super().getfield(pkt, s) if len(s) >= self.sz else (s, None)

    def addfield(self, pkt: Any, s: bytes, val: Any) -> bytes:
        return s if val is None else super().addfield(pkt, s, val)


class MSTPFragment(Packet):
    """A frame that is cut off, or whose data cannot be read: what is there, the rest as octets."""

    name = "MS/TP fragment"
    fields_desc: ClassVar[list[Any]] = [
        _Tolerant("preamble", 0x55FF, "H"),
        _Tolerant("frame_type", 0, "B"),
        _Tolerant("destination", None, "B"),
        _Tolerant("source", None, "B"),
        _Tolerant("length", None, "H"),
        _Tolerant("header_crc", None, "B"),
        XStrField("rest", b""),
    ]

    def mysummary(self) -> str:
        return f"{frame_types.title(self.frame_type or 0)} {self.source} → {self.destination}, not readable"


class Proprietary(Packet):
    """Data of a proprietary frame type."""

    name = "Proprietary"
    fields_desc: ClassVar[list[Any]] = [ShortField("vendor_id", 0)]
