"""Addresses of stations on other networks, as the network header carries them, in the form their network writes them.

    1 octet    MS/TP, ARCNET              13:16          decimal, as addresses on this bus
    6 octets   BACnet/IP (Annex J)        7:192.168.1.20:47808
               Ethernet                   7:00-1A-2B-3C-4D-5E
    others     LonTalk, ZigBee, IPv6 …    7:0x01E240

Six octets do not say which of the two they are: they are taken for an IP address and port where the port is one that
BACnet uses (47808 … 47823) or the address is one of those set aside for private networks.
"""

from __future__ import annotations

from ipaddress import IPv4Address, IPv4Network

from dissectors.bacnet.npdu import GLOBAL_BROADCAST

BACNET_PORTS = range(0xBAC0, 0xBAD0)
PRIVATE = tuple(map(IPv4Network, ("10.0.0.0/8", "172.16.0.0/12", "192.168.0.0/16", "169.254.0.0/16")))
"""RFC 1918 and 3927."""


def mac_text(address: bytes) -> str:
    """An address on another network: "16", "192.168.1.20:47808", "00-1A-2B-3C-4D-5E", "0x01E240"; total."""
    if len(address) == 1:
        return str(address[0])
    if len(address) == 6:
        host, port = IPv4Address(address[:4]), int.from_bytes(address[4:], "big")
        private = port >= 1024 and any(host in network for network in PRIVATE)
        return f"{host}:{port}" if port in BACNET_PORTS or private else address.hex("-").upper()
    return f"0x{address.hex().upper()}" if address else ""


def remote(net: int, address: bytes | None) -> str:
    """A station, or without an address everybody, on another network: "network 13:16", "network 13", "all networks"."""
    if net == GLOBAL_BROADCAST:
        return "all networks"
    return f"network {net}" + (f":{mac_text(address)}" if address else "")
