"""MS/TP frames under other names: MAC addresses, device instances and network addresses renumbered, texts blanked.

The data of extended (COBS) frames is blanked whole: it would not keep its length.
"""

from __future__ import annotations

from dissectors.bacnet import apdu as apdus
from dissectors.bacnet import npdu as npdus
from dissectors.bacnet.frame_types import data_length
from dissectors.bacnet.tags import header_at
from dissectors.checksums import crc8_mstp, crc16_x25
from dissectors.frame import Frame
from dissectors.pseudonyms import BLANK, Pseudonyms, inflicted, without_text

CHARACTER_STRING, OBJECT_IDENTIFIER = 7, 12
DEVICE = 8


class MstpRenamer:
    """Renames MS/TP frames: MAC addresses, device instances, network addresses, texts."""

    def __init__(self) -> None:
        self.stations = Pseudonyms(range(255), kept=(255,))
        self.devices = Pseudonyms(range(1, 4_194_303), kept=(4_194_303,))

    def __call__(self, frame: Frame) -> bytes:
        """The frame under another name, with the same damage."""
        if frame.repair is not None:
            whole = frame.repair.octets
            return inflicted(frame.octets, whole, self._renamed(whole, intact=True))
        return self._renamed(frame.octets, intact=frame.ok)

    def _renamed(self, octets: bytes, *, intact: bool) -> bytes:
        if len(octets) < 8:
            return octets
        good = crc8_mstp(octets[2:7]) == octets[7]
        address = self.stations.of if good else self.stations.if_known
        header = bytes([octets[2], address(octets[3]), address(octets[4]), octets[5], octets[6]])
        check = octets[7] ^ crc8_mstp(octets[2:7]) ^ crc8_mstp(header)  # linear: the error in it stays what it was
        head = octets[:2] + header + bytes([check])
        length = data_length(octets)
        if not intact or not length:
            return head + octets[8:]
        if octets[2] >= 32:  # encoded: its length would not survive a change of its content; the frame reads damaged
            return head + bytes([BLANK]) * (len(octets) - 8)
        data, end = octets[8 : 8 + length], octets[8 + length :]
        renamed = self._npdu(data) if octets[2] in (5, 6) else without_text(data)
        error = int.from_bytes(end[:2], "little") ^ crc16_x25(data)
        return head + renamed + (crc16_x25(renamed) ^ error).to_bytes(2, "little") + end[2:]

    def _npdu(self, data: bytes) -> bytes:
        header = npdus.decode(data)
        if header is None or header.error is not None:
            return without_text(data)
        front = bytearray(data[: header.body])
        for named in (header.dadr, header.sadr):
            if named:
                place = bytes(front).find(named)
                front[place : place + len(named)] = bytes(len(named) - 1) + bytes([self.stations.of(named[-1])])
        body = data[header.body :]
        if header.is_network_message:
            return bytes(front) + body
        return bytes(front) + self._apdu(body)

    def _apdu(self, body: bytes) -> bytes:
        apdu = apdus.decode(body)
        if apdu is None or apdu.error is not None or apdu.segmented:
            begin = apdu.body if apdu is not None and apdu.error is None else 0
            return body[:begin] + without_text(body[begin:])
        result = bytearray(body)
        at = apdu.body
        while at < len(body):
            tag = header_at(body, at)
            if isinstance(tag, str):
                result[at:] = without_text(body[at:])
                break
            if tag.kind == "primitive":
                context = bool(body[at] & 8)
                result[tag.begin : tag.end] = self._content(tag.number, context, body[tag.begin : tag.end])
            at = max(tag.end, at + 1)
        return bytes(result)

    def _content(self, number: int, context: bool, content: bytes) -> bytes:
        if not context and number == CHARACTER_STRING and content:
            return content[:1] + bytes([BLANK]) * (len(content) - 1)
        value = int.from_bytes(content, "big")
        is_object = (not context and number == OBJECT_IDENTIFIER) or context
        if is_object and len(content) == 4 and value >> 22 == DEVICE:
            return (DEVICE << 22 | self.devices.of(value & 0x3FFFFF)).to_bytes(4, "big")
        return without_text(content) if context else content
