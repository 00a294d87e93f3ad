"""Modbus frames under other names: units renumbered, text blanked where the layout has any (server
identification, functions 17 and 43/14), in damaged frames too."""

from __future__ import annotations

from dissectors.checksums import crc16_modbus, lrc
from dissectors.frame import Damage, Frame
from dissectors.modbus.envelope import seal_rtu
from dissectors.modbus.text_places import text_places
from dissectors.pseudonyms import Blanks, Pseudonyms, hex_octet, inflicted, without_text


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
        if frame.damage is not Damage.CHECK or len(octets) < 4:
            return self.damaged_pdu(octets)
        renamed = self.damaged_pdu(octets[:-2])
        moved = crc16_modbus(octets[:-2]) ^ crc16_modbus(renamed)  # linear: the error in it stays what it was
        return renamed + (int.from_bytes(octets[-2:], "little") ^ moved).to_bytes(2, "little")

    def pdu(self, body: bytes) -> bytes:
        """Unit and PDU, renamed."""
        return bytes([self.stations.of(body[0])]) + self._without_text(body[1:])

    def damaged_pdu(self, body: bytes) -> bytes:
        """The same where the unit may be nobody's, and anything may be missing."""
        return bytes(map(self.stations.of_doubtful, body[:1])) + self._without_text(body[1:])

    def _without_text(self, pdu: bytes) -> bytes:
        renamed = bytearray(pdu)
        for begin, end in text_places(pdu):
            renamed[begin:end] = without_text(pdu[begin:end], self._blanks.of)
        return bytes(renamed)


class AsciiRenamer:
    """Renames ASCII frames."""

    def __init__(self) -> None:
        self.rtu = RtuRenamer()
        self.stations = self.rtu.stations

    def __call__(self, frame: Frame) -> bytes:
        """The frame under another name, with the same damage; what is after the hexadecimal digits stays."""
        if frame.repair is not None:
            whole = frame.repair.octets
            made = inflicted(frame.octets, whole, self._renamed(whole, intact=True))
        else:
            made = self._renamed(frame.octets, intact=frame.ok, check=frame.damage is Damage.CHECK)
        return _with_bit_7(made, frame.octets)

    def _renamed(self, octets: bytes, *, intact: bool, check: bool = False) -> bytes:
        text = bytes(octet & 0x7F for octet in octets)
        end = text.find(b"\r") if b"\r" in text else len(text)
        if not intact:
            return self._damaged(octets, text[1:end], check)
        body = self.rtu.pdu(bytes.fromhex(text[1:end].decode())[:-1])
        return octets[:1] + (body + bytes([lrc(body)])).hex().upper().encode() + octets[end:]

    def _damaged(self, octets: bytes, digits: bytes, check: bool) -> bytes:
        """`check`: only the sum is wrong; it stays wrong by as much. Digits that were spoilt stay as they are."""
        pairs = [hex_octet(digits[at : at + 2]) for at in range(0, len(digits) - 1, 2)]
        if not pairs or pairs[0] is None:
            return octets
        sent = pairs.pop() if check and len(pairs) >= 3 and not len(digits) % 2 else None
        body = bytes(octet or 0 for octet in pairs)
        renamed = self.rtu.damaged_pdu(body)
        new = [*renamed, *([] if sent is None else [sent + sum(body) - sum(renamed) & 0xFF])]
        old = [*pairs, *([] if sent is None else [sent])]
        result = bytearray(octets)
        for at, (was, becomes) in enumerate(zip(old, new, strict=True)):
            if was is not None and was != becomes:
                result[1 + 2 * at : 3 + 2 * at] = b"%02X" % becomes
        return bytes(result)


def _with_bit_7(made: bytes, sent: bytes) -> bytes:
    """Characters in place of others, as many; where bit 7 of those is a parity bit, so it is of these."""
    if not any(character & 0x80 for character in sent):
        return made
    bits = max(_BITS_7, key=lambda bits: sum(c & 0x80 == bits[c & 0x7F] for c in sent))
    return bytes(
        new & 0x7F | old & 0x80 ^ bits[old & 0x7F] ^ bits[new & 0x7F] for new, old in zip(made, sent, strict=True)
    )


_BITS_7 = tuple(
    bytes(0x80 * ((c.bit_count() + odd) & 1 or always) for c in range(0x80)) for odd, always in ((0, 0), (1, 0), (0, 1))
)
"""Bit 7 by character: even parity, odd parity, always set."""
