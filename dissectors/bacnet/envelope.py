"""The envelope of MS/TP: octets from type, addresses and data. Nothing is checked; bad frames are made the same way."""

from __future__ import annotations

import struct

from dissectors.bacnet import cobs
from dissectors.bacnet.frame_types import PREAMBLE, FrameType, is_encoded
from dissectors.bacnet.limits import MAX_DATA
from dissectors.checksums import crc8_mstp, crc16_x25


def frame(frame_type: int, destination: int, source: int, data: bytes = b"") -> bytes:
    """The octets of a good frame; types 32 … 127 are encoded."""
    if not data:
        body, length = b"", 0
    elif is_encoded(frame_type):
        body = cobs.encode_body(data)
        length = len(body) - 2
    else:
        body, length = data + struct.pack("<H", crc16_x25(data)), len(data)
    header = struct.pack(">BBBH", frame_type, destination, source, length)
    return PREAMBLE + header + bytes((crc8_mstp(header),)) + body


def npdu_frame(destination: int, source: int, npdu: bytes, expects_reply: bool) -> bytes:
    """A frame around an NPDU, extended when it is too long for a plain one."""
    if len(npdu) > MAX_DATA:
        kind = FrameType.EXTENDED_DATA_EXPECTING_REPLY if expects_reply else FrameType.EXTENDED_DATA_NOT_EXPECTING_REPLY
    else:
        kind = FrameType.DATA_EXPECTING_REPLY if expects_reply else FrameType.DATA_NOT_EXPECTING_REPLY
    return frame(kind, destination, source, npdu)
