"""Packets that a log shows as hexdumps: what they carry of a bus. Pure, total.

Tools for networks show whole packets (`tshark -x`), whatever stands around a frame: the heading of an exported PDU, or
Ethernet, IP, TCP or UDP. That octets are a packet is told by lengths and numbers of its headings that fit one another,
as no frame of a field bus has them.
"""

from __future__ import annotations

from sniff.formats.linktypes import EXPORTED, LINK_TYPES

_ETHERNET, _COOKED = 14, 16
_IPV4, _IPV6 = b"\x08\x00", b"\x86\xdd"
_TCP, _UDP = 6, 17
_LEAST = 20
_SHORTEST = 60
"""Octets up to which Ethernet fills a packet up."""


def carried(octets: bytes) -> bytes:
    """What a packet carries, empty where it carries nothing; octets that are no packet as they are."""
    exported = LINK_TYPES[EXPORTED].read(octets) if octets[:1] == b"\0" else None
    if exported is not None:
        return exported.octets
    if _is_of_ip(octets):
        return _of_transport(octets[9], octets[4 * (octets[0] & 0x0F) :], octets)
    for heading in (_ETHERNET, _COOKED):
        kind, packet = octets[heading - 2 : heading], octets[heading:]
        if len(packet) < _LEAST:
            continue
        if kind == _IPV4 and packet[0] >> 4 == 4:
            length = int.from_bytes(packet[2:4], "big")
            if _fits(length, packet, heading):
                return _of_transport(packet[9], packet[4 * (packet[0] & 0x0F) : length], octets)
        if kind == _IPV6 and packet[0] >> 4 == 6:
            length = 40 + int.from_bytes(packet[4:6], "big")
            if _fits(length, packet, heading):
                return _of_transport(packet[6], packet[40:length], octets)
    return octets


def _is_of_ip(octets: bytes) -> bool:
    """Whether octets are a packet of IP without any heading before, as `tcpdump -X` shows it."""
    is_whole = (
        len(octets) > _LEAST and octets[0] in range(0x45, 0x50) and int.from_bytes(octets[2:4], "big") == len(octets)
    )
    return is_whole and octets[9] in (_TCP, _UDP)


def _fits(length: int, packet: bytes, heading: int) -> bool:
    """Whether a packet is as long as it says, or filled up."""
    return length == len(packet) or (_LEAST <= length < len(packet) == _SHORTEST - heading)


def _of_transport(protocol: int, segment: bytes, octets: bytes) -> bytes:
    if protocol == _TCP and len(segment) >= 20 and segment[12] >> 4 >= 5:
        return segment[4 * (segment[12] >> 4) :]
    if protocol == _UDP and len(segment) >= 8:
        return segment[8:]
    return octets
