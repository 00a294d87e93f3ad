"""RTU and ASCII frames as scapy packets, around the PDUs of `pdus.py`: to look at one frame and to craft frames.

    bytes(RTU(unit=1) / ReadHoldingRegistersRequest(startAddr=0x2520, quantity=2))  ==  01 03 25 20 00 02 CE CD
    bytes(ASCII(unit=1) / ReadHoldingRegistersRequest(startAddr=0x2520, quantity=2))  ==  b":010325200002B5\\r\\n"

The check is computed where it is None; one that is given stays, right or wrong (`RTU(unit=1, crc=0xDEAD) / …`). Its
number reads in wire order: B6 50 on the line is 0xB650, as in Wireshark.
"""

from __future__ import annotations

from binascii import hexlify
from typing import Any, ClassVar

from scapy.fields import ByteField, FCSField, Field
from scapy.packet import Packet, Raw

from dissectors.checksums import crc16_modbus, lrc
from dissectors.frame import Check, Damage, Frame, Role
from dissectors.modbus.envelope import ASCII_NAME, hex_pairs
from dissectors.modbus.header import peek_ascii, peek_rtu
from dissectors.modbus.pdus import Cut, OtherFunction, Pdu, pdu_class


class CheckField(FCSField):
    """The check at the end of the frame, shown with what it should be when it is wrong."""

    def i2repr(self, pkt: Any, x: int | None) -> str:
        if x is None:
            return "computed"
        digits = 2 * self.fld.sz
        due = pkt.due_check()
        wrong = f" [wrong, should be 0x{due:0{digits}X}]" if due is not None and due != x else ""
        return f"0x{x:0{digits}X}{wrong}"


class AsideField(Field):
    """Part of the frame that stands outside unit, PDU and check; the packet puts it in its place. Value: bytes."""

    def __init__(self, name: str, default: bytes) -> None:
        Field.__init__(self, name, default, "0s")

    def getfield(self, pkt: Any, s: bytes) -> tuple[bytes, bytes]:
        return s, pkt.aside[self.name]

    def addfield(self, pkt: Any, s: bytes, val: bytes) -> bytes:
        return s

    def i2repr(self, pkt: Any, x: bytes) -> str:
        return repr(x)


class Adu(Packet):
    """Unit and PDU in an envelope. `response`, `unknown`: which PDU class the octets are read with."""

    response = False
    unknown = False
    check_name = ""
    _origin: bytes | None = None  # octets that the check covers, as they were dissected

    def guess_payload_class(self, payload: bytes) -> type[Packet]:
        return OtherFunction if self.unknown else pdu_class(payload, self.response)

    def extract_padding(self, s: bytes) -> tuple[bytes, None]:
        return s, None

    def compute(self, octets: bytes) -> int:
        """The check over unit and PDU."""
        raise NotImplementedError

    def due_check(self) -> int | None:
        """What the check of the dissected octets should be; None of a crafted packet."""
        return None if self._origin is None else self.compute(self._origin)

    def _complete(self, unit: bytes, rest: bytes) -> bytes:
        """The whole frame; `rest` ends with the check field's octets, which are computed where it has no value."""
        if not self.check_name or getattr(self, self.check_name) is not None:
            return unit + rest
        size = self.get_field(self.check_name).fld.sz
        body = unit + rest[:-size]
        return body + self.compute(body).to_bytes(size, "big")


class RTU(Adu):
    """Unit, PDU, CRC. Dissected alone it reads the PDU as a request; see RTUResponse."""

    name = "Modbus RTU"
    check_name = "crc"
    fields_desc: ClassVar = [ByteField("unit", 1), CheckField("crc", None, ">H")]

    def pre_dissect(self, s: bytes) -> bytes:
        self._origin = s[:-2]
        return s

    def compute(self, octets: bytes) -> int:
        crc = crc16_modbus(octets)
        return (crc & 0xFF) << 8 | crc >> 8

    def post_build(self, pkt: bytes, pay: bytes) -> bytes:
        return self._complete(pkt, pay)


class RTUResponse(RTU):
    """The same, its PDU read as a response."""

    response = True


class ASCII(Adu):
    """':' unit, PDU, LRC in hex pairs, CR LF. `start`, `end`: the characters around the pairs.

    `spelling`: the pairs as they were written, where that is not upper case; it stands while it spells these octets.
    """

    name = "Modbus ASCII"
    check_name = "lrc"
    fields_desc: ClassVar = [
        AsideField("start", b":"),
        ByteField("unit", 1),
        CheckField("lrc", None, "B"),
        AsideField("end", b"\r\n"),
        AsideField("spelling", b""),
    ]
    aside: ClassVar[dict[str, bytes]] = {}

    def pre_dissect(self, s: bytes) -> bytes:
        start, pairs, end = hex_pairs(s)
        octets = bytes.fromhex(_plain(pairs).decode("ascii"))
        spelling = pairs if pairs != _upper(octets) else b""
        object.__setattr__(self, "aside", {"start": start, "end": end, "spelling": spelling})
        self._origin = octets[:-1]
        return octets

    def compute(self, octets: bytes) -> int:
        return lrc(octets)

    def post_build(self, pkt: bytes, pay: bytes) -> bytes:
        octets = self._complete(pkt, pay)
        same = self.spelling and _plain(self.spelling).upper() == _upper(octets)
        return bytes(self.start) + (self.spelling if same else _upper(octets)) + bytes(self.end)


class ASCIIResponse(ASCII):
    """The same, its PDU read as a response."""

    response = True


class RTUWithoutCheck(Adu):
    """A damaged RTU frame whose CRC is missing or cannot be told from the rest."""

    name = "Modbus RTU"
    fields_desc: ClassVar = [ByteField("unit", 1)]


class ASCIIWithoutCheck(ASCII):
    """A damaged ASCII frame that ended before its LRC."""

    check_name = ""
    fields_desc: ClassVar = [
        AsideField("start", b":"),
        ByteField("unit", 1),
        AsideField("end", b""),
        AsideField("spelling", b""),
    ]

    def pre_dissect(self, s: bytes) -> bytes:
        octets = ASCII.pre_dissect(self, s)
        self._origin = None
        return octets


def dissect(frame: Frame, role: Role) -> Packet:
    """The packet of a frame in the direction that the tracker gave. Total; bytes(packet) are the frame's octets.

    A damaged frame says so in its name; octets that no field holds are `Raw`, those of a field cut off are `Cut`.
    """
    header = (peek_ascii if frame.protocol == ASCII_NAME else peek_rtu)(frame)
    if role in (Role.EITHER, Role.UNKNOWN):
        role = header.role
    packet = _packet(frame, role is Role.RESPONSE, role is Role.UNKNOWN and frame.ok)
    if not header.ok:
        object.__setattr__(packet, "name", f"{packet.name} [{header.error}]")
    return packet


def _packet(frame: Frame, response: bool, unknown: bool) -> Packet:
    whole = frame.damage in (None, Damage.CHECK) and frame.check is not Check.ABSENT
    if frame.protocol == ASCII_NAME:
        size = len(hex_pairs(frame.octets)[1]) // 2
        cls: type[Adu] = (ASCIIResponse if response else ASCII) if whole else ASCIIWithoutCheck
        least = 2 if whole else 1
    else:
        size = len(frame.octets)
        cls = (RTUResponse if response else RTU) if whole else RTUWithoutCheck
        least = 3 if whole else 1
    if size < least:
        return Raw(frame.octets)
    packet = cls()
    packet.response, packet.unknown = response, unknown
    packet.dissect(frame.octets)
    return packet


def _upper(octets: bytes) -> bytes:
    return hexlify(octets).upper()


def _plain(characters: bytes) -> bytes:
    """Characters without what a 7-bit line may carry in bit 7."""
    return bytes(c & 0x7F for c in characters)


__all__ = ["ASCII", "RTU", "ASCIIResponse", "Adu", "Cut", "Pdu", "RTUResponse", "dissect"]
