"""Packets in the blocks of a pcapng file, and what is written in the options beside them. Total.

Source: the pcapng specification (draft-ietf-opsawg-pcapng): enhanced and simple packet blocks, and the packet block
that came before them. `epb_dropcount`, or that block's own field, says how many packets the capturing host dropped
since the one before.
"""

from __future__ import annotations

import struct

from dissectors.line import LineSettings
from sniff.formats.pcapng_interface import Interface, options
from sniff.formats.records import PacketRecord, cut_off

OBSOLETE, SIMPLE, ENHANCED = 2, 3, 6
OPT_COMMENT, OPT_FLAGS, OPT_DROPCOUNT = 1, 2, 4
CRC_ERROR_FLAG = 1 << 24
LATEST = (1 << 33) * 1_000_000_000
"""ns since the epoch, in the year 2242; a record that says more, or as much before it, is given this time."""
MARK = "mark: "
"""Begins a comment of a packet that a person wrote; what follows is theirs."""
SEARCH_MARK = "sniff485 search: "
"""Begins a comment of a packet that was heard in a search for settings; the line settings tried follow."""
NOT_TOLD = 0xFFFF
"""Packets dropped, where nobody counted them."""


def packet_of(order: str, kind: int, body: bytes, interfaces: list[Interface]) -> PacketRecord | None:
    """The record in a body of one of these kinds; None where it is none, or of an interface that nobody told of."""
    if kind == SIMPLE:
        if len(body) < 4 or not interfaces:
            return None
        on_wire = struct.unpack_from(order + "I", body)[0]
        data = body[4 : 4 + min(on_wire, interfaces[0].longest)]
        return PacketRecord(0, interfaces[0].link_type, data, cut=cut_off(len(data), on_wire))
    if len(body) < 20:
        return None
    number, high, low, kept, on_wire = struct.unpack_from(order + "IIIII", body)
    dropped = 0
    if kind == OBSOLETE:  # number of the interface, and how many packets were dropped before
        number, dropped = struct.unpack_from(order + "HH", body)
        dropped = 0 if dropped == NOT_TOLD else dropped
    if number >= len(interfaces) or kept > len(body) - 20:
        return None
    interface = interfaces[number]
    factor, ticks = interface.resolution
    time = ((high << 32) | low) * factor // ticks + interface.offset * 1_000_000_000
    time = max(-LATEST, min(time, LATEST))
    comment, crc_error, searched, mark = "", False, None, None
    for code, value in options(order, body[20 + kept + (-kept % 4) :]):
        if code == OPT_COMMENT:
            text = value.decode("utf-8", "replace")
            if text.startswith(SEARCH_MARK):
                searched = _line(text[len(SEARCH_MARK) :])
            elif text.startswith(MARK):
                mark = text[len(MARK) :]
            elif comment:  # we write one at most: another program has added this
                mark = text
            else:
                comment = text
        elif code == OPT_FLAGS and len(value) == 4:
            crc_error = bool(struct.unpack(order + "I", value)[0] & CRC_ERROR_FLAG)
        elif code == OPT_DROPCOUNT and len(value) == 8:
            dropped = struct.unpack(order + "Q", value)[0]
    data, cut = body[20 : 20 + kept], cut_off(kept, on_wire)
    return PacketRecord(time, interface.link_type, data, comment, crc_error, searched, mark, cut, dropped)


def _line(text: str) -> LineSettings | None:
    try:
        return LineSettings.parse(text)
    except ValueError:
        return None
