"""Headers of network packets: addresses, ports and payload, as far as captures of gateways need them. Pure.

Ethernet with VLAN tags, Linux cooked, raw IP and loopback; IPv4 (no fragments), IPv6 without extension headers; TCP,
UDP; LLC with SNAP.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from ipaddress import ip_address

ETHERNET, NULL, RAW, COOKED, LOOP, IPV4, IPV6, COOKED2 = 1, 0, 101, 113, 108, 228, 229, 276
NETWORK = frozenset((ETHERNET, NULL, RAW, COOKED, LOOP, IPV4, IPV6, COOKED2))
"""Link types of networks."""

_IP4, _IP6 = 0x0800, 0x86DD
_VLANS = (0x8100, 0x88A8, 0x9100)
_TCP, _UDP = 6, 17
_SYN = 2
_SNAP = b"\xaa\xaa\x03"

Address = tuple[bytes, int]
"""IP address, as octets, and port."""


@dataclass(frozen=True, slots=True)
class Segment:
    """Payload of a TCP segment or UDP datagram. `sequence`: of its first octet, of TCP; None: UDP. `begins`: a SYN.
    `lost`: octets of the payload, at its end, that were not captured.
    """

    source: Address
    destination: Address
    payload: bytes
    sequence: int | None = None
    begins: bool = False
    lost: int = 0


@dataclass(frozen=True, slots=True)
class Snap:
    """Payload of an LLC frame with a SNAP header; `kind`: its organisation and protocol, 5 octets."""

    kind: bytes
    payload: bytes


def carried(link_type: int, data: bytes) -> Segment | Snap | None:
    """What a record carries; None where that is nothing of these. Total."""
    try:
        kind, at = _network(link_type, data)
        if kind == _IP4:
            return _ip4(data, at)
        if kind == _IP6:
            return _ip6(data, at)
        if kind is not None and kind < 1536 and data[at : at + 3] == _SNAP:
            return Snap(data[at + 3 : at + 8], data[at + 8 :])
    except (struct.error, IndexError):  # cut short
        return None
    return None


def shown(address: Address) -> str:
    """ "192.0.2.9:502"."""
    host = str(ip_address(address[0]))
    return f"[{host}]:{address[1]}" if ":" in host else f"{host}:{address[1]}"


def _network(link_type: int, data: bytes) -> tuple[int | None, int]:
    """What follows the link's header (EtherType, or a length below 1536), and where."""
    if link_type == ETHERNET:
        at = 12
        kind = data[at] << 8 | data[at + 1]
        while kind in _VLANS:
            at += 4
            kind = data[at] << 8 | data[at + 1]
        return kind, at + 2
    if link_type == COOKED:
        return data[14] << 8 | data[15], 16
    if link_type == COOKED2:
        return data[0] << 8 | data[1], 20
    at = 4 if link_type in (NULL, LOOP) else 0
    return {4: _IP4, 6: _IP6}.get(data[at] >> 4), at


def _ip4(data: bytes, at: int) -> Segment | None:
    header = (data[at] & 15) * 4
    total, fragment = struct.unpack_from(">H2xH", data, at + 2)
    if header < 20 or fragment & 0x3FFF:
        return None
    # 0: the network card cut a long one up after it was captured
    end = at + total if total >= header else len(data)
    return _transport(data[at + 9], data[at + 12 : at + 16], data[at + 16 : at + 20], data, at + header, end)


def _ip6(data: bytes, at: int) -> Segment | None:
    size, kind = struct.unpack_from(">HB", data, at + 4)
    return _transport(kind, data[at + 8 : at + 24], data[at + 24 : at + 40], data, at + 40, at + 40 + size)


def _transport(kind: int, source: bytes, destination: bytes, data: bytes, at: int, end: int) -> Segment | None:
    if len(source) != len(destination):
        return None
    lost = max(0, end - len(data))
    if kind == _TCP:
        ports = struct.unpack_from(">HHI4xBB", data, at)
        begin = at + (ports[3] >> 4) * 4
        if begin < at + 20 or begin > end:
            return None
        payload = data[begin:end]
        lost = min(lost, end - begin)
        return Segment((source, ports[0]), (destination, ports[1]), payload, ports[2], bool(ports[4] & _SYN), lost)
    if kind == _UDP:
        first, second = struct.unpack_from(">HH", data, at)
        return Segment((source, first), (destination, second), data[at + 8 : end], lost=lost)
    return None
