"""Telegrams as scapy packets: to look at one, and to craft some.

    bytes(PBRequest(da=8, sa=2, fc=0x49))                                10 08 02 49 53 16   FDL status
    bytes(PBRequest(da=8, sa=2, fc=0x6D, dsap=60, ssap=62))              Slave_Diag
    bytes(PBToken(da=3, sa=2))  bytes(PBShort())

Start, lengths, sum and end are computed where they are None.
"""

from __future__ import annotations

from scapy.fields import ByteEnumField, ByteField, ConditionalField, StrField, XByteField
from scapy.packet import Packet, Raw

from dissectors.checksums import sum8
from dissectors.frame import Frame, Role
from dissectors.meaning import Node
from dissectors.profibus.outline import outline
from dissectors.profibus.telegram import ED, FIXED, SC, SD1, SD2, SD3, SD4, body_of

_TRAILER = 2
_SAPS = {
    53: "Ext_User_Prm",
    55: "Set_Slave_Add",
    56: "RD_Inp",
    57: "RD_Outp",
    58: "Global_Control",
    59: "Get_Cfg",
    60: "Slave_Diag",
    61: "Set_Prm",
    62: "Chk_Cfg or master",
}


class _AddressField(ByteField):
    """An address; its highest bit, that an access point follows, is set where one is given."""

    __slots__ = ("point",)

    def __init__(self, name: str, default: int, point: str) -> None:
        super().__init__(name, default)
        self.point = point

    def i2m(self, pkt: Packet, x: int | None) -> int:
        return (x or 0) | (0x80 if getattr(pkt, self.point, None) is not None else 0)

    def i2repr(self, pkt: Packet, x: int) -> str:
        return f"{x & 0x7F}" + (" with access point" if x & 0x80 else "")


class _PointField(ByteEnumField):
    """An access point; None where there is none."""

    __slots__ = ("address",)

    def __init__(self, name: str, address: str) -> None:
        super().__init__(name, None, _SAPS)
        self.address = address

    def addfield(self, pkt: Packet, s: bytes, val: int | None) -> bytes:
        return s if val is None else s + bytes((val & 0xFF,))

    def getfield(self, pkt: Packet, s: bytes) -> tuple[bytes, int | None]:
        is_there = getattr(pkt, self.address) & 0x80 and len(s) > _TRAILER
        return (s[1:], s[0]) if is_there else (s, None)


class _DataField(StrField):
    """Everything up to sum and end."""

    def getfield(self, pkt: Packet, s: bytes) -> tuple[bytes, bytes]:
        count = max(0, len(s) - _TRAILER)
        return s[count:], s[:count]

    def i2repr(self, pkt: Packet, x: bytes) -> str:
        return x.hex(" ") if isinstance(x, bytes) else str(x)


class PBRequest(Packet):
    """A telegram with addresses and frame control: SD1 without data, SD2 else; SD3 where `sd` says so."""

    name = "PROFIBUS FDL"
    fields_desc = (
        XByteField("sd", None),
        ConditionalField(ByteField("le", None), lambda pkt: pkt.sd in (None, SD2)),
        ConditionalField(ByteField("le_repeated", None), lambda pkt: pkt.sd in (None, SD2)),
        ConditionalField(XByteField("sd_repeated", None), lambda pkt: pkt.sd in (None, SD2)),
        _AddressField("da", 1, "dsap"),
        _AddressField("sa", 2, "ssap"),
        XByteField("fc", 0x6D),
        _PointField("dsap", "da"),
        _PointField("ssap", "sa"),
        _DataField("data", b""),
        XByteField("fcs", None),
        XByteField("ed", ED),
    )

    def self_build(self) -> bytes:
        """Compute what is None; what was dissected stays as it was."""
        points = [self.getfieldval(name) for name in ("dsap", "ssap")]
        body = bytes(
            (
                self.da | (0x80 if points[0] is not None else 0),
                self.sa | (0x80 if points[1] is not None else 0),
                self.fc,
                *(point for point in points if point is not None),
            )
        ) + bytes(self.data or b"")
        start = self.sd if self.sd is not None else SD1 if len(body) == 3 else SD2
        head = bytes((start,))
        if start == SD2:
            length = len(body) & 0xFF
            told = [self.getfieldval(name) for name in ("le", "le_repeated", "sd_repeated")]
            head += bytes(b if a is None else a for a, b in zip(told, (length, length, SD2), strict=True))
        return head + body + bytes((sum8(body) if self.fcs is None else self.fcs, self.ed))

    def tree(self) -> tuple[Node, ...] | None:
        """The telegram octet by octet, and what its service says."""
        return outline(bytes(self))

    def extract_padding(self, s: bytes) -> tuple[bytes, bytes]:
        """Nothing follows the end; what does is shown as padding."""
        return b"", s


class PBToken(Packet):
    """A token."""

    name = "PROFIBUS token"
    fields_desc = (XByteField("sd", SD4), ByteField("da", 2), ByteField("sa", 2))

    def tree(self) -> tuple[Node, ...] | None:
        """The telegram octet by octet."""
        return outline(bytes(self))


class PBShort(Packet):
    """A short acknowledgement."""

    name = "PROFIBUS short acknowledgement"
    fields_desc = (XByteField("sd", SC),)

    def tree(self) -> tuple[Node, ...] | None:
        """The telegram octet by octet."""
        return outline(bytes(self))


def packet(frame: Frame, role: Role) -> Packet:
    """The packet of a frame; total: what does not parse is Raw."""
    octets = frame.octets
    try:
        made = _dissected(octets)
        return made if bytes(made) == octets else Raw(octets)
    except Exception:  # scapy raises whatever its fields raise; a frame from the wire must always show
        return Raw(octets)


def _dissected(octets: bytes) -> Packet:
    if octets == bytes((SC,)):
        return PBShort(octets)
    if octets[0] == SD4 and len(octets) == FIXED[SD4]:
        return PBToken(octets)
    if octets[0] in (SD1, SD2, SD3) and len(body_of(octets)) >= 3:
        return PBRequest(octets)
    return Raw(octets)
