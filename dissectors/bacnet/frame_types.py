"""MS/TP frame types (ANSI/ASHRAE 135, 9.3.1) and where things are in a frame.

    55 FF | type | destination | source | length (2, high first) | header CRC | data | data CRC (2, low first) | [FF]

A length of 0 means neither data nor data CRC. Types 32 … 127 carry COBS-encoded data: `cobs.py`.
"""

from __future__ import annotations

from enum import IntEnum

from dissectors.tracker import Passing

PREAMBLE = b"\x55\xff"
HEADER = 8  # octets, preamble and header CRC included


class FrameType(IntEnum):
    """The types that the standard defines; other numbers are reserved (8 … 31, 35 … 127) or proprietary (128 …)."""

    TOKEN = 0
    POLL_FOR_MASTER = 1
    REPLY_TO_POLL_FOR_MASTER = 2
    TEST_REQUEST = 3
    TEST_RESPONSE = 4
    DATA_EXPECTING_REPLY = 5
    DATA_NOT_EXPECTING_REPLY = 6
    REPLY_POSTPONED = 7
    EXTENDED_DATA_EXPECTING_REPLY = 32
    EXTENDED_DATA_NOT_EXPECTING_REPLY = 33
    IPV6 = 34


PROPRIETARY = 128
"""First proprietary type: their data begin with a vendor id, high octet first."""

NAMES: dict[int, str] = {
    **{member.value: member.name.lower().replace("_", "-") for member in FrameType},
    FrameType.TOKEN: Passing.TOKEN.value,
    FrameType.POLL_FOR_MASTER: Passing.POLL.value,
    FrameType.IPV6: "ipv6",
}

TITLES: dict[int, str] = {
    FrameType.TOKEN: "Token",
    FrameType.POLL_FOR_MASTER: "Poll For Master",
    FrameType.REPLY_TO_POLL_FOR_MASTER: "Reply To Poll For Master",
    FrameType.TEST_REQUEST: "Test Request",
    FrameType.TEST_RESPONSE: "Test Response",
    FrameType.DATA_EXPECTING_REPLY: "BACnet Data Expecting Reply",
    FrameType.DATA_NOT_EXPECTING_REPLY: "BACnet Data Not Expecting Reply",
    FrameType.REPLY_POSTPONED: "Reply Postponed",
    FrameType.EXTENDED_DATA_EXPECTING_REPLY: "BACnet Extended Data Expecting Reply",
    FrameType.EXTENDED_DATA_NOT_EXPECTING_REPLY: "BACnet Extended Data Not Expecting Reply",
    FrameType.IPV6: "IPv6 over MS/TP",
}

EXPECTING = frozenset({5, 32})
"""Data that expects a reply."""

CARRIES_NPDU = frozenset({5, 6, 32, 33})


def name(frame_type: int) -> str:
    """Stable lower-case name with hyphens: "token", "reserved-9", "proprietary-128"."""
    known = NAMES.get(frame_type)
    if known is not None:
        return known
    return f"{'proprietary' if frame_type >= PROPRIETARY else 'reserved'}-{frame_type}"


def title(frame_type: int) -> str:
    """Name for people."""
    known = TITLES.get(frame_type)
    if known is not None:
        return known
    return f"{'Proprietary' if frame_type >= PROPRIETARY else 'Reserved'} type {frame_type}"


def is_encoded(frame_type: int) -> bool:
    """Whether the data are COBS-encoded, with a CRC-32K."""
    return 32 <= frame_type <= 127


def total(length: int) -> int:
    """Octets of a whole frame with that length field, trailing pad not counted."""
    return HEADER + length + 2 if length else HEADER


def data_length(octets: bytes) -> int:
    """The length field of the header that begins `octets`: octets of data, its CRC not counted. Seven octets at least.

    ASHRAE 135, 9.3: high octet first, behind preamble, type and both addresses.
    """
    return octets[5] << 8 | octets[6]
