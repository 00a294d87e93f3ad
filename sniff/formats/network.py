"""Headers of network packets: addresses, ports and payload, as far as captures of gateways need them. Pure.

Ethernet and Linux cooked, with VLAN tags and PPPoE, PPP, raw IP and loopback; IPv4 and IPv6, fragments as they are
(`network_packets.py` puts them together); TCP, UDP; LLC with SNAP.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from ipaddress import ip_address

ETHERNET, NULL, PPP, RAW, COOKED, LOOP, IPV4, IPV6, COOKED2 = 1, 0, 9, 101, 113, 108, 228, 229, 276
BSD_RAW, OPENBSD_RAW = 12, 14
NETWORK = frozenset((ETHERNET, NULL, PPP, BSD_RAW, OPENBSD_RAW, RAW, COOKED, LOOP, IPV4, IPV6, COOKED2))
"""Link types of networks."""

_IP4, _IP6 = 0x0800, 0x86DD
_VLANS = (0x8100, 0x88A8, 0x9100)
_PPPOE = 0x8864
_BY_PPP = {0x21: _IP4, 0x57: _IP6}
_TCP, _UDP = 6, 17
_SYN, _ACK = 2, 16
_FRAGMENT, _AUTHENTICATED, _EXTENSIONS = 44, 51, (0, 43, 60)
"""Headers of IPv6 before what it carries: a fragment, and such as say how long they are."""
_SNAP = b"\xaa\xaa\x03"

Address = tuple[bytes, int]
"""IP address, as octets, and port."""


@dataclass(frozen=True, slots=True)
class Segment:
    """Payload of a TCP segment or UDP datagram. `sequence`: of its first octet, of TCP; None: UDP. `begins`: a SYN.
    `lost`: octets of the payload, at its end, that were not captured. `acknowledged`: the next octet that its sender
    expects of the other side; None where it does not say.
    """

    source: Address
    destination: Address
    payload: bytes
    sequence: int | None = None
    begins: bool = False
    lost: int = 0
    acknowledged: int | None = None


@dataclass(frozen=True, slots=True)
class Fragment:
    """A piece of an IP packet. `packet`: of which one; `kind`: what is in it, `at`: octets before this piece in it,
    `is_last`: whether it ends here.
    """

    source: bytes
    destination: bytes
    packet: int
    kind: int
    at: int
    is_last: bool
    octets: bytes

    def joined(self, octets: bytes) -> Segment | None:
        """What the whole packet carries, of which this is a piece. Total."""
        try:
            return _transport(self.kind, self.source, self.destination, octets, 0, len(octets))
        except (struct.error, IndexError):
            return None


@dataclass(frozen=True, slots=True)
class Snap:
    """Payload of an LLC frame with a SNAP header; `kind`: its organisation and protocol, 5 octets."""

    kind: bytes
    payload: bytes


def carried(link_type: int, data: bytes) -> Segment | Fragment | Snap | None:
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
    """What follows the link's header and tags (EtherType, or a length below 1536), and where."""
    if link_type == ETHERNET:
        return _untagged(data, 12)
    if link_type == COOKED:
        return _untagged(data, 14)
    if link_type == COOKED2:
        kind = data[0] << 8 | data[1]
        return _untagged(data, 22) if kind in _VLANS else (kind, 20)
    if link_type == PPP:
        return _of_ppp(data, 2 if data[:2] == b"\xff\x03" else 0)
    at = 4 if link_type in (NULL, LOOP) else 0
    return {4: _IP4, 6: _IP6}.get(data[at] >> 4), at


def _untagged(data: bytes, at: int) -> tuple[int | None, int]:
    """The type at `at`, or behind the tags that begin there."""
    kind = data[at] << 8 | data[at + 1]
    while kind in _VLANS:
        at += 4
        kind = data[at] << 8 | data[at + 1]
    return _of_ppp(data, at + 8) if kind == _PPPOE else (kind, at + 2)


def _of_ppp(data: bytes, at: int) -> tuple[int | None, int]:
    if data[at] & 1:  # its first octet may be left out where that is 0
        return _BY_PPP.get(data[at]), at + 1
    return _BY_PPP.get(data[at] << 8 | data[at + 1]), at + 2


def _ip4(data: bytes, at: int) -> Segment | Fragment | None:
    header = (data[at] & 15) * 4
    total, packet, fragment = struct.unpack_from(">HHH", data, at + 2)
    if header < 20:
        return None
    # 0: the network card cut a long one up after it was captured
    end = at + total if total >= header else len(data)
    kind, ends = data[at + 9], (data[at + 12 : at + 16], data[at + 16 : at + 20])
    if fragment & 0x3FFF:
        octets = data[at + header : end]
        return Fragment(*ends, packet, kind, (fragment & 0x1FFF) * 8, not fragment & 0x2000, octets)
    return _transport(kind, *ends, data, at + header, end)


def _ip6(data: bytes, at: int) -> Segment | Fragment | None:
    size, kind = struct.unpack_from(">HB", data, at + 4)
    ends = data[at + 8 : at + 24], data[at + 24 : at + 40]
    at += 40
    end = at + size
    while kind in _EXTENSIONS or kind == _AUTHENTICATED:
        longer = data[at + 1]
        kind, at = data[at], at + ((longer + 2) * 4 if kind == _AUTHENTICATED else (longer + 1) * 8)
    if kind == _FRAGMENT:
        kind, place, packet = struct.unpack_from(">BxHI", data, at)
        return Fragment(*ends, packet, kind, place & 0xFFF8, not place & 1, data[at + 8 : end])
    return _transport(kind, *ends, data, at, end)


def _transport(kind: int, source: bytes, destination: bytes, data: bytes, at: int, end: int) -> Segment | None:
    if len(source) != len(destination):
        return None
    lost = max(0, end - len(data))
    if kind == _TCP:
        first, second, sequence, acknowledged, size, flags = struct.unpack_from(">HHIIBB", data, at)
        begin = at + (size >> 4) * 4
        if begin < at + 20 or begin > end:
            return None
        payload = data[begin:end]
        lost = min(lost, end - begin)
        return Segment(
            (source, first),
            (destination, second),
            payload,
            sequence,
            bool(flags & _SYN),
            lost,
            acknowledged if flags & _ACK else None,
        )
    if kind == _UDP:
        first, second = struct.unpack_from(">HH", data, at)
        return Segment((source, first), (destination, second), data[at + 8 : end], lost=min(lost, max(0, end - at - 8)))
    return None
