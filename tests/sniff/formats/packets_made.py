"""Makes captures of a network: TCP and UDP over Ethernet and IPv4, as pcap and pcapng."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path

from dissectors.line import NS_PER_S

Packet = tuple[int, bytes]
"""ns and octets."""
CLIENT, SERVER = (b"\xc0\x00\x02\x01", 40000), (b"\xc0\x00\x02\x09", 8899)
SYN, PUSH = 2, 8  # without acknowledgement


def tcp(
    source: tuple[bytes, int],
    destination: tuple[bytes, int],
    sequence: int,
    payload: bytes,
    flags: int = PUSH,
    tagged: bool = False,
    acknowledged: int = 1,
) -> bytes:
    """An Ethernet frame with a TCP segment, padded as the wire wants it."""
    ports = struct.pack(">HH", source[1], destination[1])
    body = ports + struct.pack(">IIBBHHH", sequence & 0xFFFFFFFF, acknowledged, 0x50, flags, 8192, 0, 0) + payload
    return _frame(6, source[0], destination[0], body, tagged)


def udp(source: tuple[bytes, int], destination: tuple[bytes, int], payload: bytes) -> bytes:
    """An Ethernet frame with a UDP datagram."""
    ports = struct.pack(">HH", source[1], destination[1])
    body = ports + struct.pack(">HH", 8 + len(payload), 0) + payload
    return _frame(17, source[0], destination[0], body, False)


def _frame(kind: int, source: bytes, destination: bytes, body: bytes, tagged: bool) -> bytes:
    header = struct.pack(">BBHHHBBH", 0x45, 0, 20 + len(body), 1, 0x4000, 64, kind, 0) + source + destination
    tag = b"\x81\x00\x00\x05" if tagged else b""
    return (b"\2" * 12 + tag + b"\x08\x00" + header + body).ljust(60, b"\0")


def as_pcap(path: Path, packets: Sequence[Packet], link_type: int = 1) -> Path:
    """Classic pcap with nanoseconds."""
    octets = struct.pack("<IHHiIII", 0xA1B23C4D, 2, 4, 0, 0, 262_144, link_type)
    for time, data in packets:
        octets += struct.pack("<IIII", time // NS_PER_S, time % NS_PER_S, len(data), len(data)) + data
    path.write_bytes(octets)
    return path


def as_pcapng(path: Path, packets: Sequence[Packet], link_type: int = 1) -> Path:
    """pcapng with one interface and nanoseconds."""

    def block(kind: int, body: bytes) -> bytes:
        size = struct.pack("<I", len(body) + 12)
        return struct.pack("<I", kind) + size + body + size

    octets = block(0x0A0D0D0A, struct.pack("<IHHq", 0x1A2B3C4D, 1, 0, -1))
    octets += block(1, struct.pack("<HHI", link_type, 0, 0) + b"\x09\0\1\0\x09\0\0\0" + b"\0\0\0\0")
    for time, data in packets:
        head = struct.pack("<IIIII", 0, time >> 32, time & 0xFFFFFFFF, len(data), len(data))
        octets += block(6, head + data + b"\0" * (-len(data) % 4))
    path.write_bytes(octets)
    return path
