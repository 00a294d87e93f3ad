"""The network layer: NPDU header and network messages (ANSI/ASHRAE 135, 6.2).

    version 01 | control | [DNET 2, DLEN 1, DADR] | [SNET 2, SLEN 1, SADR] | [hop count 1]
    then a network message (type 1, vendor id 2 from type 80 on, payload) or an APDU

control: 80 network message · 20 destination present · 08 source present · 04 reply expected · 03 priority
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from dissectors.quick_values import quickly_made

VERSION = 1
NETWORK_MESSAGE = 0x80
HAS_DESTINATION = 0x20
HAS_SOURCE = 0x08
EXPECTS_REPLY = 0x04
GLOBAL_BROADCAST = 0xFFFF

PRIORITIES = ("normal", "urgent", "critical-equipment", "life-safety")

MESSAGES: dict[int, str] = {
    0x00: "who-is-router-to-network",
    0x01: "i-am-router-to-network",
    0x02: "i-could-be-router-to-network",
    0x03: "reject-message-to-network",
    0x04: "router-busy-to-network",
    0x05: "router-available-to-network",
    0x06: "initialize-routing-table",
    0x07: "initialize-routing-table-ack",
    0x08: "establish-connection-to-network",
    0x09: "disconnect-connection-to-network",
    0x0A: "challenge-request",
    0x0B: "security-payload",
    0x0C: "security-response",
    0x0D: "request-key-update",
    0x0E: "update-key-set",
    0x0F: "update-distribution-key",
    0x10: "request-master-key",
    0x11: "set-master-key",
    0x12: "what-is-network-number",
    0x13: "network-number-is",
}

REJECTIONS: dict[int, str] = {
    0: "other",
    1: "not directly connected to the network",
    2: "router busy",
    3: "unknown message type",
    4: "message too long",
    5: "security",
    6: "addressing",
}


@quickly_made
@dataclass(frozen=True, slots=True)
class Npdu:
    """A network header. `dnet`, `dadr`, `snet`, `sadr`, `hops`, `message`, `vendor` are None where absent.

    `body`: where the APDU or the payload of the network message begins. `error`: why it could not be read to its end.
    """

    version: int
    control: int
    dnet: int | None = None
    dadr: bytes | None = None
    snet: int | None = None
    sadr: bytes | None = None
    hops: int | None = None
    message: int | None = None
    vendor: int | None = None
    body: int = 2
    error: str | None = None

    @property
    def is_network_message(self) -> bool:
        """Whether a network message follows instead of an APDU."""
        return bool(self.control & NETWORK_MESSAGE)

    @property
    def priority(self) -> int:
        """0 normal … 3 life safety."""
        return self.control & 3


def decode(octets: bytes) -> Npdu | None:
    """The header at the front of an NPDU; None when there are not even two octets. Total."""
    if len(octets) < 2:
        return None
    version, control = octets[0], octets[1]
    if version != VERSION:
        return Npdu(version, control, error=f"version {version}")
    if not control & (NETWORK_MESSAGE | HAS_DESTINATION | HAS_SOURCE):
        return Npdu(version, control)
    dnet = snet = hops = message = vendor = None
    dadr = sadr = None
    at = 2
    try:
        if control & HAS_DESTINATION:
            dnet, dadr, at = _address(octets, at)
        if control & HAS_SOURCE:
            snet, sadr, at = _address(octets, at)
        if control & HAS_DESTINATION:
            hops = octets[at]
            at += 1
        if control & NETWORK_MESSAGE:
            message = octets[at]
            at += 1
            if message >= 0x80:
                (vendor,) = struct.unpack_from(">H", octets, at)
                at += 2
    except (IndexError, struct.error):
        return Npdu(version, control, dnet, dadr, snet, sadr, hops, message, vendor, len(octets), "cut in its header")
    return Npdu(version, control, dnet, dadr, snet, sadr, hops, message, vendor, at)


def _address(octets: bytes, at: int) -> tuple[int, bytes, int]:
    net, length = struct.unpack_from(">HB", octets, at)
    end = at + 3 + length
    if end > len(octets):
        raise IndexError
    return net, octets[at + 3 : end], end


def encode(
    body: bytes,
    *,
    dnet: int | None = None,
    dadr: bytes = b"",
    snet: int | None = None,
    sadr: bytes = b"",
    hops: int = 255,
    expects_reply: bool = False,
    priority: int = 0,
    message: int | None = None,
) -> bytes:
    """An NPDU around an APDU, or around the payload of a network message."""
    control = priority & 3 | (EXPECTS_REPLY if expects_reply else 0)
    header = b""
    if dnet is not None:
        control |= HAS_DESTINATION
        header += struct.pack(">HB", dnet, len(dadr)) + dadr
    if snet is not None:
        control |= HAS_SOURCE
        header += struct.pack(">HB", snet, len(sadr)) + sadr
    if dnet is not None:
        header += bytes((hops,))
    if message is not None:
        control |= NETWORK_MESSAGE
        header += bytes((message,))
    return bytes((VERSION, control)) + header + body


def message_name(message: int) -> str:
    """Stable lower-case name of a network message type."""
    known = MESSAGES.get(message)
    if known is not None:
        return known
    return f"{'vendor' if message >= 0x80 else 'reserved'}-network-message-{message}"


def networks(npdu: Npdu, octets: bytes) -> tuple[int, ...]:
    """The network numbers that a network message names."""
    payload = octets[npdu.body :]
    message = npdu.message
    if message in (0x00, 0x01, 0x04, 0x05):
        return tuple(number for (number,) in struct.iter_unpack(">H", payload[: len(payload) // 2 * 2]))
    if message in (0x02, 0x08, 0x09, 0x13) and len(payload) >= 2:
        return (payload[0] << 8 | payload[1],)
    if message == 0x03 and len(payload) >= 3:
        return (payload[1] << 8 | payload[2],)
    if message in (0x06, 0x07):
        return tuple(net for net, _, _ in routes(payload))
    return ()


def routes(payload: bytes) -> tuple[tuple[int, int, bytes], ...]:
    """(network, port id, port info) of each entry of a routing table message; stops where it is cut."""
    found: list[tuple[int, int, bytes]] = []
    at = 1
    for _ in range(payload[0] if payload else 0):
        if at + 4 > len(payload) or at + 4 + payload[at + 3] > len(payload):
            break
        net, port, length = struct.unpack_from(">HBB", payload, at)
        found.append((net, port, payload[at + 4 : at + 4 + length]))
        at += 4 + length
    return tuple(found)
