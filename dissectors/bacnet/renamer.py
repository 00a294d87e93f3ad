"""MS/TP frames under other names: MAC addresses, device instances and network addresses renumbered; texts and what is
in files blanked, texts in damaged frames too. A range of instances that is asked for becomes that of the one device in
it, or all.

The data of extended (COBS) frames is blanked whole: it would not keep its length.
"""

from __future__ import annotations

import re

from dissectors.bacnet import apdu as apdus
from dissectors.bacnet import npdu as npdus
from dissectors.bacnet.frame_types import PREAMBLE, data_length
from dissectors.bacnet.tags import header_at
from dissectors.checksums import crc8_mstp, crc16_x25
from dissectors.frame import Frame
from dissectors.pseudonyms import Blanks, Pseudonyms, inflicted, without_text

OCTET_STRING, CHARACTER_STRING, OBJECT_IDENTIFIER = 6, 7, 12
DEVICE = 8
UNCONFIRMED, WHO_HAS, WHO_IS = 1, 7, 8
LOW, HIGH = 0, 1
"""Context tags of the range of instances in Who-Is and Who-Has (clauses 16.9 and 16.10)."""
MOST_INSTANCE = 4_194_303
LONGEST_NUMBER = 4
"""Octets; what is longer behind a context tag is no number, and may be a text in any code."""

_ADDRESSES, _NET_AND_LENGTH = 2, 3  # octets of an NPDU before its addresses, and of each before its station

_WIDE = re.compile(rb"(?:\x00[ -~]){4,}\x00?|(?:[ -~]\x00){4,}")  # two octets a character


class MstpRenamer:
    """Renames MS/TP frames: MAC addresses, device instances, network addresses, texts."""

    def __init__(self) -> None:
        self.stations = Pseudonyms(range(128), range(128, 255), kept=(255,))  # masters; slaves, which get no token
        self.devices = Pseudonyms(range(1, 4_194_303), kept=(4_194_303,))
        self._blanks = Blanks()

    def __call__(self, frame: Frame) -> bytes:
        """The frame under another name, with the same damage."""
        if frame.repair is not None:
            whole = frame.repair.octets
            return inflicted(frame.octets, whole, self._renamed(whole, intact=True))
        return self._renamed(frame.octets, intact=frame.ok)

    def _renamed(self, octets: bytes, *, intact: bool) -> bytes:
        if len(octets) < 8:
            return octets[:3] + bytes(map(self.stations.of_doubtful, octets[3:5])) + octets[5:]
        good = crc8_mstp(octets[2:7]) == octets[7]
        address = self.stations.of if good else self.stations.of_doubtful
        header = bytes([octets[2], address(octets[3]), address(octets[4]), octets[5], octets[6]])
        check = octets[7] ^ crc8_mstp(octets[2:7]) ^ crc8_mstp(header)  # linear: the error in it stays what it was
        head = octets[:2] + header + bytes([check])
        length = data_length(octets)
        if not intact:
            return head + self._damaged(octets[8:], length)
        if not length:
            return head + octets[8:]
        if octets[2] >= 32:  # encoded: its length would not survive a change of its content; the frame reads damaged
            return head + self._blanks.of(octets[8:])
        data, end = octets[8 : 8 + length], octets[8 + length :]
        renamed = self._npdu(data) if octets[2] in (5, 6) else self._without_text(data)
        error = int.from_bytes(end[:2], "little") ^ crc16_x25(data)
        return head + renamed + (crc16_x25(renamed) ^ error).to_bytes(2, "little") + end[2:]

    def _damaged(self, rest: bytes, length: int) -> bytes:
        """What follows a header, without texts; a wrong check at its end stays wrong by as much."""
        parts = rest.split(PREAMBLE)  # a frame that begins in it goes on beginning there
        data = rest[:length] if len(parts) == 1 and len(rest) == length + 2 else None
        if data is None:
            return PREAMBLE.join(map(self._without_any_text, parts))
        renamed = self._without_any_text(data)
        error = int.from_bytes(rest[length:], "little") ^ crc16_x25(data)
        return renamed + (crc16_x25(renamed) ^ error).to_bytes(2, "little")

    def _npdu(self, data: bytes) -> bytes:
        header = npdus.decode(data)
        if header is None or header.error is not None:
            return self._without_text(data)
        front = bytearray(data[: header.body])
        at = _ADDRESSES
        for named in (header.dadr, header.sadr):
            if named is not None:
                at += _NET_AND_LENGTH
                if named:
                    front[at : at + len(named)] = bytes(len(named) - 1) + bytes([self.stations.of(named[-1])])
                at += len(named)
        body = data[header.body :]
        if header.is_network_message:
            return bytes(front) + body
        return bytes(front) + self._apdu(body)

    def _apdu(self, body: bytes) -> bytes:
        apdu = apdus.decode(body)
        if apdu is None or apdu.error is not None or apdu.segmented:
            begin = apdu.body if apdu is not None and apdu.error is None else 0
            return body[:begin] + self._without_any_text(body[begin:])
        asks_range = apdu.type == UNCONFIRMED and apdu.service in (WHO_HAS, WHO_IS)
        result = bytearray(body)
        ends: list[tuple[int, int]] = []
        at = apdu.body
        while at < len(body):
            tag = header_at(body, at)
            if isinstance(tag, str):
                result[at:] = self._without_any_text(body[at:])
                break
            if tag.kind == "primitive":
                context = bool(body[at] & 8)
                content = body[tag.begin : tag.end]
                if asks_range and context and tag.number in (LOW, HIGH):
                    ends.append((tag.begin, tag.end))
                else:
                    result[tag.begin : tag.end] = self._content(tag.number, context, content)
            at = max(tag.end, at + 1)
        self._rename_range(result, ends)
        return bytes(result)

    def _without_text(self, octets: bytes) -> bytes:
        """Runs of printable octets blanked."""
        return without_text(octets, self._blanks.of)

    def _without_any_text(self, octets: bytes) -> bytes:
        """The same, those of two octets a character too."""
        return _WIDE.sub(lambda found: self._wide(found[0]), self._without_text(octets))

    def _wide(self, text: bytes) -> bytes:
        """A text of two octets a character, blanked: the zeros stay where they are."""
        letters = iter(self._blanks.of(bytes(octet for octet in text if octet)))
        return bytes(next(letters) if octet else 0 for octet in text)

    def _rename_range(self, body: bytearray, ends: list[tuple[int, int]]) -> None:
        """Low and high limit of the instances that are asked for, where they stand."""
        values = [int.from_bytes(body[begin:end], "big") for begin, end in ends]
        is_one = len(values) == 2 and values[0] == values[1]
        for place, (begin, end) in enumerate(ends):
            most = min(MOST_INSTANCE, (1 << 8 * (end - begin)) - 1)
            value = self.devices.of(values[place]) if is_one else most * (place > 0)
            body[begin:end] = min(value, most).to_bytes(end - begin, "big")

    def _content(self, number: int, context: bool, content: bytes) -> bytes:
        if not context and number == OCTET_STRING:
            return self._blanks.of(content)
        if content and ((not context and number == CHARACTER_STRING) or (context and _may_be_text(content))):
            return content[:1] + self._blanks.of(content[1:])
        value = int.from_bytes(content, "big")
        is_object = (not context and number == OBJECT_IDENTIFIER) or context
        if is_object and len(content) == 4 and value >> 22 == DEVICE:
            return (DEVICE << 22 | self.devices.of(value & 0x3FFFFF)).to_bytes(4, "big")
        return content


def _may_be_text(content: bytes) -> bool:
    """Whether what stands behind a context tag may be a text: nothing there says what it is."""
    if len(content) > LONGEST_NUMBER:
        return True
    return content[0] == 0 and len(content) > 1 and all(32 <= octet < 127 for octet in content[1:])
