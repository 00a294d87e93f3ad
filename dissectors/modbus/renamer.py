"""Modbus frames under other names: units renumbered, server identification (functions 17 and 43/14) blanked."""

from __future__ import annotations

from dissectors.checksums import lrc
from dissectors.frame import Frame
from dissectors.modbus.adu import seal_rtu
from dissectors.pseudonyms import Pseudonyms, hex_octet, without_text


class RtuRenamer:
    """Renames RTU frames."""

    def __init__(self) -> None:
        self.stations = Pseudonyms([*range(1, 248), *range(248, 256)], kept=(0,))

    def __call__(self, frame: Frame) -> bytes:
        """The frame under another name."""
        octets = frame.octets
        if not frame.ok:
            return bytes([self.stations.of(octets[0])]) + octets[1:] if octets else octets
        body = self.pdu(octets[:-2])
        return seal_rtu(body)

    def pdu(self, body: bytes) -> bytes:
        """Unit and PDU, renamed."""
        unit, pdu = body[:1], body[1:]
        if pdu[:1] in (b"\x11", b"\x2b"):
            pdu = pdu[:1] + without_text(pdu[1:])
        return bytes([self.stations.of(unit[0])]) + pdu


class AsciiRenamer:
    """Renames ASCII frames."""

    def __init__(self) -> None:
        self.rtu = RtuRenamer()
        self.stations = self.rtu.stations

    def __call__(self, frame: Frame) -> bytes:
        """The frame under another name; what is after the hexadecimal digits stays."""
        octets = frame.octets
        text = bytes(octet & 0x7F for octet in octets)
        end = text.find(b"\r") if b"\r" in text else len(text)
        if not frame.ok:
            address = hex_octet(text[1:3])
            renamed = b"" if address is None else b"%02X" % self.stations.of(address)
            return octets[:1] + renamed + octets[1 + len(renamed) :]
        body = self.rtu.pdu(bytes.fromhex(text[1:end].decode())[:-1])
        return octets[:1] + (body + bytes([lrc(body)])).hex().upper().encode() + octets[end:]
