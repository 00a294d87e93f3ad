"""Modbus frames under other names: units renumbered, text blanked where the layout has any (server
identification, functions 17 and 43/14)."""

from __future__ import annotations

from dissectors.checksums import crc16_modbus, lrc
from dissectors.frame import Damage, Frame
from dissectors.modbus.envelope import seal_rtu
from dissectors.modbus.layout import MESSAGES
from dissectors.modbus.notation import has_text
from dissectors.pseudonyms import Blanks, Pseudonyms, hex_octet, inflicted, without_text

_WITH_TEXT = frozenset(code for code, messages in MESSAGES.items() if has_text(messages.response))


class RtuRenamer:
    """Renames RTU frames."""

    def __init__(self) -> None:
        self.stations = Pseudonyms(range(1, 248), range(248, 256), kept=(0,))  # the last ones are reserved
        self._blanks = Blanks()

    def __call__(self, frame: Frame) -> bytes:
        """The frame under another name, with the same damage."""
        octets = frame.octets
        if frame.repair is not None:
            whole = frame.repair.octets
            return inflicted(octets, whole, seal_rtu(self.pdu(whole[:-2])))
        if frame.ok:
            return seal_rtu(self.pdu(octets[:-2]))
        renamed = bytes([self.stations.if_known(octets[0])]) + octets[1:] if octets else octets
        if frame.damage is not Damage.CHECK or len(octets) < 4:
            return renamed
        moved = crc16_modbus(octets[:-2]) ^ crc16_modbus(renamed[:-2])  # linear: the error in it stays what it was
        return renamed[:-2] + (int.from_bytes(octets[-2:], "little") ^ moved).to_bytes(2, "little")

    def pdu(self, body: bytes) -> bytes:
        """Unit and PDU, renamed."""
        unit, pdu = body[:1], body[1:]
        if pdu and pdu[0] in _WITH_TEXT:
            pdu = pdu[:1] + without_text(pdu[1:], self._blanks.of)
        return bytes([self.stations.of(unit[0])]) + pdu


class AsciiRenamer:
    """Renames ASCII frames."""

    def __init__(self) -> None:
        self.rtu = RtuRenamer()
        self.stations = self.rtu.stations

    def __call__(self, frame: Frame) -> bytes:
        """The frame under another name, with the same damage; what is after the hexadecimal digits stays."""
        if frame.repair is not None:
            whole = frame.repair.octets
            return inflicted(frame.octets, whole, self._renamed(whole, intact=True))
        return self._renamed(frame.octets, intact=frame.ok, check=frame.damage is Damage.CHECK)

    def _renamed(self, octets: bytes, *, intact: bool, check: bool = False) -> bytes:
        text = bytes(octet & 0x7F for octet in octets)
        end = text.find(b"\r") if b"\r" in text else len(text)
        if not intact:
            address = hex_octet(text[1:3])
            new = address if address is None else self.stations.if_known(address)
            if address is None or new is None or new == address:
                return octets
            sent = hex_octet(text[end - 2 : end])
            if not check or sent is None or end < 7:
                return octets[:1] + b"%02X" % new + octets[3:]
            return (
                octets[:1]
                + b"%02X" % new
                + octets[3 : end - 2]
                + b"%02X" % (sent + address - new & 0xFF)
                + octets[end:]
            )
        body = self.rtu.pdu(bytes.fromhex(text[1:end].decode())[:-1])
        return octets[:1] + (body + bytes([lrc(body)])).hex().upper().encode() + octets[end:]
